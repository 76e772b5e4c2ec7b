"""The method of steps on a network, from event to event.

Every front and every change of a contact ends a step. Waves are stored as polynomials on the steps taken, and read one
transit later. A front is a time at which a wave that leaves a node is not smooth; it cuts a step where it arrives, and
goes on as long as the kink it leaves is seen.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from studies.audit.collocation import (
    INNER,
    LAGRANGE,
    OPEN,
    POINTS,
    PRESSED,
    TOP,
    WEIGHTS,
    Net,
    Stage,
    at,
    collocate,
    gained,
    gather,
    slopes,
)
from studies.audit.events import change, ends_of, first_change, roughness
from studies.audit.network import DASHPOT, HARD, HEAVY
from studies.audit.tables import STAGES, Array

DONE, FULL, STUCK = 0, 1, 2
MERGE = 1e-3  # times the roughness over the speed, of the duration: fronts nearer than this are one
TOGGLES = 200  # changes of contacts without progress


class Rule(NamedTuple):
    """How finely to step."""

    longest: float  # s
    rough: float  # largest leading coefficient of a velocity in a step, m/s
    speed: float  # scale, m/s
    force: float  # scale from below, N


class Out(NamedTuple):
    """Everything that a march writes."""

    times: Array  # (steps,)
    steps: Array
    waves: Array  # (steps, ends, stages)
    fronts: Array  # (ends, fronts) departure times
    u: Array  # (samples, nodes)
    force: Array  # (samples, contacts)
    impulse: Array  # (contacts,)
    peak: Array  # (contacts,)
    touches: Array  # (contacts,)
    jumps: Array  # (jumps, 3): time, contact, size
    counts: Array  # steps, jumps, changes


@INNER
def depart(net, out, heads, tails, node, t, m, stage, step, rule, always):  # type: ignore[no-untyped-def]
    """Send a front on from a node at time t, step m.

    It passes through every piece whose wave is not smooth there.
    """
    for e in range(net.node.size):
        if net.node[e] != node:
            continue
        wave = stage.v[:, node] - stage.arriving[:, e]
        value = at(wave, 0.0)
        first, second = slopes(wave, 0.0)
        if m == 0:
            before, b1, b2 = net.before[e // 2], 0.0, 0.0
            span = step
        else:
            before = at(out.waves[m - 1, e], 1.0)
            b1, b2 = slopes(out.waves[m - 1, e], 1.0)
            span = out.steps[m - 1]
        h = rule.longest
        near = h / min(step, span)
        bend = h * abs(first / step - b1 / span) + 0.5 * h * h * abs(second / step**2 - b2 / span**2)
        noise = 30.0 * rule.rough * near + 1e-13 * rule.speed * near * near
        if always or abs(value - before) > 3.0 * rule.rough or bend > noise:
            if tails[e] > heads[e] and out.fronts[e, tails[e] - 1] >= t:
                continue
            if tails[e] < out.fronts.shape[1]:
                out.fronts[e, tails[e]] = t
                tails[e] += 1


@INNER
def record(net, out, stage, t, step, u0, sample, duration):  # type: ignore[no-untyped-def]
    """Fill the samples that lie in a step; return the number of the next."""
    total = out.u.shape[0]
    while sample < total:
        theta = ((sample + 0.5) * duration / total - t) / step
        if theta > 1.0:
            break
        for i in range(net.kind.size):
            out.u[sample, i] = u0[i] + step * gained(stage.v[:, i], theta)
        for c in range(net.left.size):
            out.force[sample, c] = at(stage.force[:, c], theta)
        sample += 1
    return sample


@njit(cache=True)
def march(net, rule, duration, stage, out, u0, v0):  # noqa: C901 - one loop, on purpose # type: ignore[no-untyped-def]
    """Walk to the end; return how it ended."""
    nodes, contacts, ends = net.kind.size, net.left.size, net.node.size
    mode = np.full(contacts, OPEN)
    approach, floors, last = np.ones(contacts), np.full(contacts, 1e-6), np.zeros(contacts)
    least_jump = max(1e-5, 30.0 * rule.rough / rule.speed)  # of the force: smaller ones are the roughness of the steps
    for c in range(contacts):
        # Faces that lie against each other at rest touch from the start on, with the least speed of approach.
        if net.law[c] not in (HARD, DASHPOT) and net.gap[c] == 0.0 and v0[net.left[c]] == v0[net.right[c]]:
            mode[c], approach[c] = PRESSED, floors[c]
            out.touches[c] += 1
    hints, heads, tails = np.zeros(ends, np.int64), np.zeros(ends, np.int64), np.zeros(ends, np.int64)
    fresh, always = np.ones(nodes, np.bool_), np.ones(nodes, np.bool_)
    t, jumps, toggles, changes = 0.0, 0, 0, 0
    m, sample = np.int64(0), np.int64(0)  # for a constant the functions that take them would be compiled twice
    longest = rule.longest
    for transit in net.transit:
        longest = min(longest, transit)
    wanted, strongest = 0.01 * longest, 0.0
    merge = MERGE * rule.rough / rule.speed * duration
    while t < duration - merge:
        if m >= out.times.size:
            out.counts[0], out.counts[1], out.counts[2] = m, jumps, changes
            return FULL
        front = duration
        for e in range(ends):
            if heads[e] < tails[e]:
                front = min(front, out.fronts[e, heads[e]] + net.transit[e // 2])
        step = min(wanted, longest, front - t)
        if front - t < 1.5 * step:
            step = front - t if front - t <= longest else 0.5 * (front - t)
        rejected, cut, turns = False, False, 0
        # Wide enough for the error of a step's polynomials, and wider where a contact cannot decide.
        wide = 2.0 ** min(toggles, 20)
        small_gap = wide * (1e-13 * rule.speed + 1e-4 * rule.rough) * duration
        small_force = wide * (1e-10 + 0.03 * rule.rough / rule.speed) * max(strongest, rule.force)
        while True:
            turns += 1
            if ends:
                gather(net, stage, t, step, m, out.times, out.steps, out.waves, hints)
            good = collocate(net, stage, mode, approach, t, step, u0, v0, 2e-15 * rule.speed)
            rough = roughness(net, stage, TOP)
            if turns > 60:
                return STUCK
            if not cut and (not good or rough > rule.rough) and step > merge:
                rejected = True
                step *= 0.4 if not good else max(0.2, 0.8 * (rule.rough / rough) ** 0.25)
                step = max(step, 0.99 * merge)
                continue
            if not good and step > merge:
                step *= 0.5
                cut = False
                continue
            which, theta = first_change(net, stage, mode, step, u0, small_gap, small_force)
            if which < 0 or (cut and theta > 1.0 - 1e-7):
                break
            if theta * step < 1e-3 * merge:
                break
            step, cut = theta * step, True
        if which >= 0 and theta * step < 1e-3 * merge:
            # The state does not hold from the start of the step on: change it there.
            toggles += 1
            changes += 1
            if toggles > TOGGLES:
                return STUCK
            out.touches[which] += change(net, stage, mode, approach, floors, which, 0.0, step, u0, small_gap)
            for node in (net.left[which], net.right[which]):
                fresh[node], always[node] = True, True
            continue
        toggles = 0
        # A wave that reaches one side of a closed contact continues from the other side, too.
        for _ in range(contacts):
            for c in range(contacts):
                a, b = net.left[c], net.right[c]
                if mode[c] == PRESSED and (fresh[a] or fresh[b]):
                    fresh[a], fresh[b] = True, True
        out.times[m], out.steps[m] = t, step
        for i in range(nodes):
            if fresh[i]:
                depart(net, out, heads, tails, i, t, m, stage, step, rule, always[i])
        for e in range(ends):
            for s in range(STAGES):
                out.waves[m, e, s] = stage.v[s, net.node[e]] - stage.arriving[s, e]
        for c in range(contacts):
            first, end, most = ends_of(stage, c)
            strongest, out.peak[c] = max(strongest, most), max(out.peak[c], most)
            if abs(first - last[c]) > least_jump * strongest and jumps < out.jumps.shape[0]:
                out.jumps[jumps, 0], out.jumps[jumps, 1], out.jumps[jumps, 2] = t, c, first - last[c]
                jumps += 1
            last[c] = end
            for s in range(STAGES):
                out.impulse[c] += step * WEIGHTS[s] * stage.force[s, c]
        sample = record(net, out, stage, t, step, u0, sample, duration)
        if rejected or step >= wanted:
            wanted = step * (2.0 if rough < 0.03 * rule.rough else 1.3 if rough < 0.2 * rule.rough else 1.0)
        wanted = min(wanted, longest)
        if cut and which >= 0:
            changes += 1
        for i in range(nodes):
            fresh[i], always[i] = False, False
        if cut and which >= 0:
            out.touches[which] += change(net, stage, mode, approach, floors, which, 1.0, step, u0, small_gap)
            for node in (net.left[which], net.right[which]):
                fresh[node], always[node] = True, True
            wanted = max(0.1 * min(wanted, longest), 2.0 * merge)
        for i in range(nodes):
            u0[i] += step * gained(stage.v[:, i], 1.0)
            if net.kind[i] == HEAVY:
                for s in range(STAGES):
                    v0[i] += step * WEIGHTS[s] * stage.dv[s, i]
        t, m = t + step, m + 1
        for e in range(ends):
            while heads[e] < tails[e] and out.fronts[e, heads[e]] + net.transit[e // 2] <= t + merge:
                fresh[net.node[e ^ 1]] = True
                heads[e] += 1
    out.counts[0], out.counts[1], out.counts[2] = m, jumps, changes
    return DONE


__all__ = ["DONE", "FULL", "LAGRANGE", "POINTS", "PRESSED", "STUCK", "Net", "Out", "Rule", "Stage", "march"]
