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
def energy_uniform(mass: float, spring: float, dt: float, u: Array, v: Array) -> float:
    """Return twice the energy of equal nodes and the springs right of them [J]."""
    count, first = v.size - 1, 0
    speeds, stretches, step = all_lanes(0.0), all_lanes(0.0), all_lanes(dt)
    while first + LANES <= count:  # eight nodes at a time
        at, stretch_of = lanes_at(v, first), lanes_at(u, first + 1) - lanes_at(u, first)
        speeds = at * at + speeds
        stretches = (stretch_of - step * (lanes_at(v, first + 1) - at)) * stretch_of + stretches
        first += LANES
    moving, stretched = sum_of_lanes(speeds), sum_of_lanes(stretches)
    for i in range(first, count):
        stretch = u[i + 1] - u[i]
        moving += v[i] * v[i]
        stretched += (stretch - dt * (v[i + 1] - v[i])) * stretch
    return float(mass * moving + spring * stretched)


@UNPACK
def energy_each(mass: Array, springs: Array, dt: float, u: Array, v: Array) -> float:
    """Return the same of nodes that differ."""
    energy = 0.0
    for i in range(v.size - 1):
        stretch = u[i + 1] - u[i]
        energy += mass[i] * v[i] * v[i] + springs[i] * (stretch - dt * (v[i + 1] - v[i])) * stretch
    return float(energy)


@UNPACK
def energy_of_chain(runs: Array, mass: Array, chain: Array, dt: float, u: Array, v: Array) -> float:
    """Return twice the energy that leapfrog conserves in a chain [J].

    It is v M v + u_old K u.
    """
    last = u.size - 1
    energy = mass[last] * v[last] * v[last]
    energy += chain[0] * (u[0] - dt * v[0]) * u[0] + chain[last + 1] * (u[last] - dt * v[last]) * u[last]
    energy += energy_each(mass, window(chain, 1, 1), dt, window(u, 0, 2), window(v, 0, 2))
    done = 1
    for run in range(runs.size // 2):
        count = int(runs[2 * run])
        x, rate = window(u, done, count + 1), window(v, done, count + 1)
        if runs[2 * run + 1] != 0.0:
            energy += energy_uniform(mass[done], chain[done + 1], dt, x, rate)
        else:
            energy += energy_each(window(mass, done, count), window(chain, done + 1, count), dt, x, rate)
        done += count
    return float(energy)
