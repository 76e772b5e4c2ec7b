"""The compiled leapfrog step of a row of beam elements, node by node.

The energy of an element is stated at `impactlab.models.mesh.beam_runs.BeamElements`. Forces come from differences
of deflections, so that a body far from its start feels little rounding of its travel.

Parameters: a header, whose places are the constants below, then the arrays that `split` returns.
"""

from __future__ import annotations

import numpy as np

from impactlab.models.mesh.beam_runs import BeamElements
from impactlab.numerics.compiling import HELPER, UNPACK
from impactlab.numerics.lanes import LANES, lanes_at, lanes_of_pairs, put_lanes, swapped
from impactlab.numerics.windows import window
from impactlab.types import Array

# Places in the header: size, step, marks of damping and of rotations held, coordinates before the first whole node,
# number of whole nodes, of runs, stiffness of the ends (12), softening, mark of the load.
N, DT, DAMPED, RESTED, LEAD, NODES, RUNS, ENDS = range(8)
SOFT, LOADED, LOAD = 20, 21, 22


@UNPACK
def split(parameters: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Return the arrays of the parameters: load, gain, and others.

    They are load, gain dt/(M + dt C/2), share kept of v, mass, springs at rotations, and runs or elements, flat.
    """
    n, nodes = int(parameters[N]), int(parameters[NODES])
    springs = LOAD + 4 * n
    runs = springs + nodes
    return (
        window(parameters, LOAD, n),
        window(parameters, LOAD + n, n),
        window(parameters, LOAD + 2 * n, n),
        window(parameters, LOAD + 3 * n, n),
        window(parameters, springs, nodes),
        window(parameters, runs, parameters.size - runs),
    )


@UNPACK
def move(n: int, soft: float, damped: bool, dt: float, gain: Array, mass: Array, u: Array, v: Array) -> None:
    """Add the centrifugal force to the velocities; then u += dt v.

    It is softening times mass and displacement.
    """
    if soft != 0.0 and not damped:  # gain times mass is the step
        for i in range(n):
            v[i] += soft * dt * u[i]
            u[i] += dt * v[i]
        return
    if soft != 0.0:
        for i in range(n):
            v[i] += soft * gain[i] * mass[i] * u[i]
    for i in range(n):
        u[i] += dt * v[i]


@HELPER
def along(
    count: int, a: float, arm: float, b: float, x: Array, gain: Array, rate: Array, before: float, turn: float
) -> tuple[float, float]:
    """Add the forces of a run of equal elements to the rates.

    Given are those of the element before; returned are those of the last. With x'' = (x_next - x) + (x_last - x) a node
    inside the run feels a w'' - a arm (theta_next - theta_last) along w, and along theta a arm (w_next - w_last) -
    a arm^2 (theta'' + 4 theta) + b theta'': four nodes at a time.
    """
    of_curve, of_slope = lanes_of_pairs(a, b - a * arm * arm), lanes_of_pairs(-a * arm, a * arm)
    of_here = lanes_of_pairs(0.0, -4.0 * a * arm * arm)
    force = a * (x[2] - x[0] - arm * (x[1] + x[3]))
    moment = b * (x[3] - x[1])
    rate[0] += gain[0] * (force - before)
    rate[1] += gain[1] * (arm * (force + before) + moment - turn)
    i, last = 2, 2 * count
    while i + LANES <= last:
        here, back, on = lanes_at(x, i), lanes_at(x, i - 2), lanes_at(x, i + 2)
        curve = (on - here) + (back - here)
        pull = of_curve * curve + of_slope * swapped(on - back) + of_here * here
        put_lanes(rate, i, lanes_at(rate, i) + lanes_at(gain, i) * pull)
        i += LANES
    e = i // 2 - 1
    before = a * (x[2 * e + 2] - x[2 * e] - arm * (x[2 * e + 1] + x[2 * e + 3]))
    turn = b * (x[2 * e + 3] - x[2 * e + 1])
    for k in range(e + 1, count):
        force = a * (x[2 * k + 2] - x[2 * k] - arm * (x[2 * k + 1] + x[2 * k + 3]))
        moment = b * (x[2 * k + 3] - x[2 * k + 1])
        rate[2 * k] += gain[2 * k] * (force - before)
        rate[2 * k + 1] += gain[2 * k + 1] * (arm * (force + before) + moment - turn)
        before, turn = force, moment
    return before, turn


@HELPER
def along_each(count: int, table: Array, rest: Array, x: Array, gain: Array, rate: Array) -> None:
    """Add the forces of elements that differ, and of springs, to the rates.

    ``rest`` are the springs at rotations. ``table`` holds a, l1, 0 and l2, b, each along the row.
    """
    before, turn, lever = 0.0, 0.0, 0.0
    stiff, nears = table[:count], table[count : 2 * count]
    fars, bent = table[2 * count + 1 : 3 * count + 1], table[3 * count + 1 :]
    for e in range(count):
        near, far = nears[e], fars[e]
        w, theta, next_w, next_theta = x[2 * e], x[2 * e + 1], x[2 * e + 2], x[2 * e + 3]
        force = stiff[e] * (next_w - w - near * theta - far * next_theta)
        moment = bent[e] * (next_theta - theta)
        rate[2 * e] += gain[2 * e] * (force - before)
        rate[2 * e + 1] += gain[2 * e + 1] * (near * force + lever * before + moment - turn - rest[e] * theta)
        before, turn, lever = force, moment, far
    rate[2 * count] -= gain[2 * count] * before
    rate[2 * count + 1] += gain[2 * count + 1] * (table[3 * count] * before - turn)


def free(parameters: Array, state: Array) -> None:
    """Step without contact: leapfrog on velocities, then displacements.

    v += dt M^-1 (load - K u - C (v_old + v_new)/2), then u += dt v.
    """
    n, lead, runs = int(parameters[N]), int(parameters[LEAD]), int(parameters[RUNS])
    ends, dt, soft = window(parameters, ENDS, SOFT - ENDS), parameters[DT], parameters[SOFT]
    load, gain, keep, mass, rest, table = split(parameters)
    u, v = window(state, 0, n), window(state, n, n)
    if parameters[DAMPED] != 0.0:
        for i in range(n):
            v[i] *= keep[i]
    before, turn, lever, done = 0.0, 0.0, 0.0, lead
    for run in range(runs):
        count, a, arm, b = int(table[4 * run]), table[4 * run + 1], table[4 * run + 2], table[4 * run + 3]
        v[done + 1] += gain[done + 1] * (lever - arm) * before
        lever = arm
        before, turn = along(
            count,
            a,
            arm,
            b,
            window(u, done, u.size - done),
            window(gain, done, gain.size - done),
            window(v, done, v.size - done),
            before,
            turn,
        )
        done += 2 * count
    if runs == 0:
        count = int(parameters[NODES]) - 1
        along_each(
            count,
            table,
            rest,
            window(u, lead, u.size - lead),
            window(gain, lead, gain.size - lead),
            window(v, lead, v.size - lead),
        )
        done += 2 * count
    v[done] -= gain[done] * before
    v[done + 1] += gain[done + 1] * (lever * before - turn)
    if runs > 0 and parameters[RESTED] != 0.0:
        x, rate, push_of = (
            window(u, lead, u.size - lead),
            window(v, lead, v.size - lead),
            window(gain, lead, gain.size - lead),
        )
        for k in range(rest.size):
            rate[2 * k + 1] -= push_of[2 * k + 1] * rest[k] * x[2 * k + 1]
    for end in range(2):
        i = done if end else lead
        v[i] -= gain[i] * (ends[3 * end] * u[i] + ends[3 * end + 1] * u[i + 1])
        v[i + 1] -= gain[i + 1] * (ends[3 * end + 1] * u[i] + ends[3 * end + 2] * u[i + 1])
        lone = n - 1 if end else 0
        own, of_w, of_theta = ends[6 + 3 * end], ends[7 + 3 * end], ends[8 + 3 * end]
        if own != 0.0:
            v[lone] -= gain[lone] * (own * u[lone] + of_w * u[i] + of_theta * u[i + 1])
            v[i] -= gain[i] * of_w * u[lone]
            v[i + 1] -= gain[i + 1] * of_theta * u[lone]
    if parameters[LOADED] != 0.0:
        for i in range(n):
            v[i] += gain[i] * load[i]
    move(n, soft, parameters[DAMPED] != 0.0, dt, gain, mass, u, v)


def measure(parameters: Array, state: Array, out: Array) -> None:
    """Write the energy that leapfrog conserves and the work of its load [J].

    The energy is v M v/2 + u_old K u/2.
    """
    n, lead, runs = int(parameters[N]), int(parameters[LEAD]), int(parameters[RUNS])
    ends, dt, soft = window(parameters, ENDS, SOFT - ENDS), parameters[DT], parameters[SOFT]
    load, _, _, mass, rest, table = split(parameters)
    u, v = window(state, 0, n), window(state, n, n)
    energy, work, done = 0.0, 0.0, lead
    for i in range(n):
        energy += mass[i] * v[i] * v[i]
    for run in range(runs):
        count, a, arm, b = int(table[4 * run]), table[4 * run + 1], table[4 * run + 2], table[4 * run + 3]
        x, rate = window(u, done, u.size - done), window(v, done, v.size - done)
        for e in range(count):
            sheared = x[2 * e + 2] - x[2 * e] - arm * (x[2 * e + 1] + x[2 * e + 3])
            bent = x[2 * e + 3] - x[2 * e + 1]
            shearing = rate[2 * e + 2] - rate[2 * e] - arm * (rate[2 * e + 1] + rate[2 * e + 3])
            bending = rate[2 * e + 3] - rate[2 * e + 1]
            energy += a * sheared * (sheared - dt * shearing) + b * bent * (bent - dt * bending)
        done += 2 * count
    if runs == 0:
        x, rate, count = window(u, lead, u.size - lead), window(v, lead, v.size - lead), int(parameters[NODES]) - 1
        for e in range(count):
            a, near = table[e], table[count + e]
            far, b = table[2 * count + 1 + e], table[3 * count + 1 + e]
            sheared = x[2 * e + 2] - x[2 * e] - near * x[2 * e + 1] - far * x[2 * e + 3]
            bent = x[2 * e + 3] - x[2 * e + 1]
            shearing = rate[2 * e + 2] - rate[2 * e] - near * rate[2 * e + 1] - far * rate[2 * e + 3]
            bending = rate[2 * e + 3] - rate[2 * e + 1]
            energy += a * sheared * (sheared - dt * shearing) + b * bent * (bent - dt * bending)
        done += 2 * count
    if soft != 0.0:
        for i in range(n):
            energy -= soft * mass[i] * u[i] * (u[i] - dt * v[i])
    if parameters[RESTED] != 0.0:
        x, rate = window(u, lead, u.size - lead), window(v, lead, v.size - lead)
        for k in range(rest.size):
            energy += rest[k] * x[2 * k + 1] * (x[2 * k + 1] - dt * rate[2 * k + 1])
    for end in range(2):
        i = done if end else lead
        lone = n - 1 if end else 0
        w, theta, own = u[i], u[i + 1], u[lone]
        old_w, old_theta, old_own = w - dt * v[i], theta - dt * v[i + 1], own - dt * v[lone]
        energy += ends[3 * end] * w * old_w + ends[3 * end + 2] * theta * old_theta
        energy += ends[3 * end + 1] * (w * old_theta + theta * old_w)
        if ends[6 + 3 * end] != 0.0:
            energy += ends[6 + 3 * end] * own * old_own
            energy += ends[7 + 3 * end] * (own * old_w + w * old_own)
            energy += ends[8 + 3 * end] * (own * old_theta + theta * old_own)
    if parameters[LOADED] != 0.0:
        for i in range(n):
            work += load[i] * (u[i] - 0.5 * dt * v[i])
    out[0], out[1] = 0.5 * energy, work


def packed(row: BeamElements, dt: float, each: Array, damped: bool, loaded: bool) -> Array:
    """Return the parameters of the kernels; ``each`` holds load, gain, keep and mass, (4, n_dof)."""
    header = np.zeros(LOAD)
    header[:ENDS] = (each.shape[1], dt, damped, np.any(row.rest), row.lead, row.nodes, len(row.runs))
    header[ENDS : ENDS + 12] = row.ends
    header[SOFT], header[LOADED] = row.softening, loaded
    stiff, near, far, bent = row.each.T
    table = row.runs.ravel() if len(row.runs) else np.concatenate((stiff, near, [0.0], far, bent))
    return np.concatenate((header, each.ravel(), row.rest, table))
