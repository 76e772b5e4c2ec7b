"""Forces over time on nodes, linear between samples, and their work.

They are compiled for the march. Intervals of the march end at the samples, so that a force is one line in each: its
middle and its rise are the first two Chebyshev coefficients.
"""

from __future__ import annotations

import numpy as np

from impactlab.errors import CaseError
from impactlab.exact.arrays import MarchArrays
from impactlab.exact.results.signals import Signals
from impactlab.exact.setup.network import Log
from impactlab.numerics.compiling import EXACT_PART
from impactlab.scene.bodies import AbstractLoad
from impactlab.scene.problem import Scene
from impactlab.types import Array

TIME, FORCE = 0, 1  # columns of a sample
MAX_LINES = 2000  # of a force within a run: each sends a break that every echo repeats


@EXACT_PART
def next_sample(m: MarchArrays, j: int) -> float:
    """Return the time of the next load sample on junction j [s].

    It is the end of the run if there is none.
    """
    state, junction = m.state[0], m.junctions[j]
    until = state.duration
    for i in range(junction.first_node, junction.last_node):
        node = m.nodes[i]
        if node.last_sample > node.first_sample:
            while node.sample < node.last_sample and m.load[node.sample, TIME] <= junction.clock + state.tolerance:
                node.sample += 1
            if node.sample < node.last_sample:
                until = min(until, m.load[node.sample, TIME])
    return float(until)


@EXACT_PART
def force_at(m: MarchArrays, i: int, t: float) -> float:
    """Return the load on a node at a time [N].

    The time is on the line before its next sample; loads are constant beyond their samples.
    """
    node = m.nodes[i]
    at = node.sample
    if at == node.first_sample:
        return float(m.load[at, FORCE])
    if at == node.last_sample:
        return float(m.load[at - 1, FORCE])
    share = (t - m.load[at - 1, TIME]) / (m.load[at, TIME] - m.load[at - 1, TIME])
    return float(m.load[at - 1, FORCE] + share * (m.load[at, FORCE] - m.load[at - 1, FORCE]))


@EXACT_PART
def write_end_loads(m: MarchArrays, j: int, t0: float, t1: float) -> int:
    """Write the loads on junction j's nodes on [t0, t1]; return their number of coefficients."""
    longest = 1
    for i in range(m.junctions[j].first_node, m.junctions[j].last_node):
        node = m.nodes[i]
        if node.last_sample > node.first_sample:
            early, late = force_at(m, i, t0), force_at(m, i, t1)
            node.end_force, node.end_force_rise = 0.5 * (early + late), 0.5 * (late - early)
            if node.end_force_rise != 0.0:
                longest = 2
    return longest


def loaded(log: Log, nodes: dict[int, AbstractLoad], duration: float) -> Log:
    """Return the log with the samples of the loads on its nodes, by number."""
    if not nodes:
        return log
    parts, at = [log.memory.load], len(log.memory.load)
    for node, load in nodes.items():
        table = load.sampled(duration)
        rows = np.zeros((table.times.size, log.memory.load.shape[1]))
        rows[:, TIME], rows[:, FORCE] = table.times, table.forces
        parts.append(rows)
        log.nodes["first_sample"][node] = log.nodes["sample"][node] = at
        at += len(rows)
        log.nodes["last_sample"][node] = at
        log.junctions["loaded"] |= (log.junctions["first_node"] <= node) & (node < log.junctions["last_node"])
    return log._replace(memory=log.memory._replace(load=np.concatenate(parts)))


def work_of_loads(log: Log, signals: Signals, t: Array) -> Array:
    """Return the work of loads over time from t[0] to rising times t, (n,) [J].

    It is F u less the integral of F' u.
    """
    total = np.zeros_like(t)
    if t.size < 2:
        return total
    nodes, memory = log.nodes, log.memory
    for node in np.flatnonzero(nodes["last_sample"] > nodes["first_sample"]).tolist():
        part = slice(int(nodes["first_sample"][node]), int(nodes["last_sample"][node]))
        times, forces = memory.load[part, TIME], memory.load[part, FORCE]
        moved = signals.displacement(node)
        start, stop = float(t[0]), float(t[-1])
        knots = np.concatenate(([start], times[(times > start) & (times < stop)], [stop]))
        at_knots = np.interp(knots, times, forces)
        slopes = np.diff(at_knots) / np.diff(knots)
        areas = moved.integral(knots, False)
        whole = np.concatenate(([0.0], np.cumsum(slopes * np.diff(areas))))
        piece = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, len(slopes) - 1)
        bent = whole[piece] + slopes[piece] * (moved.integral(t, False) - areas[piece])
        done = np.interp(t, times, forces) * moved(t) - bent
        total += done - done[0]
    return total


def check_loads(scene: Scene) -> None:
    """Raise `CaseError` for a force over time that is not a few straight lines."""
    for name, body in scene.bodies.items():
        for x, load in body.loads:
            path = f"bodies.{name}.ends.{'left' if x == 0.0 else 'right'}"
            lines = load.lines(scene.duration)
            if lines is None:
                raise CaseError(
                    f"the force over time on '{name}' is a formula; the exact solver supports only straight lines",
                    path=path,
                    remedy="Give a table {t: [...], f: [...]}, or use finite_element or modal.",
                )
            if lines > MAX_LINES:
                raise CaseError(
                    f"the force over time on '{name}' has {lines} straight lines within the run; the exact "
                    f"solver supports up to {MAX_LINES}",
                    path=path,
                    remedy="Give fewer samples, or use finite_element or modal.",
                )
