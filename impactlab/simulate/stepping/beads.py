"""Rows of beads: rigid masses in contact by power laws, stepped as rows.

In a scheme whose forces act at the start of the step (v += dt F/m, then u += dt v) the force K d^n of an overlap is
known before anything moves. It is then a load like any other: no law is called and nothing is solved. All other
contacts of the beads, and loads over time on them, come after, as on any body.

A row stands between two ghosts that never move: entry 0, the beads, entry count + 1. Slot i is the contact between the
entries i and i + 1; with a wall it is that with a ghost, and where there is none its gap is infinite. Behind a row are
entries and slots of the same kind, so that it is stepped by eight in vector registers. A row is stepped block by block,
and a block at rest is passed over until a force or a bead from beside reaches it.

The gap one step earlier, which dates an event, is the present one less dt times its rate: the beads have drifted by it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from impactlab.numerics.compiling import INLINE, PART
from impactlab.numerics.lanes import (
    LANES,
    after_last,
    all_lanes,
    before_first,
    lane,
    lanes_above,
    lanes_at,
    larger_lanes,
    put_lanes,
    roots_of_lanes,
)
from impactlab.numerics.windows import window
from impactlab.simulate.stepping.arrays import (
    COARSE,
    COMPLIANCE,
    COUNT,
    FORCE,
    GAP,
    KICK,
    MOST,
    PEAK,
    RECENT,
    REST,
    SPAN,
    STIFFNESS,
    BeadRowRecord,
    ClockRecord,
    ContactRecord,
    EventRecord,
    StepArrays,
    U,
    V,
)
from impactlab.types import Array, Ints

CLOSE, OPEN = 0, 1  # kinds of events, as in `event_times`
BLOCK = 128  # slots, a multiple of `LANES`: their data stay in the fastest memory from a first pass to a second
HERTZ = 1.5  # the exponent whose power is a root


class BeadArrays(NamedTuple):
    """The arrays of `StepArrays` that rows of beads need.

    They are few, so that they can be handed to code that is compiled separately.
    """

    clock: Sequence[ClockRecord]
    bead_rows: Sequence[BeadRowRecord]
    contacts: Sequence[ContactRecord]
    events: Sequence[EventRecord]
    beads: Array
    bead_contacts: Array
    shared: Ints
    state: Array
    record: Array
    sample: Array


@INLINE
def bead_arrays(m: StepArrays) -> BeadArrays:
    """Return the arrays that rows of beads need."""
    return BeadArrays(
        m.clock, m.bead_rows, m.contacts, m.events, m.beads, m.bead_contacts, m.shared, m.state, m.record, m.sample
    )


class BeadBlock(NamedTuple):
    """A row, or a block of one, as views of the arrays of beads.

    The views are of the layers of `StepArrays.beads` and `StepArrays.bead_contacts`. Displacements reach one entry
    further than the slots; forces begin one slot before them.
    """

    u: Array  # (n + 1,) m
    v: Array  # (n,) m/s
    kick: Array  # (n,) s/kg
    gap: Array  # (n,) m
    stiffness: Array  # (n,)
    force: Array  # (n + 1,) N
    recent: Array  # (n,) N
    peak: Array  # (n,) N


@INLINE
def block_of(m: BeadArrays, first: int, size: int) -> BeadBlock:
    """Return consecutive slots of a row, and the entries to the left of them."""
    return BeadBlock(
        window(m.beads[U], first, size + 1),
        window(m.beads[V], first, size),
        window(m.beads[KICK], first, size),
        window(m.bead_contacts[GAP], first, size),
        window(m.bead_contacts[STIFFNESS], first, size),
        window(m.bead_contacts[FORCE], first - 1, size + 1),
        window(m.bead_contacts[RECENT], first, size),
        window(m.bead_contacts[PEAK], first, size),
    )


@PART
def date_bead(m: BeadArrays, row: BeadRowRecord, slot: int, step: int, dt: float) -> None:
    """Write the event of a contact that closed or opened within the step before.

    The state is the one before the beads move.
    """
    place, values = row.first + slot, m.bead_contacts
    gap = values[GAP, place] + m.beads[U, place + 1] - m.beads[U, place]
    rate = m.beads[V, place + 1] - m.beads[V, place]
    # One step before it was on the other side of zero, whichever sign rounding gives to faces that began in touch.
    before = max(0.0, gap - dt * rate) if gap < 0.0 else min(0.0, gap - dt * rate)
    event, time = m.events[m.clock[0].n_events], step * dt
    event.time, event.contact = time, len(m.contacts) + row.contact + slot - 1 + row.left_wall
    event.impulse, event.span_impulse, event.span_peak = 0.0, 0.0, 0.0
    if step > 0 and gap != before:
        event.time = max(0.0, time - dt * gap / (gap - before))
    if gap < 0.0:
        event.kind = CLOSE
        values[SPAN, place] = -values[RECENT, place]  # the force of this step is still to be added
    else:
        event.kind = OPEN
        event.span_impulse = (values[SPAN, place] + values[RECENT, place]) * dt
        event.span_peak = values[PEAK, place]
        values[PEAK, place] = 0.0
    m.clock[0].n_events += 1


@PART
def watch_beads(m: BeadArrays, number: int, dt: float) -> None:
    """Count contacts whose step is coarse; mark one beyond the stability limit.

    Beads have moved: the gap at the start of the step is the present one less the travel of the step.
    """
    row, values, u, v = m.bead_rows[number], m.bead_contacts, m.beads[U], m.beads[V]
    for slot in range(row.count + 1):
        i = row.first + slot
        overlap = u[i] - u[i + 1] - values[GAP, i] - dt * (v[i] - v[i + 1])
        if overlap > 0.0:
            ratio = row.exponent * values[STIFFNESS, i] * overlap ** (row.exponent - 1.0) * values[COMPLIANCE, i]
            if ratio > values[COARSE, i]:
                values[COUNT, i] += 1.0
            if ratio > values[MOST, i]:
                m.clock[0].failed_bead = row.contact + slot + row.left_wall


@PART
def step_hertz(m: BeadArrays, row: BeadRowRecord, start: int, size: int, step: int, dt: float) -> int:
    """Take a step of a block; return whether a force exceeded ``watched``.

    Eight slots are stepped at a time. A bead moves when the forces on both sides are known: those from the left are
    carried along the row.
    """
    u, v, kick = m.beads[U], m.beads[V], m.beads[KICK]
    gap, stiffness = m.bead_contacts[GAP], m.bead_contacts[STIFFNESS]
    recent, peak, force = m.bead_contacts[RECENT], m.bead_contacts[PEAK], m.bead_contacts[FORCE]
    none, watched = all_lanes(0.0), all_lanes(row.watched)
    gained, drift = all_lanes(row.gained), all_lanes(dt)
    first, large = row.first + start, 0
    before, after = all_lanes(force[first - 1]), lanes_at(u, first)
    for place in range(0, size, LANES):
        at = first + place
        # Neighbours are moved in registers: values from two stores of the step before take long to be read.
        here, after = after, lanes_at(u, at + LANES)
        overlap = larger_lanes(here - before_first(here, after) - lanes_at(gap, at), none)
        forces = lanes_at(stiffness, at) * overlap * roots_of_lanes(overlap)
        changed = lanes_above(forces, none) ^ lanes_above(lanes_at(peak, at), none)
        if changed != 0:
            for number in range(LANES):
                if (changed >> number) & 1 != 0:
                    date_bead(m, row, start + place + number, step, dt)
        large |= lanes_above(forces, watched)
        put_lanes(recent, at, lanes_at(recent, at) + forces)
        # The zero keeps the compiler from storing only the peaks that rise, which takes longer than storing all.
        put_lanes(peak, at, larger_lanes(lanes_at(peak, at), forces) + none)
        speeds = lanes_at(v, at) + lanes_at(kick, at) * (after_last(before, forces) - forces) + gained
        put_lanes(v, at, speeds)
        put_lanes(u, at, here + drift * speeds)
        before = forces
    force[first + size - 1] = lane(before, (size - 1) % LANES)
    return large


@PART
def write_block_forces(row: BeadBlock, watched: float, exponent: float) -> tuple[int, int]:
    """Write the forces of a block [N]; return two flags.

    They are: whether a contact closed or opened, and whether a force is above ``watched``.
    """
    changed, large = 0, 0
    for i in range(row.gap.size):
        overlap, force = row.u[i] - row.u[i + 1] - row.gap[i], 0.0
        if overlap > 0.0:
            force = row.stiffness[i] * overlap**exponent
        changed |= (force > 0.0) ^ (row.peak[i] > 0.0)
        large |= force > watched
        row.force[i + 1] = force
    return changed, large


@PART
def move(row: BeadBlock, gained: float, dt: float) -> None:
    """Kick and move the beads of a block, and sum up its forces."""
    for i in range(row.v.size):
        row.v[i] += row.kick[i] * (row.force[i] - row.force[i + 1]) + gained
        row.u[i] += dt * row.v[i]
    for i in range(row.peak.size):
        row.recent[i] += row.force[i + 1]
        # The zero keeps the compiler from storing only the peaks that rise, which takes longer than storing all.
        row.peak[i] = max(row.peak[i], row.force[i + 1]) + 0.0


@INLINE
def stays_at_rest(m: BeadArrays, first: int, size: int) -> bool:
    """Return whether no force from the left or overlap ends the rest of a block."""
    u, last = m.beads[U], first + size - 1
    return bool(
        m.bead_contacts[REST, first] != 0.0
        and m.bead_contacts[FORCE, first - 1] == 0.0
        and u[last] - u[last + 1] <= m.bead_contacts[GAP, last]
    )


@INLINE
def step_power(m: BeadArrays, row: BeadRowRecord, start: int, size: int, step: int, dt: float) -> int:
    """Take a step of a block with another exponent than Hertz's.

    Return whether a force was above ``watched``.
    """
    block = block_of(m, row.first + start, size)
    changed, large = write_block_forces(block, row.watched, row.exponent)
    if changed != 0:
        for i in range(size):
            if (block.force[i + 1] > 0.0) != (block.peak[i] > 0.0):
                date_bead(m, row, start + i, step, dt)
    move(block, row.gained, dt)
    return int(large)


@INLINE
def step_row(m: BeadArrays, row: BeadRowRecord, step: int, dt: float) -> int:
    """Take a step of a row; return whether a force was above ``watched``."""
    start, n_slots, large = 0, row.count + 1, 0
    while start < n_slots:
        size, first = min(BLOCK, n_slots - start), row.first + start
        if not stays_at_rest(m, first, size):
            m.bead_contacts[REST, first] = 0.0
            if row.exponent == HERTZ:
                large |= step_hertz(m, row, start, size, step, dt)
            else:
                large |= step_power(m, row, start, size, step, dt)
        start += size
    if row.gained != 0.0:  # gravity has moved the ghosts, and the slots behind the row
        none, last = all_lanes(0.0), row.first + n_slots
        m.beads[U, row.first] = m.beads[V, row.first] = 0.0
        put_lanes(m.beads[U], last, none)
        put_lanes(m.beads[V], last, none)
    return large


@PART
def march_row(m: BeadArrays, number: int, dt: float, steps: int) -> int:
    """Take steps of a row; return their number.

    It is below ``steps`` where the events are full or a contact fails.
    """
    row, clock = m.bead_rows[number], m.clock[0]
    began = clock.step
    for taken in range(steps):
        if step_row(m, row, began + taken, dt) != 0:
            watch_beads(m, number, dt)
            if clock.failed_bead != 0:
                return taken
        if clock.n_events + row.count + 1 >= len(m.events):
            return taken + 1
    return steps


@PART
def march_beads(m: BeadArrays, dt: float, steps: int) -> int:
    """Take steps of all rows; return their number.

    It is below ``steps`` where there are several rows, the events are full, or a contact fails.
    """
    if len(m.bead_rows) == 1:
        return march_row(m, 0, dt, steps)
    for number in range(len(m.bead_rows)):
        if march_row(m, number, dt, 1) == 0:
            return 0
    return 1


@PART
def step_beads(m: BeadArrays, dt: float) -> None:
    """Take a step of all rows of beads.

    Beads on which other contacts or loads act are written to the state, too.
    """
    march_beads(m, dt, 1)
    for i in range(0, m.shared.size, 2):
        at, entry = m.shared[i], m.shared[i + 1]
        m.state[at], m.state[at + 1] = m.beads[U, entry], m.beads[V, entry]


@PART
def read_beads(m: BeadArrays) -> None:
    """Read the motion of such beads from the state, when all else has moved them."""
    for i in range(0, m.shared.size, 2):
        at, entry = m.shared[i], m.shared[i + 1]
        m.beads[U, entry], m.beads[V, entry] = m.state[at], m.state[at + 1]
