"""Error estimate by the linear error equation of a stepped modal run.

Modes under exact steps move without error between the steps; the only error is that of a force which is constant over
each of them. With a step h and an overlap d

- the motion follows the mean of the force, not the force, which rises across the step: modes respond to the difference,
  s (t - h/2) with the slope s. Slow ones change d by h^2 d''/12;
- the force is the mean of the law along a line between the ends of the step, not along the motion, as if d were larger
  by h^2 d''/12.

With p the first of these, the error e of the overlap and that of the force, x, obey

    x = F'(d) (e + h^2 d''/12),    e = p - G x,

where G x is how far x moves the faces apart. The equation is linear and marched with the modes and steps of the run
itself; errors of the second order are left out. Of a law F = K d^n (1 + a d') the force changes by
K n d^(n-1) (h^2 d''/12 + (1 + a d') e) + a K d^n e'.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from impactlab.numerics.addresses import entered_with_table
from impactlab.numerics.compiling import ENTRY, PART
from impactlab.numerics.linear import solve_banded
from impactlab.refine.errors.modal_march import (
    LIFT,
    LIFT_OF_RAMP,
    PUSH,
    PUSH_OF_RAMP,
    Coordinates,
    moved,
    push,
    room_for,
    swing,
    write_compliances,
    write_coordinates,
)
from impactlab.simulate.stepping.arrays import StepArrays
from impactlab.types import Array

MIN_CHORD = 1e-6  # of an overlap: across less the slope of a chord is rounding
MAX_SPEEDING = 0.5  # change of a speed of approach in the step of its touch: above, it is no speed
NEAR_PEAK = 0.9  # of the largest force: steps whose errors count for the peak
STIFFNESS, EXPONENT, HYSTERESIS = range(3)  # columns of the laws
# Columns of the memory of a contact: errors of both faces at the start of the step, and of the rate of the overlap;
# speed of the approach, its error, and its change in the step of the touch over itself; share by which the error of the
# force follows that of the overlap at the end of the step; sums of squares over a touch; shift of the overlap.
LEFT, RIGHT, RATE, APPROACH, APPROACH_ERROR, SPEEDS_UP, FOLLOWS, OF_ERROR, OF_FORCE, SHIFT, WORDS = range(11)
THIRD = 3  # order of the difference by which the force at the end of a run is in error
COLUMNS = 6  # of a contact in a record: force, gap, displacement and velocity of both faces


# Fields of a `ContactError`, in their order.
FORCE, IMPULSE, TOTAL, AT_PEAK, READING, OF_LEFT, OF_RIGHT, PEAK, GIVEN, IN_TOUCH, MISSED = range(11)


class ContactError(NamedTuple):
    """Errors of one contact by the steps, and sizes for comparison."""

    force: float  # N, root of the mean square over the steps
    impulse: float  # N s, in all
    total: float  # N s, of the sizes of the errors
    near_peak: float  # N, largest one in steps whose force is near the peak
    reading: float  # N, of a peak that is read from means of steps
    left: float  # m, root of the mean square of the displacement of the left face
    right: float  # m, of the right one
    peak: float  # N, largest force
    given: float  # N s, its impulse
    in_touch: float  # largest error of the force in a touch, over its force in this touch, by their norms
    missed: float  # largest error of a gap that nearly closes (under a law with hysteresis: or opens), over this gap


@PART
def bend_at(record: Array, step: int, column: int) -> float:
    """Return a sixth of a column's second difference after a step; 0 at run ends."""
    if step == 0 or step == len(record) - 1:
        return 0.0
    return float(record[step + 1, column] - 2.0 * record[step, column] + record[step - 1, column]) / 6.0


@PART
def spring_at(law: Array, overlap: float) -> tuple[float, float]:
    """Return force [N] and stiffness [N/m] of the spring of a law."""
    if overlap <= 0.0:
        return 0.0, 0.0
    share = law[STIFFNESS] * overlap ** (law[EXPONENT] - 1.0)
    return float(share * overlap), float(law[EXPONENT] * share)


@PART
def write_sizes(record: Array, contact: int, dt: float, by_steps: float, out: Array) -> None:
    """Write largest force, impulse and peak-reading error of a contact; clear the rest."""
    column, last = 1 + COLUMNS * contact, len(record) - 1
    total, top = 0.0, 1
    for step in range(1, last + 1):
        force = record[step, column]
        total += force
        if force > record[top, column]:
            top = step
    peak = record[top, column]
    before, after = record[top - 1, column] if top > 1 else 0.0, record[top + 1, column] if top < last else peak
    bend, slope = before - 2.0 * peak + after, 0.5 * (after - before)
    for field in range(out.size):
        out[field] = 0.0
    if top == last > THIRD:  # a force that rises until the run ends: the last step has its mean and a slope
        second = peak - 2.0 * before + record[last - 2, column]
        third = second - before + 2.0 * record[last - 2, column] - record[last - 3, column]
        out[READING] = by_steps * min(abs(second) / 12.0 + abs(third), peak - before)
    elif bend < 0.0:  # of a parabola through the means
        out[READING] = by_steps * (slope * slope / (-2.0 * bend) - bend / 24.0)
    out[PEAK], out[GIVEN] = peak, total * dt


