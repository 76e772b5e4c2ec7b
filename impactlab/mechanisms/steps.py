"""The midpoint rule for a mechanism, compiled: free step, columns of contact forces, readings, energy.

A step of length dt predicts its middle with the accelerations of the two steps before, contact forces included, on a
line in time, and takes all terms there. Only the elastic forces are taken at the true middle: with S = M + dt^2 K/4 the
acceleration is linear in the contact forces. The state holds p (n), readings (r), v (n), rates of the readings (r), the
acceleration (n), moments of the drives (d), work of drives and loads [J], the time, the lengths of the last two steps
[s], and the acceleration of the step before the last (n).

References
----------
SimoTarnow1992.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from impactlab.mechanisms.layout import add, dot, times
from impactlab.numerics.addresses import call
from impactlab.numerics.compiling import PART, UNPACK
from impactlab.numerics.windows import window
from impactlab.types import Array

# Numbers of a mechanism before those of its `terms`.
TERMS, COORDINATES, READINGS, DRIVES, STEP, DRIVES_AT, STIFFNESS_AT, OWN_AT, ROOM_AT, PORTS_AT = range(10)
IMPULSES, HEAD = 10, 11  # 1 where a law gives impulses; the count of these numbers
BOOKED = 4  # numbers after the moments of the drives: work, time, lengths of the last two steps
DRIVEN, RATE, WITHIN, DRIVE = range(4)  # of a drive: coordinate, rate, time within which it is reached; their number


class Middle(NamedTuple):
    """Views of the numbers of a mechanism in the middle of a step."""

    drives: Array  # (d, DRIVE) flat
    stiffness: Array  # (n n,)
    quarter: Array  # (n,) of the squared frequency of each coordinate [1/s2]; (1 - t)/(1 + t) at t = its part in dt^2
    mass: Array  # (n n,)
    force: Array  # (n,)
    rows: Array  # (r n,)
    values: Array  # (r + 1,)
    rates: Array  # (r,)
    factor: Array  # (n n,) of M + dt^2 K/4, drives held
    bare: Array  # (n n,) of M, drives held
    x: Array  # (n,)
    y: Array  # (n,)
    a: Array  # (n,) accelerations


def state_size(n: int, readings: int, drives: int) -> int:
    """Return the numbers in the state of a mechanism with n coordinates."""
    return 2 * (n + readings) + n + drives + BOOKED + n


@UNPACK
def middle_of(P: Array) -> Middle:
    """Return the views of the numbers of a mechanism."""
    n, r = int(P[COORDINATES]), int(P[READINGS])
    drives, stiffness, mass = int(P[DRIVES_AT]), int(P[STIFFNESS_AT]), int(P[ROOM_AT])
    square = n * n
    quarter, force = stiffness + square, mass + square
    rows = force + n
    values = rows + r * n
    rates = values + r + 1
    factor = rates + r
    x = factor + 2 * square
    return Middle(
        window(P, drives, stiffness - drives), window(P, stiffness, square), window(P, quarter, n),
        window(P, mass, square), window(P, force, n), window(P, rows, r * n), window(P, values, r + 1),
        window(P, rates, r), window(P, factor, square), window(P, factor + square, square),
        window(P, x, n), window(P, x + n, n), window(P, x + 2 * n, n),
    )  # fmt: skip


@PART
def evaluate(P: Array, m: Middle, time: float, p: Array, v: Array, with_mass: bool) -> None:
    """Take the terms at a state; without the mass, readings only."""
    mass = m.mass if with_mass else window(m.mass, 0, 0)
    own_at = int(P[OWN_AT])
    own = window(P, own_at, int(P[ROOM_AT]) - own_at)
    call(int(P[TERMS]), own, time, p, v, mass, m.force, m.rows, m.values, m.rates)


@PART
def driven(drives: Array, number: int) -> int:
    """Return the coordinate of a drive."""
    return int(drives[number * DRIVE + DRIVEN])


@PART
def driven_acceleration(drives: Array, number: int, time: float) -> float:
    """Return the angular acceleration of a drive [rad/s2]."""
    rate, within = drives[number * DRIVE + RATE], drives[number * DRIVE + WITHIN]
    if within <= 0.0 or time >= within:
        return 0.0
    return float(rate / within * (1.0 - math.cos(2.0 * math.pi * time / within)))


@PART
def factorise(m: Middle, factor: Array, weight: float) -> None:
    """Write the Cholesky factor of M + weight K, with the coordinates of drives held.

    Upper, row by row; on its diagonal the inverse. Two rows at a time are taken off those below.
    """
    n = m.force.size
    for i in range(n * n):
        factor[i] = m.mass[i] + weight * m.stiffness[i]
    for number in range(m.drives.size // DRIVE):
        d = driven(m.drives, number)
        for j in range(n):
            factor[d * n + j] = factor[j * n + d] = 1.0 if j == d else 0.0
    for k in range(0, n, 2):
        first, second = window(factor, k * n + k, n - k), window(factor, (k + 1) * n + k + 1, n - k - 1)
        scale(first)
        if second.size == 0:
            break
        add(second, -first[1], window(first, 1, second.size))
        scale(second)
        for i in range(1, second.size):
            rest = second.size - i
            row, one, two = (
                window(factor, (k + 1 + i) * (n + 1), rest),
                window(first, 1 + i, rest),
                window(second, i, rest),
            )
            a, b = one[0], two[0]
            for j in range(row.size):
                row[j] -= a * one[j] + b * two[j]


@PART
def scale(row: Array) -> None:
    """Divide a row by the root of its first number, and write the inverse root there.

    NaN where this number is not positive, by rounding: in a trial step far too long, which `adaptive` then shortens.
    """
    inverse = 1.0 / math.sqrt(row[0]) if row[0] > 0.0 else math.nan
    for j in range(row.size):
        row[j] *= inverse
    row[0] = inverse


@PART
def solve(factor: Array, x: Array) -> None:
    """Solve with a Cholesky factor, in place; held coordinates keep their values."""
    n = x.size
    for i in range(n):
        x[i] *= factor[i * n + i]
        rest = n - i - 1
        add(window(x, i + 1, rest), -x[i], window(factor, i * n + i + 1, rest))
    for i in range(n - 1, -1, -1):
        rest = n - i - 1
        x[i] = factor[i * n + i] * (x[i] - dot(window(factor, i * n + i + 1, rest), window(x, i + 1, rest)))


@PART
def hold(drives: Array, x: Array) -> None:
    """Let the coordinates of drives stay."""
    for number in range(drives.size // DRIVE):
        x[driven(drives, number)] = 0.0


@PART
def take_step(P: Array, state: Array) -> None:
    """Take a step without contact; the terms and factor of its middle stay for `columns`."""
    m = middle_of(P)
    n, r, dt, n_drives = m.force.size, m.rates.size, P[STEP], m.drives.size // DRIVE
    weight, end = 0.25 * dt * dt, 2 * (n + r) + n
    p, v, last = window(state, 0, n), window(state, n + r, n), window(state, 2 * (n + r), n)
    booked = window(state, end + n_drives, BOOKED)
    older = window(state, end + n_drives + BOOKED, n)
    steady = booked[2] == dt and booked[3] == dt  # a cut step marks an event, across which no line is followed
    for i in range(n):
        m.a[i] = last[i]
        if steady:
            turned = dt * dt * m.quarter[i]
            m.a[i] += (1.0 - turned) / (1.0 + turned) * (last[i] - older[i])
        m.x[i] = p[i] + 0.5 * dt * v[i] + weight * m.a[i]
        m.y[i] = v[i] + 0.5 * dt * m.a[i]
    now = booked[1] + 0.5 * dt
    evaluate(P, m, now, m.x, m.y, True)
    factorise(m, m.factor, weight)
    times(m.stiffness, m.a, m.x)
    for i in range(n):
        m.force[i] += weight * m.x[i]
        m.a[i] = m.force[i]
    for number in range(n_drives):
        given = driven_acceleration(m.drives, number, now)
        d = driven(m.drives, number)
        add(m.a, -given, window(m.mass, d * n, n))
        add(m.a, -given * weight, window(m.stiffness, d * n, n))
    for number in range(n_drives):
        m.a[driven(m.drives, number)] = driven_acceleration(m.drives, number, now)
    solve(m.factor, m.a)
    work = 0.0
    for number in range(n_drives):
        d = driven(m.drives, number)
        moment = moment_of(m, d, weight, m.a) - m.force[d]
        state[end + number] = moment
        work += moment * dt * (v[d] + 0.5 * dt * m.a[d])
    booked[0] += work
    for i in range(n):
        m.x[i] = dt * v[i] + 0.5 * dt * dt * m.a[i]  # moved in the step
    for k in range(r):
        row = window(m.rows, k * n, n)
        state[n + k] += dot(row, m.x)
        state[2 * n + r + k] += dt * dot(row, m.a)
    for i in range(n):
        p[i] += m.x[i]
        v[i] += dt * m.a[i]
        older[i], last[i] = last[i], m.a[i]
    booked[1], booked[2], booked[3] = booked[1] + dt, dt, booked[2]


@PART
def moment_of(m: Middle, d: int, weight: float, a: Array) -> float:
    """Return the inertia force on the coordinate of a drive, of accelerations."""
    n = a.size
    return dot(window(m.mass, d * n, n), a) + weight * dot(window(m.stiffness, d * n, n), a)


@PART
def write_response(m: Middle, moved: Array, displacement: float, velocity: float, a: Array, keep: float) -> None:
    """Add the state at the step's end by an acceleration or a velocity jump."""
    n, r = a.size, m.rates.size
    add(window(moved, 0, n), displacement, a)
    add(window(moved, n + r, n), velocity, a)
    add(window(moved, 2 * (n + r), n), keep, a)
    for k in range(r):
        total = dot(window(m.rows, k * n, n), a)
        moved[n + k] += displacement * total
        moved[2 * n + r + k] += velocity * total


