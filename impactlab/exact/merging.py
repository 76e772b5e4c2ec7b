"""Merging of neighbouring pieces whose breaks are below rounding, compiled.

A wave front that has passed a node many times, or has met an equal one, leaves a break in the records without a jump.
Breaks travel and cut other pieces; merging keeps the number of pieces to that of the fronts that exist. A break counts
as rounding in velocity, or in displacement: a jump dv that pieces of a length w carry moves a node by dv w at most, and
pieces are merged while all that they have been changed by moves it by less than displacements are rounded. Momentum
then changes by the impedance times this, and energy by the force.
"""

from __future__ import annotations

from impactlab.exact.arrays import MarchArrays, PieceRecord
from impactlab.exact.crossings import least_force
from impactlab.exact.kernel import (
    COSINES,
    FEWEST,
    ROOM,
    WEIGHTS,
    WEIGHTS_AT,
    WIDTH_OF,
    chopped,
    integrate,
    restrict,
    value,
    within,
)
from impactlab.numerics.compiling import EXACT_PART
from impactlab.numerics.windows import window
from impactlab.types import Array

MAX_JUMP = 2.0e-15  # of the largest velocity, ten roundings: a smaller jump is removed
MAX_SHIFT = 1.0e-14  # of a hundredth of the largest displacement, half its rounding: what merging may move a node by
CHOP_PART = 5.0e-3  # of MAX_JUMP: coefficients of an extended piece that are dropped
FORCE_TOL = 1.0e-2  # of the force below which a contact is unloaded: the same jump of a force, and a spring's rounding
MIN_INTERVALS = 200  # in shorter runs, merging waves that are not constant takes longer than it saves
MAX_POINTS = 36  # of a merged piece: half the capacity, so that it can still be integrated and cut


@EXACT_PART
def is_integral(m: MarchArrays, j: int, row: int) -> bool:
    """Return whether a row is the time integral of another one: a displacement, or that of an emitted wave."""
    junction = m.junctions[j]
    nodes, ends = junction.nodes, junction.ends
    return bool(nodes <= row < 2 * nodes or 2 * nodes + ends <= row < 2 * (nodes + ends))


@EXACT_PART
def speed_floor(m: MarchArrays, j: int, n: int) -> float:
    """Return the velocity [m/s] below which a jump is rounding.

    That of velocities; or the rounding of a spring's force, which is that of displacements times its stiffness, over
    the impedance of a face without mass.
    """
    state, junction = m.state[0], m.junctions[j]
    floor = MAX_JUMP * state.fastest
    for c in range(junction.first_contact, junction.last_contact):
        contact = m.contacts[c]
        if contact.closed == 1 and contact.stiffness >= 0.0:
            rounded = FORCE_TOL * least_force(m, j, c, n)
            for side in (contact.left, contact.right):
                group = m.nodes[m.nodes[side].group]
                if group.group_mass == 0.0 and group.drag > 0.0:
                    floor = max(floor, rounded / group.drag)
    return float(floor)


@EXACT_PART
def jump_floor(m: MarchArrays, j: int, row: int, n: int, slow: float) -> float:
    """Return the largest jump that merging may remove from a row of velocities or forces."""
    junction = m.junctions[j]
    first_force = 2 * (junction.nodes + junction.ends)
    if row < first_force:
        return slow
    c = junction.first_contact + row - first_force
    floor = FORCE_TOL * least_force(m, j, c, n)
    return float(max(floor, slow * m.contacts[c].impedance))


@EXACT_PART
def needed_without_jump(m: MarchArrays, at: int, size: int, row: Array, n: int, widths: Array, floor: float) -> int:
    """Return how many coefficients two neighbouring series need together.

    Coefficients above the floor count; 0 where value or slope jump, the slope by more than moves the shorter piece by
    the floor. The earlier one is pool[at : at + size], the later one row[:n]; ``widths`` are their lengths.
    """
    before = after = 0.0
    rise = fall = 0.0
    needed = 1
    sign = 1.0
    for k in range(max(size, n)):
        early = m.pool[at + k] if k < size else 0.0
        late = row[k] if k < n else 0.0
        before += early
        after += sign * late
        rise += k * k * early
        fall -= k * k * sign * late
        sign = -sign
        if max(abs(early), abs(late)) > 0.1 * floor:
            needed = k + 1
    if not abs(after - before) <= floor:
        return 0
    bend = abs(rise / widths[0] - fall / widths[1]) * 2.0 * min(widths[0], widths[1])
    return needed if bend <= floor * (1.0 + needed * needed) * 8.0 else 0


