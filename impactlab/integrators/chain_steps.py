"""Leapfrog step of a chain of springs in one pass, and its energy.

Each node reads its neighbours before they move, so velocities and displacements are written in the same pass. Nodes of
a uniform segment share one factor, so that only displacements and velocities are read and written.
"""

from __future__ import annotations

import numpy as np

from impactlab.numerics.addresses import entered
from impactlab.numerics.chain_solve import SAME_TOL
from impactlab.numerics.compiling import EXACT_ENTRY, EXACT_PART, UNPACK
from impactlab.numerics.lanes import LANES, after_last, all_lanes, lane, lanes_at, put_lanes, sum_of_lanes
from impactlab.numerics.windows import window
from impactlab.types import Array

MIN_RUN = 8  # nodes: a shorter run of equal ones takes as long node by node


def runs_of(gain: Array, chain: Array, mass: Array) -> Array:
    """Return the runs of a chain without its outer nodes, flat: see `write_runs`."""
    runs = np.zeros(2 * gain.size)
    return runs[: entered(write_runs, gain, chain, mass, runs)]


@EXACT_ENTRY
def write_runs(gain: Array, chain: Array, mass: Array, runs: Array) -> int:
    """Write the runs of a chain without its outer nodes.

    A run is a number of nodes and the factor that they share, 0 if none. ``gain`` (n,) is dt over the masses, ``chain``
    (n + 1,) the stiffness of the springs, those to the ground at both ends included. The factor is gain times
    stiffness, on both sides of a node; the nodes of a run have one ``mass``. Return how many numbers were written into
    ``runs``, which has room for 2 n.
    """
    written, first, last = 0, 1, gain.size - 1
    for node in range(1, last):
        if node + 1 < last and joins_next(gain, chain, mass, node):
            continue
        count, factor = node + 1 - first, gain[first] * chain[first]
        if count >= MIN_RUN and factor != 0.0:
            runs[written], runs[written + 1] = count, factor
            written += 2
        elif written > 0 and runs[written - 1] == 0.0:
            runs[written - 2] += count
        else:
            runs[written], runs[written + 1] = count, 0.0
            written += 2
        first = node + 1
    return written


@EXACT_PART
def joins_next(gain: Array, chain: Array, mass: Array, node: int) -> bool:
    """Return whether a node and the next one share factor and mass, up to rounding."""
    for each in range(node, node + 2):
        left, right = gain[each] * chain[each], gain[each] * chain[each + 1]
        if not abs(right - left) <= SAME_TOL * abs(left):
            return False
    here, after = gain[node] * chain[node], gain[node + 1] * chain[node + 1]
    alike = abs(after - here) <= SAME_TOL * abs(after)
    return bool(alike and abs(mass[node + 1] - mass[node]) <= SAME_TOL * mass[node + 1])


@UNPACK
def pass_uniform(count: int, factor: float, dt: float, before: float, u: Array, v: Array) -> float:
    """Step nodes that share a factor; return the old displacement of the last.

    ``before`` is the old displacement of the node left of them.
    """
    first, stretch = 0, u[0] - before
    factors, step, stretches = all_lanes(factor), all_lanes(dt), all_lanes(stretch)
    while first + LANES <= count:  # eight nodes at a time, which read their neighbours before these are written
        old = lanes_at(u, first)
        on_the_left, stretches = stretches, lanes_at(u, first + 1) - old
        rate = factors * (stretches - after_last(on_the_left, stretches)) + lanes_at(v, first)
        put_lanes(v, first, rate)
        put_lanes(u, first, step * rate + old)
        first, before = first + LANES, lane(old, LANES - 1)
    here, stretch = u[first], lane(stretches, LANES - 1)
    x, rates = window(u, first, count - first + 1), window(v, first, count - first)
    for i in range(count - first):
        after = x[i + 1]
        on_left, stretch = stretch, after - here
        rates[i] += factor * (stretch - on_left)
        x[i] = here + dt * rates[i]
        before, here = here, after
    return before


@UNPACK
def pass_each(count: int, gain: Array, chain: Array, dt: float, before: float, u: Array, v: Array) -> float:
    """Step nodes that differ, as `pass_uniform` those that do not."""
    here = u[0]
    for i in range(count):
        after = u[i + 1]
        v[i] += gain[i] * (chain[i] * (before - here) + chain[i + 1] * (after - here))
        u[i] = here + dt * v[i]
        before, here = here, after
    return before