@PART
def write_force(P: Array, m: Middle, state: Array, row: Array, force: Array) -> None:
    """Write the state per unit force along a row."""
    n, r, dt, n_drives = m.force.size, m.rates.size, P[STEP], m.drives.size // DRIVE
    n_dof, weight = n + r, 0.25 * dt * dt
    end = 2 * n_dof + n
    for i in range(n):
        m.x[i] = row[i]
    hold(m.drives, m.x)
    solve(m.factor, m.x)
    write_response(m, force, 0.5 * dt * dt, dt, m.x, 1.0)
    for number in range(n_drives):
        d = driven(m.drives, number)
        turning = state[n_dof + d] - 0.5 * dt * state[2 * n_dof + d]  # in the middle
        force[end + number] = moment_of(m, d, weight, m.x) - row[d]
        force[end + n_drives] += force[end + number] * dt * turning


@PART
def write_columns(P: Array, state: Array, jump: Array, responses: Array) -> None:
    """Write velocities per impulse, and the response columns at each port.

    The columns are the state per unit force, impulse and projection. Called after `free`, whose middle they belong to;
    ``state`` is that at the end of the free step.
    """
    m = middle_of(P)
    n, r, dt, n_drives = m.force.size, m.rates.size, P[STEP], m.drives.size // DRIVE
    n_dof, size = n + r, state.size
    ports, end, ports_at = jump.size // n_dof, 2 * n_dof + n, int(P[PORTS_AT])
    used = (3 if P[IMPULSES] != 0.0 else 1) * ports * size  # without impulses the other columns stay
    for i in range(used):
        responses[i] = 0.0
    if P[IMPULSES] != 0.0:
        factorise(m, m.bare, 0.0)
    for port in range(ports):
        number = int(P[ports_at + port])
        row = window(m.rows, number * n, n)
        write_force(P, m, state, row, window(responses, port * size, size))
        if P[IMPULSES] == 0.0:
            continue
        impulse = window(responses, (ports + port) * size, size)
        projection = window(responses, (2 * ports + port) * size, size)
        for i in range(n):
            m.y[i] = row[i]
        hold(m.drives, m.y)
        solve(m.bare, m.y)
        write_response(m, impulse, dt, 1.0, m.y, 0.0)
        write_response(m, projection, 1.0, 0.0, m.y, 0.0)
        for number in range(n_drives):
            d = driven(m.drives, number)
            turning = state[n_dof + d] - 0.5 * dt * state[2 * n_dof + d]  # in the middle
            impulse[end + n_drives] += (dot(window(m.mass, d * n, n), m.y) - row[d]) * turning
        out = window(jump, port * n_dof, n_dof)
        for i in range(n):
            out[i] = m.y[i]
        for k in range(r):
            out[n + k] = dot(window(m.rows, k * n, n), m.y)
        # an impulse acts at the start of the step: its motion is pulled back within it
        times(m.stiffness, m.y, m.x)
        for i in range(n):
            m.x[i] *= -0.5 * dt
        hold(m.drives, m.x)
        solve(m.factor, m.x)
        write_response(m, impulse, 0.5 * dt * dt, dt, m.x, 1.0)


