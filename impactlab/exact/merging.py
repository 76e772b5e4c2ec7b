"""Merging of neighbouring pieces without a jump between them, compiled: resampling at Chebyshev points.

A wave front that has passed a node many times, or has met an equal one, leaves a break in the records without a jump.
Breaks travel and cut other pieces; merging keeps the number of pieces to that of the fronts that exist.
"""

from __future__ import annotations

from impactlab.exact.arrays import MarchArrays, PieceRecord
from impactlab.exact.crossings import least_force
from impactlab.exact.kernel import COSINES, FEWEST, ROOM, WEIGHTS, WEIGHTS_AT, WIDTH_OF, value
from impactlab.numerics.compiling import EXACT_PART
from impactlab.numerics.windows import window
from impactlab.types import Array

MAX_JUMP = 2.0e-15  # of the largest velocity, ten roundings: a smaller jump is removed
FORCE_TOL = 1.0e-2  # of the force below which a contact is unloaded: the same jump of a force, and a spring's rounding
MIN_INTERVALS = 200  # in shorter runs, merging waves that are not constant takes longer than it saves
MAX_POINTS = 36  # of a merged piece: half the capacity, so that it can still be integrated and cut


@EXACT_PART
def jump_floor(m: MarchArrays, j: int, row: int, n: int) -> float:
    """Return the largest jump that merging may remove from a row; negative for integrals of others."""
    state, junction = m.state[0], m.junctions[j]
    nodes, ends = junction.nodes, junction.ends
    if row < nodes or 2 * nodes <= row < 2 * nodes + ends:
        return float(MAX_JUMP * state.fastest)
    if row >= 2 * (nodes + ends):
        return float(FORCE_TOL * least_force(m, j, junction.first_contact + row - 2 * (nodes + ends), n))
    return -1.0


@EXACT_PART
def needed_without_jump(m: MarchArrays, at: int, size: int, row: Array, n: int, widths: Array, floor: float) -> int:
    """Return how many coefficients two neighbouring series need together.

    Coefficients above the floor count; 0 where value or slope jump. The earlier one is pool[at : at + size], the later
    one row[:n]; ``widths`` are their lengths.
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
    bend = abs(rise / widths[0] - fall / widths[1]) * (widths[0] + widths[1])
    return needed if bend <= floor * (1.0 + needed * needed) * 8.0 else 0


@EXACT_PART
def resampled(
    m: MarchArrays, old: PieceRecord, row: int, t0: float, t1: float, n: int, points: int, floor: float
) -> bool:
    """Write a row over both pieces into the table of waves.

    Return whether so many points represent it to within the floor.
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
        f = value(early, size, (t - old.start) / before - 1.0) if t < t0 else value(late, n, 1.0 - (t1 - t) / after)
        weights = window(WEIGHTS, WEIGHTS_AT[points] + i * WIDTH_OF[points], points)
        for k in range(points):
            out[k] += f * weights[k]
    if floor < 0.0:
        return True
    for k in range(points - 3, points):
        if abs(out[k]) > floor:
            return False
    for i in range(3):  # between two points, at the start and in the middle of both
        x = float(i - 1)
        place = (old.start + before * (1.0 + x) - middle) / half
        if abs(value(out, points, place) - value(early, size, x)) > 4.0 * floor:
            return False
        place = (t0 + after * (1.0 + x) - middle) / half
        if abs(value(out, points, place) - value(late, n, x)) > 4.0 * floor:
            return False
    return True


@EXACT_PART
def stretched(m: MarchArrays, old: PieceRecord, nodes: int, ends: int, height: int, t1: float) -> None:
    """Write the rows of a piece of constant waves, extended to t1."""
    half = 0.5 * (t1 - old.start)
    for i in range(height):
        at = old.offset + i * old.size
        source = i if i < nodes or 2 * nodes <= i else i - nodes
        if 2 * nodes + ends <= i < 2 * (nodes + ends):
            source = i - ends
        if source == i:
            m.rows[i, 0], m.rows[i, 1] = m.pool[at], 0.0
        else:
            first = 0.0
            sign = 1.0
            for k in range(old.size):
                first += sign * m.pool[at + k]
                sign = -sign
            rate = m.pool[old.offset + source * old.size]
            m.rows[i, 0], m.rows[i, 1] = first + half * rate, half * rate


@EXACT_PART
def joined(m: MarchArrays, j: int, t0: float, t1: float, n: int) -> int:
    """Write the rows of the last piece and [t0, t1] as one.

    Return its number of coefficients, 0 for no merger.
    """
    junction = m.junctions[j]
    nodes, ends = junction.nodes, junction.ends
    height = junction.rows
    old = m.pieces[len(m.pieces) // len(m.junctions) * j + junction.records - 1]
    if junction.broken == 1 or old.stop <= 0.0 or (m.state[0].intervals < MIN_INTERVALS and max(n, old.size) > 2):
        return 0
    widths = m.stack[0]
    widths[0], widths[1] = t0 - old.start, t1 - t0
    needed = 1
    for i in range(2 * nodes + ends - 1, height + 2 * nodes + ends - 1):  # waves first: fronts are jumps of waves
        row = i if i < height else i - height
        floor = jump_floor(m, j, row, n)
        if floor >= 0.0:
            here = needed_without_jump(m, old.offset + row * old.size, old.size, m.rows[row], n, widths, floor)
            if here == 0:
                return 0
            needed = max(needed, here)
    if needed == 1:
        stretched(m, old, nodes, ends, height, t1)
        return 2
    points = FEWEST
    while points < needed + 4 or ROOM % points != 0:
        points += FEWEST
    if points > MAX_POINTS:
        return 0
    for row in range(height):
        if not resampled(m, old, row, t0, t1, n, points, jump_floor(m, j, row, n)):
            return 0
    for row in range(height):
        for k in range(points):
            m.rows[row, k] = m.waves[row, k]
    return points