@EXACT_PART
def resampled(
    m: MarchArrays, old: PieceRecord, row: int, t0: float, t1: float, n: int, points: int, floor: float
) -> float:
    """Write a row over both pieces into the table of waves, from so many points.

    Return how far it is from both at six places between the points; 1e300 where its last coefficients exceed the floor.
    """
    out = m.waves[row]
    m.state[0].work += points * (n + points)
    at, size = old.offset + row * old.size, old.size
    early, late = m.pool[at : at + size], m.rows[row]
    middle, half = 0.5 * (old.start + t1), 0.5 * (t1 - old.start)
    before, after = 0.5 * (t0 - old.start), 0.5 * (t1 - t0)
    for k in range(ROOM):
        out[k] = 0.0
    for i in range(points):
        t = middle + half * COSINES[(2 * i + 1) * (ROOM // points)]
        if t < t0:
            f = value(early, size, within((t - old.start) / before - 1.0))
        else:
            f = value(late, n, within(1.0 - (t1 - t) / after))
        weights = window(WEIGHTS, WEIGHTS_AT[points] + i * WIDTH_OF[points], points)
        for k in range(points):
            out[k] += f * weights[k]
    for k in range(points - 3, points):
        if abs(out[k]) > floor:
            return 1e300
    apart = 0.0
    for i in range(3):  # between two points, at the start and in the middle of both
        x = float(i - 1)
        place = (old.start + before * (1.0 + x) - middle) / half
        apart = max(apart, abs(value(out, points, place) - value(early, size, x)))
        place = (t0 + after * (1.0 + x) - middle) / half
        apart = max(apart, abs(value(out, points, place) - value(late, n, x)))
    return apart


@EXACT_PART
def write_integrals(m: MarchArrays, j: int, old: PieceRecord, count: int, half: float) -> None:
    """Write all rows of a merged piece from the table of waves, with so many coefficients.

    Displacements are integrated from velocities: taken at points, the end of one would be the start of the next with
    the error of its series, and grow.
    """
    junction = m.junctions[j]
    nodes, ends = junction.nodes, junction.ends
    for row in range(junction.rows):
        if is_integral(m, j, row):
            source = m.waves[row - nodes if row < 2 * nodes else row - ends]
            first = 0.0
            sign = 1.0
            for k in range(old.size):
                first += sign * m.pool[old.offset + row * old.size + k]
                sign = -sign
            integrate(source, count - 1, half, first, m.rows[row])
        else:
            for k in range(count):
                m.rows[row, k] = m.waves[row, k]


@EXACT_PART
def as_one(m: MarchArrays, j: int, old: PieceRecord, t0: float, t1: float, n: int, rounding: float, slow: float) -> int:
    """Write the rows of a piece and [t0, t1] as one series each; return its number of coefficients, 0 for a break.

    A jump of velocity up to ``slow`` [m/s] is no break. Above ``rounding`` [m/s], it counts as a shift of the piece.
    """
    junction = m.junctions[j]
    nodes, height = junction.nodes, junction.rows
    widths = m.stack[0]
    widths[0], widths[1] = t0 - old.start, t1 - t0
    needed = 1
    for i in range(2 * nodes, height + 2 * nodes):  # waves first: fronts are jumps of waves
        row = i if i < height else i - height
        if not is_integral(m, j, row):
            floor = jump_floor(m, j, row, n, slow)
            here = needed_without_jump(m, old.offset + row * old.size, old.size, m.rows[row], n, widths, floor)
            if here == 0:
                return 0
            needed = max(needed, here)
    if needed == 1 and slow <= rounding:  # constant waves, extended
        for row in range(height):
            if not is_integral(m, j, row):
                m.waves[row, 0], m.waves[row, 1] = m.pool[old.offset + row * old.size], 0.0
        write_integrals(m, j, old, 2, 0.5 * (t1 - old.start))
        return 2
    points = FEWEST
    while points < needed + 4 or ROOM % points != 0:
        points += FEWEST
    if points > MAX_POINTS:
        return 0
    furthest = 0.0
    for row in range(height):
        if not is_integral(m, j, row):
            floor = jump_floor(m, j, row, n, slow)
            apart = resampled(m, old, row, t0, t1, n, points, floor)
            if not apart <= 4.0 * floor:
                return 0
            furthest = max(furthest, apart * slow / floor)
    if slow > rounding:
        junction.shifted += furthest * (t1 - old.start)
    write_integrals(m, j, old, points, 0.5 * (t1 - old.start))
    return points


@EXACT_PART
def extended(m: MarchArrays, j: int, old: PieceRecord, t0: float, t1: float, n: int, spare: float) -> int:
    """Write the rows of the longer of a piece and [t0, t1], extended over the shorter one.

    Return its number of coefficients, 0 where this would move nodes by more than ``spare`` [m].
    """
    state, junction = m.state[0], m.junctions[j]
    first_force = 2 * (junction.nodes + junction.ends)
    early, late = t0 - old.start, t1 - t0
    forward = late < early
    short = min(early, late)
    low, high = (1.0, 1.0 + 2.0 * late / early) if forward else (-1.0 - 2.0 * early / late, -1.0)
    part, over = m.stack[0], m.stack[1]
    furthest = 0.0
    count = 1
    for row in range(junction.rows):
        if is_integral(m, j, row):
            continue
        scale = 1.0 if row < first_force else m.contacts[junction.first_contact + row - first_force].impedance
        least = CHOP_PART * MAX_JUMP * state.fastest * scale
        out, other = m.waves[row], m.rows[row]
        for k in range(old.size):
            part[k] = m.pool[old.offset + row * old.size + k]
        size, length = chopped(part, old.size, least), chopped(other, n, least)
        used = restrict(part, size, low, high, over) if forward else restrict(other, length, low, high, over)
        apart = 0.0
        for k in range(max(used, length if forward else size)):
            here = over[k] if k < used else 0.0
            late_part, early_part = other[k] if k < length else 0.0, part[k] if k < size else 0.0
            apart += abs(here - (late_part if forward else early_part))
        furthest = max(furthest, apart / scale)
        if not furthest * short <= spare:
            return 0
        used = restrict(part, size, -1.0, high, out) if forward else restrict(other, length, low, 1.0, out)
        used = chopped(out, used, least)
        for k in range(used, ROOM):
            out[k] = 0.0
        count = max(count, used)
    if count >= MAX_POINTS:
        return 0
    junction.shifted += furthest * short
    write_integrals(m, j, old, count + 1, 0.5 * (t1 - old.start))
    return count + 1


@EXACT_PART
def is_front(m: MarchArrays, j: int, old: PieceRecord, n: int, most: float) -> bool:
    """Return whether a velocity or a wave jumps by more than ``most`` [m/s] after a piece."""
    junction = m.junctions[j]
    for row in range(2 * junction.nodes + junction.ends - 1, -1, -1):
        if not is_integral(m, j, row):
            at, late = old.offset + row * old.size, m.rows[row]
            jump = 0.0
            for k in range(old.size):
                jump += m.pool[at + k]
            for k in range(n):
                jump += -late[k] if k % 2 == 0 else late[k]
            if abs(jump) > most:
                return True
    return False


@EXACT_PART
def joined(m: MarchArrays, j: int, t0: float, t1: float, n: int) -> int:
    """Write the rows of the last piece and [t0, t1] as one.

    Return its number of coefficients, 0 for no merger.
    """
    state, junction = m.state[0], m.junctions[j]
    old = m.pieces[len(m.pieces) // len(m.junctions) * j + junction.records - 1]
    short_run = state.intervals < MIN_INTERVALS
    if junction.broken == 1 or old.stop <= 0.0 or (short_run and max(n, old.size) > 2):
        return 0
    rounding = speed_floor(m, j, n)
    whole = as_one(m, j, old, t0, t1, n, rounding, rounding)
    spare = MAX_SHIFT * state.farthest - junction.shifted
    if whole > 0 or short_run or is_front(m, j, old, n, spare / min(t0 - old.start, t1 - t0)):
        return whole
    slow = 0.25 * spare / (t1 - old.start)
    if slow > rounding:
        whole = as_one(m, j, old, t0, t1, n, rounding, slow)
    return whole if whole > 0 else extended(m, j, old, t0, t1, n, spare)