@PART
def take_readings(P: Array, state: Array) -> None:
    """Take the readings and their rates again at the state, so that nothing drifts."""
    m = middle_of(P)
    n, r = m.force.size, m.rates.size
    time = state[2 * (n + r) + n + m.drives.size // DRIVE + 1]
    evaluate(P, m, time, window(state, 0, n), window(state, n + r, n), False)
    for k in range(r):
        state[n + k], state[2 * n + r + k] = m.values[k], m.rates[k]


@PART
def take_energy(P: Array, state: Array, out: Array) -> None:
    """Write the energy and the work of loads and drives [J]."""
    m = middle_of(P)
    n, r = m.force.size, m.rates.size
    p, v = window(state, 0, n), window(state, n + r, n)
    work = 2 * (n + r) + n + m.drives.size // DRIVE
    evaluate(P, m, state[work + 1], p, v, True)
    times(m.mass, v, m.x)
    times(m.stiffness, p, m.y)
    out[0] = 0.5 * (dot(v, m.x) + dot(p, m.y))
    out[1] = m.values[r] + state[work]


def retime(P: Array, dt: float) -> None:
    """Prepare for another step length."""
    P[STEP] = dt


def free(P: Array, state: Array) -> None:
    """Take a step without contact; the terms and factor of its middle stay for `columns`."""
    take_step(P, state)


def columns(P: Array, state: Array, jump: Array, responses: Array) -> None:
    """Write velocities per impulse, and the response columns: see `write_columns`."""
    write_columns(P, state, jump, responses)


def derive(P: Array, state: Array) -> None:
    """Take the readings and their rates again at the state, so that nothing drifts."""
    take_readings(P, state)


def measure(P: Array, state: Array, out: Array) -> None:
    """Write the energy and the work of loads and drives [J]."""
    take_energy(P, state, out)
