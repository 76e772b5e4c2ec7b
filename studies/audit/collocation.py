"""One step of a network by Gauss collocation.

It has collocation points, waves that arrive, and contacts in their present state.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from studies.audit.network import BARE, DASHPOT, FIXED, HARD, HEAVY, Network
from studies.audit.tables import STAGES, Array, gauss

OPEN, PRESSED, SLACK = 0, 1, 2
POINTS, WEIGHTS, LAGRANGE, COLLOCATION, TOP = gauss()
# Of functions that the march alone calls: without a way in from Python, which takes a sixth of the compiling.
CALLED: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
INNER = njit(cache=True, **CALLED)


class Net(NamedTuple):
    """A network as arrays."""

    kind: Array  # of nodes
    mass: Array
    spring: Array
    dashpot: Array
    force: Array
    load: Array  # impedance at each node
    node: Array  # of each end of a piece: left ends are even
    impedance: Array
    transit: Array
    before: Array  # half the initial velocity of each piece
    left: Array  # of contacts
    right: Array
    law: Array
    gap: Array
    parameters: Array
    gravity: float


class Stage(NamedTuple):
    """Working memory of a step."""

    arriving: Array  # (stages, ends) velocity waves that reach the ends
    pushed: Array  # (stages, nodes) force of these on the nodes
    u: Array  # (stages, nodes), in the frame that falls
    v: Array
    force: Array  # (stages, contacts)
    trial: Array
    gap: Array
    rate: Array  # of indentation
    dv: Array  # (stages, nodes) accelerations of heavy points


def arrays_of(net: Network) -> Net:
    """Return a network as arrays."""
    nodes, pieces, touches = net.nodes, net.pieces, net.touches
    load = np.zeros(len(nodes))
    for piece in pieces:
        for end in (piece.left, piece.right):
            load[end] += piece.impedance
    return Net(
        np.array([n.kind for n in nodes]),
        np.array([n.mass for n in nodes]),
        np.array([n.spring for n in nodes]),
        np.array([n.dashpot for n in nodes]),
        np.array([n.force for n in nodes]),
        load,
        np.array([end for p in pieces for end in (p.left, p.right)], dtype=np.int64),
        np.array([p.impedance for p in pieces]),
        np.array([p.transit for p in pieces]),
        np.array([0.5 * p.velocity for p in pieces]),
        np.array([t.left for t in touches]),
        np.array([t.right for t in touches]),
        np.array([t.law for t in touches]),
        np.array([t.gap for t in touches]),
        np.array([t.parameters for t in touches]).reshape(-1, 3),
        float(net.gravity),
    )


def memory_of(net: Net) -> Stage:
    """Return working memory for a step."""
    n, c, e = len(net.kind), len(net.left), len(net.node)
    return Stage(*(np.zeros((STAGES, size)) for size in (e, n, n, n, c, c, c, c, n)))


@INNER
def respond(net, stage, mode, approach, t, step):  # type: ignore[no-untyped-def]
    """Fill velocities of massless points, accelerations of heavy ones and contact forces at all stages."""
    u, v, dv, trial, gap = stage.u, stage.v, stage.dv, stage.trial, stage.gap
    kind, load, dashpot = net.kind, net.load, net.dashpot
    for s in range(STAGES):
        now = t + POINTS[s] * step
        g, fall = net.gravity * now, 0.5 * net.gravity * now * now
        for i in range(kind.size):
            if kind[i] == FIXED:
                v[s, i], u[s, i] = -g, -fall
                continue
            given = stage.pushed[s, i] + net.force[i] - net.spring[i] * (u[s, i] + fall) - dashpot[i] * g
            if kind[i] == BARE:
                v[s, i] = given / (load[i] + dashpot[i])
            else:
                dv[s, i] = (given - (load[i] + dashpot[i]) * v[s, i]) / net.mass[i]
        for c in range(net.left.size):
            a, b = net.left[c], net.right[c]
            ya = 1.0 / (load[a] + dashpot[a]) if kind[a] == BARE else 0.0
            yb = 1.0 / (load[b] + dashpot[b]) if kind[b] == BARE else 0.0
            gap[s, c] = net.gap[c] + u[s, b] - u[s, a]
            free = v[s, a] - v[s, b]
            if net.law[c] == HARD:
                trial[s, c] = free / (ya + yb)
            elif net.law[c] == DASHPOT:
                k, d = net.parameters[c, 0], net.parameters[c, 1]
                trial[s, c] = (-k * gap[s, c] + d * free) / (1.0 + d * (ya + yb))
            else:
                p = net.parameters[c, 0] * max(0.0, -gap[s, c]) ** net.parameters[c, 1]
                q = p * net.parameters[c, 2] / approach[c]
                trial[s, c] = (p + q * free) / (1.0 + q * (ya + yb))
            force = trial[s, c] if mode[c] == PRESSED else 0.0
            stage.force[s, c], stage.rate[s, c] = force, free - (ya + yb) * force
            if kind[a] == BARE:
                v[s, a] -= ya * force
            elif kind[a] == HEAVY:
                dv[s, a] -= force / net.mass[a]
            if kind[b] == BARE:
                v[s, b] += yb * force
            elif kind[b] == HEAVY:
                dv[s, b] += force / net.mass[b]


@INNER
def gather(net, stage, t, step, count, times, steps, waves, hints):  # type: ignore[no-untyped-def]
    """Fill the waves that arrive at the stages of a step.

    They are read from the pieces stored so far.
    """
    for s in range(STAGES):
        for i in range(net.kind.size):
            stage.pushed[s, i] = 0.0
    for e in range(net.node.size):
        piece = e // 2
        for s in range(STAGES):
            then = t + POINTS[s] * step - net.transit[piece]
            if then < 0.0:
                wave = net.before[piece]
            else:
                m = hints[e]
                while m > 0 and times[m] > then:
                    m -= 1
                while m < count - 1 and times[m] + steps[m] < then:
                    m += 1
                hints[e] = m
                theta, wave = (then - times[m]) / steps[m], 0.0
                for j in range(STAGES):
                    value = LAGRANGE[j, STAGES - 1]
                    for k in range(STAGES - 2, -1, -1):
                        value = value * theta + LAGRANGE[j, k]
                    wave += value * waves[m, e ^ 1, j]
            stage.arriving[s, e] = wave
            stage.pushed[s, net.node[e]] += 2.0 * net.impedance[piece] * wave


@INNER
def collocate(net, stage, mode, approach, t, step, u0, v0, small):  # type: ignore[no-untyped-def]
    """Solve the stages by fixed-point iteration; return whether it converged."""
    n = net.kind.size
    v, u, dv, kind = stage.v, stage.u, stage.dv, net.kind
    largest = 0.0
    for i in range(n):  # element by element: to assign rows takes numba longer to compile than all the rest
        for s in range(STAGES):
            v[s, i], u[s, i], dv[s, i] = v0[i], u0[i], 0.0
        largest = max(largest, abs(u0[i]))
    last = np.inf
    small += 1e-15 * largest / step  # the rounding of displacements
    for turn in range(40):
        change = 0.0
        for i in range(n):
            if kind[i] == FIXED:
                continue
            for s in range(STAGES):
                du, w = 0.0, 0.0
                for j in range(STAGES):
                    du += COLLOCATION[s, j] * v[j, i]
                    w += COLLOCATION[s, j] * dv[j, i]
                if kind[i] == HEAVY:
                    w = v0[i] + step * w
                    change = max(change, abs(w - v[s, i]))
                    v[s, i] = w
                du = u0[i] + step * du
                change = max(change, abs(du - u[s, i]) / step)
                u[s, i] = du
        respond(net, stage, mode, approach, t, step)
        if turn > 0 and change <= small:
            return True
        if turn > 8 and change > 0.7 * last:
            return bool(change <= 100.0 * small)
        last = change
    return False


@INNER
def at(values, theta):  # type: ignore[no-untyped-def]
    """Return the polynomial through values at the stages, at theta."""
    found = 0.0
    for j in range(STAGES):
        value = LAGRANGE[j, STAGES - 1]
        for k in range(STAGES - 2, -1, -1):
            value = value * theta + LAGRANGE[j, k]
        found += value * values[j]
    return found


@INNER
def slopes(values, theta):  # type: ignore[no-untyped-def]
    """Return the first two derivatives of a polynomial by theta.

    It is the polynomial through values at the stages.
    """
    first, second = 0.0, 0.0
    for j in range(STAGES):
        for k in range(1, STAGES):
            first += k * LAGRANGE[j, k] * theta ** (k - 1) * values[j]
            if k > 1:
                second += k * (k - 1) * LAGRANGE[j, k] * theta ** (k - 2) * values[j]
    return first, second


@INNER
def gained(values, theta):  # type: ignore[no-untyped-def]
    """Return the integral from 0 to theta of the polynomial through values at the stages."""
    found = 0.0
    for j in range(STAGES):
        for k in range(STAGES):
            found += LAGRANGE[j, k] / (k + 1) * theta ** (k + 1) * values[j]
    return found