@PART
def error_before_reply(
    record: Array,
    dt: float,
    by_steps: float,
    law: Array,
    step: int,
    contact: int,
    overlap: float,
    rate_error: float,
    own: Array,
) -> float:
    """Return the error of a force [N] for an overlap in error.

    ``overlap`` and ``rate_error`` are the errors of the overlap [m] and its rate [m/s] at the end of the step, before
    the force's own error changes them; how it then follows the overlap is written to ``own``. Errors by the step itself
    are multiplied by ``by_steps``.
    """
    column = 1 + COLUMNS * contact
    start, end = -record[step - 1, column + 1], -record[step, column + 1]
    (force_before, tangent_before), (force, tangent) = spring_at(law, start), spring_at(law, end)
    tangent, rate = 0.5 * (tangent_before + tangent), (end - start) / dt
    if abs(end - start) > MIN_CHORD * max(abs(start), abs(end)):
        tangent = (force - force_before) / (end - start)  # the mean, also where the faces meet within the step
    before = own[LEFT] - own[RIGHT] + own[SHIFT]
    if start <= 0.0 < end:
        # The touch is dated on a line: it comes early by its error, and where the approach speeds up, by that curve.
        begins = record[step - 1, column + 3] - record[step - 1, column + 5]
        own[APPROACH], share, gained = rate, -start / (end - start), 2.0 * (rate - begins) * dt
        early = before + share * (overlap - before) + 0.5 * by_steps * share * (1.0 - share) * gained
        bend = bend_at(record, step - 1, column + 3) - bend_at(record, step - 1, column + 5)
        own[APPROACH_ERROR] = own[RATE] + share * (rate_error - own[RATE]) - gained * early / (end - start) / dt
        own[APPROACH_ERROR] += 3.0 * by_steps * share * (1.0 - share) * bend  # the law takes it from a line, too
        own[SPEEDS_UP] = abs(gained) / (end - start)
    own[FOLLOWS] = 0.0
    if record[step, column] <= 0.0:
        return 0.0
    bend = -0.5 * by_steps * (bend_at(record, step - 1, column + 1) + bend_at(record, step, column + 1))
    spring = 0.5 * (force_before + force)
    gain = law[HYSTERESIS] / own[APPROACH] if own[APPROACH] > 0.0 else 0.0
    full, damping = tangent * (1.0 + gain * rate), gain * spring / dt
    own[FOLLOWS] = 0.5 * full + damping
    by_approach = -gain * spring * rate * own[APPROACH_ERROR] / own[APPROACH] if gain > 0.0 else 0.0
    return float(0.5 * tangent * bend + 0.5 * full * (before + overlap) + damping * (overlap - before) + by_approach)


@PART
def book_faces(
    record: Array, by_steps: float, step: int, contact: int, at: Coordinates, state: Array, own: Array, out: Array
) -> None:
    """Add the errors of both faces' displacements in a step.

    Those at its end are kept. Within the step a displacement is read along a line, which lies beside its curve by
    s (h - s) u''/2.
    """
    for side in range(2):
        column = 3 + COLUMNS * contact + 2 * side
        error, rate = moved(at, 2 * contact + side, state)
        mean = 0.5 * (own[LEFT + side] + error)
        before, after = by_steps * bend_at(record, step - 1, column), by_steps * bend_at(record, step, column)
        beyond = by_steps * bend_at(record, step + 1, column) if step < len(record) - 1 else 0.0
        fourth = beyond - 2.0 * after + before  # of vibrations that turn by a radian and more in a step
        square = 0.5 * (before * before + after * after) + 0.13 * abs(after * fourth) + 0.04 * fourth * fourth
        out[OF_LEFT + side] += mean * (mean + 0.5 * (before + after)) + 0.3 * square
        own[LEFT + side] = error
        own[RATE] = rate if side == 0 else own[RATE] - rate


@PART
def book_force(
    record: Array, dt: float, law: Array, step: int, contact: int, error: float, own: Array, out: Array
) -> None:
    """Add the error of a force in a step to its contact.

    An error of a gap that nearly closes or opens is added, too.
    """
    column, last = 1 + COLUMNS * contact, len(record) - 1
    force, gap = record[step, column], record[step, column + 1]
    out[FORCE] += error * error
    out[IMPULSE] += error * dt
    out[TOTAL] += abs(error) * dt
    if force >= NEAR_PEAK * out[PEAK]:
        out[AT_PEAK] = max(out[AT_PEAK], abs(error))
    if law[HYSTERESIS] > 0.0 and own[SPEEDS_UP] > MAX_SPEEDING:
        out[MISSED] = math.inf
    own[OF_ERROR] += error * error
    own[OF_FORCE] += force * force
    if own[OF_FORCE] > 0.0 and (force == 0.0 or step == last):
        out[IN_TOUCH] = max(out[IN_TOUCH], math.sqrt(own[OF_ERROR] / own[OF_FORCE]))
        own[OF_ERROR] = own[OF_FORCE] = 0.0
    if step < last:
        rises, falls = gap > record[step - 1, column + 1], record[step + 1, column + 1] < gap
        # Under a law with hysteresis a new touch has a speed of approach of its own.
        if (gap > 0.0 and not rises and not falls) or (gap < 0.0 and rises and falls and law[HYSTERESIS] > 0.0):
            out[MISSED] = max(out[MISSED], abs(own[LEFT] - own[RIGHT] + own[SHIFT]) / abs(gap))