@UNPACK
def step_chain(runs: Array, gain: Array, chain: Array, dt: float, u: Array, v: Array) -> None:
    """Step a chain of two nodes or more, tied to the ground at both ends.

    v += dt M^-1 (-K u), then u += dt v.
    """
    last, done = u.size - 1, 1
    before = u[0]
    v[0] += gain[0] * (chain[1] * (u[1] - before) - chain[0] * before)
    u[0] += dt * v[0]
    for run in range(runs.size // 2):
        count, factor = int(runs[2 * run]), runs[2 * run + 1]
        x, rate = window(u, done, count + 1), window(v, done, count)
        if factor != 0.0:
            before = pass_uniform(count, factor, dt, before, x, rate)
        else:
            given, springs = window(gain, done, count), window(chain, done, count + 1)
            before = pass_each(count, given, springs, dt, before, x, rate)
        done += count
    v[last] += gain[last] * (chain[last] * (before - u[last]) - chain[last + 1] * u[last])
    u[last] += dt * v[last]


@UNPACK
def measure_uniform(mass: float, spring: float, dt: float, u: Array, v: Array) -> tuple[float, float]:
    """Return twice the energy of equal nodes, all but the first, with the springs left of them [J]; their momentum."""
    first, step, at, speed = 1, all_lanes(dt), all_lanes(u[0]), all_lanes(v[0])
    speeds = moving = other_moving = stretched = other_stretched = all_lanes(0.0)
    while first + LANES <= v.size:  # eight nodes at a time, each read once; two sums in turn: each waits for its last
        on_left, slower = at, speed
        at, speed = lanes_at(u, first), lanes_at(v, first)
        stretch = at - after_last(on_left, at)
        twice = (stretch - step * (speed - after_last(slower, speed))) * stretch
        moving, other_moving = other_moving, speed * speed + moving
        stretched, other_stretched = other_stretched, twice + stretched
        speeds = speeds + speed
        first += LANES
    energy = mass * sum_of_lanes(moving + other_moving) + spring * sum_of_lanes(stretched + other_stretched)
    total = sum_of_lanes(speeds)
    for i in range(first, v.size):
        change = u[i] - u[i - 1]
        energy += mass * v[i] * v[i] + spring * (change - dt * (v[i] - v[i - 1])) * change
        total += v[i]
    return float(energy), float(mass * total)


@UNPACK
def measure_each(mass: Array, springs: Array, dt: float, u: Array, v: Array) -> tuple[float, float]:
    """Return energy [J] and momentum [N s] of nodes with a ``mass`` and a spring each, as `measure_chain` does."""
    energy = momentum = 0.0
    for i in range(mass.size):
        stretch = u[i + 1] - u[i]
        energy += mass[i] * v[i + 1] * v[i + 1] + springs[i] * (stretch - dt * (v[i + 1] - v[i])) * stretch
        momentum += mass[i] * v[i + 1]
    return float(energy), float(momentum)


@UNPACK
def measure_chain(runs: Array, mass: Array, chain: Array, dt: float, u: Array, v: Array) -> tuple[float, float]:
    """Return twice the energy that leapfrog conserves in a chain [J], and its momentum [N s].

    They are v M v + u_old K u and the sum of M v.
    """
    last, done, momentum = u.size - 1, 0, mass[0] * v[0]
    energy = momentum * v[0]
    energy += chain[0] * (u[0] - dt * v[0]) * u[0] + chain[last + 1] * (u[last] - dt * v[last]) * u[last]
    for run in range(runs.size // 2):
        count = int(runs[2 * run])
        x, rate = window(u, done, count + 1), window(v, done, count + 1)
        if runs[2 * run + 1] != 0.0:
            of_run = measure_uniform(mass[done + 1], chain[done + 1], dt, x, rate)
        else:
            of_run = measure_each(window(mass, done + 1, count), window(chain, done + 1, count), dt, x, rate)
        energy, momentum, done = energy + of_run[0], momentum + of_run[1], done + count
    masses, springs = window(mass, last, 1), window(chain, last, 1)
    of_last = measure_each(masses, springs, dt, window(u, done, 2), window(v, done, 2))
    return float(energy + of_last[0]), float(momentum + of_last[1])
