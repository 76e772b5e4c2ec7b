"""Rows of beads: rigid masses in contact by power laws, kicked and moved in one pass from left to right.

In a scheme whose forces act at the start of the step (v += dt F/m, then u += dt v) the force K d^n of an overlap is
known before anything moves. It is then a load like any other: no law is called, nothing is solved, and a contact with a
gap costs one comparison. All other contacts of the beads, and loads over time on them, come after, as on any body.

The gap one step earlier, which dates an event, is the present one less dt times its rate: the beads have drifted by it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from impactlab.numerics.compiling import INLINE, PART
from impactlab.simulate.stepping.arrays import (
    COARSE,
    COMPLIANCE,
    COUNT,
    GAP,
    KICK,
    LOAD,
    MASS,
    MOST,
    PEAK,
    RECENT,
    SAMPLED,
    SPAN,
    STIFFNESS,
    TOTAL,
    BeadRowRecord,
    ClockRecord,
    ContactRecord,
    EventRecord,
    Floats,
    StepArrays,
)

CLOSE, OPEN = 0, 1  # kinds of events, as in `event_times`


class BeadArrays(NamedTuple):
    """The arrays of `StepArrays` that rows of beads need: few enough to be handed to code that is compiled apart."""

    clock: Sequence[ClockRecord]
    bead_rows: Sequence[BeadRowRecord]
    contacts: Sequence[ContactRecord]
    events: Sequence[EventRecord]
    beads: Floats
    bead_contacts: Floats
    noticed: Floats
    state: Floats
    record: Floats
    sample: Floats


@INLINE
def bead_arrays(m: StepArrays) -> BeadArrays:
    """Return the arrays that rows of beads need."""
    return BeadArrays(
        m.clock,
        m.bead_rows,
        m.contacts,
        m.events,
        m.beads,
        m.bead_contacts,
        m.noticed,
        m.state,
        m.record,
        m.sample,
    )


class Row(NamedTuple):
    """The contacts of a row from one on, as slices."""

    exponent: float
    watched: float  # N
    first: int  # number of the first one
    gap: Floats  # as the layers of `StepArrays.bead_contacts`
    stiffness: Floats
    recent: Floats
    peak: Floats


@PART
def gap_and_rate(m: BeadArrays, row: BeadRowRecord, contact: int) -> tuple[float, float]:
    """Return gap [m] and gap rate [m/s] of a contact of a row, from the state as it is."""
    left = contact - row.contact - row.left_wall
    gap, rate = m.bead_contacts[GAP, contact], 0.0
    if left >= 0:
        gap -= m.state[row.state + 2 * left]
        rate -= m.state[row.state + 2 * left + 1]
    if left + 1 < row.count:
        gap += m.state[row.state + 2 * left + 2]
        rate += m.state[row.state + 2 * left + 3]
    return gap, rate


@PART
def date_beads(m: BeadArrays, noticed: int, time: float, dt: float) -> None:
    """Write the events of bead contacts that have closed or opened; their gaps were zero within the step before."""
    values = m.bead_contacts
    for number in range(noticed):
        contact, gap, rate = int(m.noticed[number, 0]), m.noticed[number, 1], m.noticed[number, 2]
        # One step before it was on the other side of zero, whatever rounding says of faces that began in touch.
        before = max(0.0, gap - dt * rate) if gap < 0.0 else min(0.0, gap - dt * rate)
        event = m.events[m.clock[0].n_events]
        event.time, event.contact = time, len(m.contacts) + contact
        event.impulse, event.span_impulse, event.span_peak = 0.0, 0.0, 0.0
        if m.clock[0].step > 0 and gap != before:
            event.time = max(0.0, time - dt * gap / (gap - before))
        if gap < 0.0:
            event.kind = CLOSE  # the peak is the force of this step
            values[SPAN, contact] = values[PEAK, contact] - values[RECENT, contact]
        else:
            event.kind = OPEN
            event.span_impulse = (values[SPAN, contact] + values[RECENT, contact]) * dt
            event.span_peak = values[PEAK, contact]
            values[PEAK, contact] = 0.0
        m.clock[0].n_events += 1


@PART
def watch_beads(m: BeadArrays, number: int, dt: float) -> None:
    """Count contacts whose step is long against their own time; one beyond the stability limit fails.

    Beads have moved: the gap at the start of the step is the present one less the travel of the step.
    """
    row, values = m.bead_rows[number], m.bead_contacts
    m.clock[0].watched = 0
    for contact in range(row.contact, row.contact + row.count - 1 + row.left_wall + row.right_wall):
        gap, rate = gap_and_rate(m, row, contact)
        overlap = dt * rate - gap
        if overlap > 0.0:
            ratio = (
                row.exponent
                * values[STIFFNESS, contact]
                * overlap ** (row.exponent - 1.0)
                * values[COMPLIANCE, contact]
            )
            if ratio > values[COARSE, contact]:
                values[COUNT, contact] += 1.0
            if ratio > values[MOST, contact]:
                m.clock[0].failed_bead = contact + 1


@INLINE
def feel(
    m: BeadArrays, row: Row, contact: int, overlap: float, left: float, right: float, noticed: int
) -> tuple[float, int]:
    """Return the force of a contact of a row [N], and how many contacts have closed or opened in this step so far."""
    force = 0.0
    if overlap > 0.0:
        power = math.sqrt(overlap) if row.exponent == 1.5 else overlap ** (row.exponent - 1.0)
        force = row.stiffness[contact] * overlap * power
    if (force > 0.0) != (row.peak[contact] > 0.0):
        m.noticed[noticed, 0], m.noticed[noticed, 1], m.noticed[noticed, 2] = (
            row.first + contact,
            -overlap,
            right - left,
        )
        noticed += 1
    if force > 0.0:
        row.recent[contact] += force
        row.peak[contact] = max(row.peak[contact], force)
        if force > row.watched:
            m.clock[0].watched = 1
    return force, noticed


@INLINE
def row_from(m: BeadArrays, exponent: float, watched: float, first: int) -> Row:
    """Return the contacts of a row from one on."""
    values = m.bead_contacts
    return Row(
        exponent,
        watched,
        first,
        values[GAP, first:],
        values[STIFFNESS, first:],
        values[RECENT, first:],
        values[PEAK, first:],
    )


@PART
def step_beads(m: BeadArrays, time: float, dt: float) -> None:
    """Kick all beads by the forces at the start of the step, and move them.

    A bead moves when the forces on both sides are known: that from the left is carried along the row.
    """
    noticed = 0
    for number in range(len(m.bead_rows)):
        record = m.bead_rows[number]
        # Slices and numbers in variables: compiled code would read a record again after each number written.
        last, right_wall = record.count - 1, record.right_wall
        state = m.state[record.state : record.state + 2 * record.count]
        kick, gained = m.beads[KICK, record.bead :], record.gained
        row = row_from(m, record.exponent, record.watched, record.contact + record.left_wall)
        here, from_left = state[0], 0.0
        if record.left_wall != 0:
            wall = row_from(m, record.exponent, record.watched, record.contact)
            from_left, noticed = feel(m, wall, 0, -here - wall.gap[0], 0.0, state[1], noticed)
        for bead in range(last):
            after, velocity = state[2 * bead + 2], state[2 * bead + 1]
            force, noticed = feel(m, row, bead, here - after - row.gap[bead], velocity, state[2 * bead + 3], noticed)
            velocity += kick[bead] * (from_left - force) + gained
            state[2 * bead + 1] = velocity
            state[2 * bead] = here + dt * velocity
            here, from_left = after, force
        force = 0.0
        if right_wall != 0:
            force, noticed = feel(m, row, last, here - row.gap[last], state[2 * last + 1], 0.0, noticed)
        velocity = state[2 * last + 1] + kick[last] * (from_left - force) + gained
        state[2 * last + 1] = velocity
        state[2 * last] = here + dt * velocity
        if m.clock[0].watched != 0:
            watch_beads(m, number, dt)
    if noticed > 0:
        date_beads(m, noticed, time, dt)


@PART
def sample_beads(m: BeadArrays, dt: float) -> tuple[float, bool]:
    """Sample energies and momenta of beads; return the energy stored in their contacts [J], and whether all is finite.

    Leapfrog conserves the energy of a spring, n = 1, with the product of the overlaps at both ends of a step as square.
    """
    sample, stored, finite, moved = m.sample[m.clock[0].n_samples], 0.0, True, m.clock[0].step > 0
    for number in range(len(m.bead_rows)):
        row = m.bead_rows[number]
        state, own = m.state[row.state :], sample[SAMPLED + 3 * row.body :]
        load, mass, total = m.beads[LOAD, row.bead :], m.beads[MASS, row.bead :], 0.0
        for bead in range(row.count):
            u, v = state[2 * bead], state[2 * bead + 1]
            own[3 * bead] = 0.5 * mass[bead] * v * v
            own[3 * bead + 1] = load[bead] * (u - 0.5 * dt * v)
            own[3 * bead + 2] = mass[bead] * v
            total += own[3 * bead] + own[3 * bead + 1] + own[3 * bead + 2]
        finite = finite and total - total == 0.0
        for contact in range(row.contact, row.contact + row.count - 1 + row.left_wall + row.right_wall):
            if m.bead_contacts[PEAK, contact] > 0.0 or not moved:
                gap, rate = gap_and_rate(m, row, contact)
                before = gap - dt * rate if moved else gap
                if gap < 0.0 and before < 0.0:
                    square, power = gap * before, 0.5 * (row.exponent + 1.0)
                    grown = square * math.sqrt(math.sqrt(square)) if row.exponent == 1.5 else square**power
                    stored += 0.5 * m.bead_contacts[STIFFNESS, contact] * grown / power
    return stored, finite


@PART
def record_beads(m: BeadArrays, first: int, steps: float) -> None:
    """Write the forces of bead contacts, means over some steps, and the motion of beads from a column on."""
    values, record = m.bead_contacts, m.record[m.clock[0].n_records, first:]
    n_contacts, share = values.shape[1], 1.0 / steps if steps > 0.0 else 0.0
    recent, span, total = values[RECENT], values[SPAN], values[TOTAL]
    for contact in range(n_contacts):
        record[contact] = recent[contact] * share
        span[contact] += recent[contact]
        total[contact] += recent[contact]
        recent[contact] = 0.0
    moved = record[n_contacts : n_contacts + 2 * m.beads.shape[1]]
    for i in range(moved.size):  # beads come first in the state
        moved[i] = m.state[i]
