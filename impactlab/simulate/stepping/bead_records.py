"""Readout of rows of beads: energies, records, and motion in the state."""

from __future__ import annotations

import math

from impactlab.numerics.compiling import PART
from impactlab.numerics.windows import window
from impactlab.simulate.stepping.arrays import (
    GAP,
    LOAD,
    MASS,
    RECENT,
    SAMPLED,
    SPAN,
    STIFFNESS,
    TOTAL,
    BeadRowRecord,
    U,
    V,
)
from impactlab.simulate.stepping.beads import HERTZ, BeadArrays
from impactlab.types import Array


@PART
def stored_in(row: BeadRowRecord, u: Array, v: Array, gap: Array, stiffness: Array, dt: float) -> float:
    """Return the energy stored in the contacts of a row [J].

    Leapfrog conserves the energy of a spring, n = 1, with the product of the overlaps at both ends of a step as square.
    """
    stored, power = 0.0, 0.5 * (row.exponent + 1.0)
    is_hertz = row.exponent == HERTZ
    for i in range(gap.size):
        overlap = u[i] - u[i + 1] - gap[i]
        before = overlap - dt * (v[i] - v[i + 1])
        if overlap > 0.0 and before > 0.0:
            square = overlap * before
            stored += stiffness[i] * (square * math.sqrt(math.sqrt(square)) if is_hertz else square**power)
    return 0.5 * stored / power


@PART
def sample_beads(m: BeadArrays, dt: float) -> tuple[float, bool]:
    """Sample energies and momenta of beads; return their stored energy [J].

    The second value is whether all of them are finite.
    """
    sample, stored, total = m.sample[m.clock[0].n_samples], 0.0, 0.0
    for number in range(len(m.bead_rows)):
        row = m.bead_rows[number]
        own, n, first = sample[SAMPLED + 3 * row.body :], row.count, row.first + 1
        u, v = window(m.beads[U], first, n), window(m.beads[V], first, n)
        load, mass = window(m.beads[LOAD], first, n), window(m.beads[MASS], first, n)
        for i in range(n):
            moving = 0.5 * mass[i] * v[i] * v[i]
            work = load[i] * (u[i] - 0.5 * dt * v[i])
            own[3 * i], own[3 * i + 1], own[3 * i + 2] = moving, work, mass[i] * v[i]
            total += moving + work
        n, first = n + 1, row.first
        stored += stored_in(
            row,
            window(m.beads[U], first, n + 1),
            window(m.beads[V], first, n + 1),
            window(m.bead_contacts[GAP], first, n),
            window(m.bead_contacts[STIFFNESS], first, n),
            dt,
        )
    return stored, total - total == 0.0


@PART
def record_forces(forces: Array, recent: Array, span: Array, total: Array, share: float) -> None:
    """Write mean forces since the last record, and begin the next sums."""
    for i in range(forces.size):
        forces[i] = recent[i] * share
    for i in range(forces.size):
        span[i] += recent[i]
        total[i] += recent[i]
        recent[i] = 0.0


@PART
def record_beads(m: BeadArrays, first: int, steps: float) -> None:
    """Write the forces of bead contacts and the motion of beads to the record.

    Forces are means over ``steps``; the columns begin at ``first``.
    """
    values, record = m.bead_contacts, m.record[m.clock[0].n_records]
    share = 1.0 / steps if steps > 0.0 else 0.0
    at = first
    for number in range(len(m.bead_rows)):
        row = m.bead_rows[number]
        n, slot = row.count - 1 + row.left_wall + row.right_wall, row.first + 1 - row.left_wall
        record_forces(
            window(record, at, n),
            window(values[RECENT], slot, n),
            window(values[SPAN], slot, n),
            window(values[TOTAL], slot, n),
            share,
        )
        at += n
    for layer in (U, V):
        for number in range(len(m.bead_rows)):
            row = m.bead_rows[number]
            moved, source = window(record, at, row.count), window(m.beads[layer], row.first + 1, row.count)
            for i in range(row.count):
                moved[i] = source[i]
            at += row.count


@PART
def show_beads(m: BeadArrays) -> None:
    """Write the motion of all beads into the state of the whole scene."""
    for number in range(len(m.bead_rows)):
        row = m.bead_rows[number]
        state = window(m.state, 2 * row.body, 2 * row.count)  # beads come first in the state
        u, v = window(m.beads[U], row.first + 1, row.count), window(m.beads[V], row.first + 1, row.count)
        for i in range(row.count):
            state[2 * i], state[2 * i + 1] = u[i], v[i]