class Room(NamedTuple):
    """Room for the march of the error equation."""

    state: Array  # displacements and velocities of `Coordinates`, of zeros
    memory: Array  # (contacts, `WORDS`), of zeros
    compliances: Array  # (contacts, contacts)
    system: Array  # (contacts, contacts + 1)


@ENTRY
def write_errors(
    m: StepArrays,
    record: Array,
    dt: float,
    by_steps: float,
    laws: Array,
    shifts: Array,
    at: Coordinates,
    room: Room,
    out: Array,
) -> None:
    """Write the `ContactError` of each contact.

    Parameters
    ----------
    m : StepArrays
        Of the run.
    record : Array
        Records of every step, (n + 1, columns): time, then `COLUMNS` of each contact.
    dt : float
        Step [s].
    by_steps : float
        Factor on errors by the step itself: 1, or 0 for those by the shifts alone.
    laws : Array
        (contacts, 3): K, n and a v0 of each law.
    shifts : Array
        (contacts, 2): shift of each overlap [m], and the number of the step after which it begins.
    at : Coordinates
        Of zeros, written.
    room : Room
        Overwritten.
    out : Array
        (contacts, fields of `ContactError`), written.
    """
    count, last = len(laws), len(record) - 1
    state, memory, compliances, system = room
    write_coordinates(m, dt, at)
    write_compliances(at, compliances)
    for c in range(count):
        write_sizes(record, c, dt, by_steps, out[c])
    for step in range(1, last + 1):
        swing(at, state)
        for c in range(count):
            memory[c, SHIFT] = shifts[c, 0] if step > shifts[c, 1] else 0.0
            column = 1 + COLUMNS * c
            slope = (record[min(step + 1, last), column] - record[step - 1, column]) / (2.0 * dt)
            if slope != 0.0:  # the run takes the mean of a force that rises
                push(at, c, LIFT_OF_RAMP, PUSH_OF_RAMP, -by_steps * slope, state)
        acts = False
        for c in range(count):
            (left, left_rate), (right, right_rate) = moved(at, 2 * c, state), moved(at, 2 * c + 1, state)
            overlap, rate = left - right + memory[c, SHIFT], left_rate - right_rate
            system[c, count] = error_before_reply(record, dt, by_steps, laws[c], step, c, overlap, rate, memory[c])
            acts = acts or system[c, count] != 0.0
        if acts:
            for c in range(count):
                for other in range(count):
                    system[c, other] = memory[c, FOLLOWS] * compliances[c, other] + (1.0 if c == other else 0.0)
            solve_banded(system, count, count)
        for c in range(count):
            if system[c, count] != 0.0:
                push(at, c, LIFT, PUSH, system[c, count], state)
        for c in range(count):
            book_faces(record, by_steps, step, c, at, state, memory[c], out[c])
            book_force(record, dt, laws[c], step, c, system[c, count], memory[c], out[c])
    for c in range(count):
        for field in (FORCE, OF_LEFT, OF_RIGHT):
            out[c, field] = math.sqrt(out[c, field] / last)


def contact_errors(
    record: Array, dt: float, laws: Array, m: StepArrays, shifts: Array | None = None
) -> list[ContactError]:
    """Return the errors of the contacts of a run by its steps, or by shifts of overlaps.

    Parameters
    ----------
    record : Array
        Records of every step, (n + 1, columns).
    dt : float
        Step [s].
    laws : Array
        (contacts, 3): K [N/m^n], n and a v0 of F = K d^n (1 + a d').
    m : StepArrays
        Of the run, whose bodies are stepped by `ExactModal`.
    shifts : Array, optional
        (contacts, 2): shift of each overlap [m], and the number of the step after which it begins. The errors are then
        those by the shifts, in place of those by the steps.
    """
    count, by_steps = len(laws), 0.0
    if shifts is None:
        shifts, by_steps = np.zeros((count, 2)), 1.0
    at, state = room_for(m.state.size // 2, count)
    room = Room(state, np.zeros((count, WORDS)), np.empty((count, count)), np.empty((count, count + 1)))
    out = np.empty((count, len(ContactError._fields)))
    entered_with_table(write_errors, m, record, dt, by_steps, laws, shifts, at, room, out)
    return [ContactError(*each) for each in out.tolist()]
