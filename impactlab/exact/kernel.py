"""Chebyshev series on an interval, compiled: evaluation, restriction, integration, linear equations, zero crossings.

All signals of a junction share one piece: a record [t0, t1] with the same number of coefficients per row.
Rows of a record: velocity of each node, displacement of each node, wave emitted by each end, its time integral,
force of each contact.
"""

from __future__ import annotations

import numpy as np

from impactlab.numerics.compiling import EXACT_INLINE, EXACT_PART
from impactlab.numerics.lanes import LANES, all_lanes, lane, lanes_at, put_lanes
from impactlab.numerics.windows import window
from impactlab.types import Array

ROOM = 72  # coefficients a piece may have; the numbers of points below divide it
ORDER = 68  # coefficients of a solve; the rest is room for integration
MAX_PIVOT = 1.0e150  # pivots are divided by it when they grow beyond
# Orders tried first, with the coefficients of the load and the rate up to which they are: ORDER is seldom needed.
LOW_ORDER, MAX_LOAD_LOW, MAX_RATE_LOW = 18, 16, 1.0
HALF_ORDER, MAX_LOAD_HALF, MAX_RATE_HALF = 34, 20, 4.0
COSINES = np.cos(np.pi * np.arange(4 * ROOM) / (2 * ROOM))
# For m points, x_i = cos((2 i + 1) pi/(2 m)) from POINTS_AT[m] on, and row by row from WEIGHTS_AT[m] on what the value
# at x_i gives to coefficient k, 2/m cos((2 i + 1) k pi/(2 m)), half of it to the first. As they are read eight at a
# time, WIDTH_OF[m], the next multiple of eight, is the length of the points, of a row, and the number of rows; what
# stands beyond m is zero.
FEWEST = 6
COUNTS = [m for m in range(FEWEST, ROOM + 1, FEWEST) if ROOM % m == 0]
POINTS_AT, WEIGHTS_AT, WIDTH_OF = np.zeros((3, ROOM + 1), dtype=np.int64)
WIDTH_OF[COUNTS] = [-(-m // LANES) * LANES for m in COUNTS]
POINTS_AT[COUNTS] = np.cumsum(WIDTH_OF[COUNTS]) - WIDTH_OF[COUNTS]
WEIGHTS_AT[COUNTS] = np.cumsum(WIDTH_OF[COUNTS] ** 2) - WIDTH_OF[COUNTS] ** 2


def _weights(m: int) -> Array:
    """Return the weights of m values in m coefficients.

    Zeros fill full lanes; the shape is (width, width).
    """
    weights = np.zeros((WIDTH_OF[m], WIDTH_OF[m]))
    weights[:m, :m] = COSINES[np.outer((2 * np.arange(m) + 1) * (ROOM // m), np.arange(m)) % (4 * ROOM)] * (2.0 / m)
    weights[:, 0] /= 2.0
    return weights


POINTS = np.concatenate([np.pad(COSINES[(2 * np.arange(m) + 1) * (ROOM // m)], (0, WIDTH_OF[m] - m)) for m in COUNTS])
WEIGHTS = np.concatenate([_weights(m).ravel() for m in COUNTS])
CHOP_TOL = 4.0e-17  # of the velocity scale: coefficients below are dropped
TAIL_TOL = 1.0e-15  # of the velocity scale: the tail of a solved piece lies below
ZERO_TOL = 1.0e-12  # of the scale: smaller forces and gaps count as zero
MAX_DEPTH = 64  # parts of a piece that wait during a search for a crossing
LOW, HIGH, SIZE, WIDTH = ROOM, ROOM + 1, ROOM + 2, ROOM + 3  # columns of such a part after its coefficients


@EXACT_PART
def value(a: Array, n: int, x: float) -> float:
    """Return the Chebyshev series a[:n] at x in [-1, 1] (Clenshaw)."""
    b1 = 0.0
    b2 = 0.0
    twice = 2.0 * x
    for k in range(n - 1, 0, -1):
        b1, b2 = twice * b1 + (a[k] - b2), b1
    return float(x * b1 - b2 + a[0])


@EXACT_PART
def within(place: float) -> float:
    """Return a place in a piece that rounding of times may have left outside of [-1, 1].

    A piece hardly longer than the rounding of time is left by its whole length; there its last coefficients, which are
    rounding, would grow by orders of magnitude.
    """
    return min(max(place, -1.0), 1.0)


@EXACT_PART
def chopped(a: Array, n: int, floor: float) -> int:
    """Return how many coefficients remain when small ones are dropped.

    Those at the end of a[:n] that are below the floor are dropped.
    """
    while n > 1 and abs(a[n - 1]) <= floor:
        n -= 1
    return n


@EXACT_INLINE
def each_in_all(lanes: Array, place: int) -> Array:
    """Return the value of one lane in all lanes."""
    return all_lanes(lane(lanes, place))


@EXACT_PART
def restrict(a: Array, n: int, low: float, high: float, out: Array) -> int:
    """Write the coefficients of a series on [low, high]; return their number.

    The interval is a part of [-1, 1]; ``out`` has ROOM places. The series is taken at the zeros of a Chebyshev
    polynomial (Clenshaw) and the values are transformed back. Eight points go side by side, in one vector register: the
    recurrence of one waits for itself at every term.
    """
    m = FEWEST
    while m < n or ROOM % m != 0:
        m += FEWEST
    middle, half = all_lanes(0.5 * (low + high)), all_lanes(0.5 * (high - low))
    two, nothing = all_lanes(2.0), all_lanes(0.0)
    width = WIDTH_OF[m]
    points, weights = window(POINTS, POINTS_AT[m], width), window(WEIGHTS, WEIGHTS_AT[m], width * width)
    for k in range(0, width, LANES):
        put_lanes(out, k, nothing)
    for i in range(0, width, LANES):
        x = middle + half * lanes_at(points, i)
        twice, p, q = two * x, nothing, nothing
        for k in range(n - 1, 0, -1):
            p, q = twice * p + (all_lanes(a[k]) - q), p
        f = x * p + (all_lanes(a[0]) - q)
        f0, f1, f2, f3 = each_in_all(f, 0), each_in_all(f, 1), each_in_all(f, 2), each_in_all(f, 3)
        f4, f5, f6, f7 = each_in_all(f, 4), each_in_all(f, 5), each_in_all(f, 6), each_in_all(f, 7)
        for k in range(0, width, LANES):
            at = i * width + k
            low_half = f0 * lanes_at(weights, at) + f1 * lanes_at(weights, at + width)
            high_half = f4 * lanes_at(weights, at + 4 * width) + f5 * lanes_at(weights, at + 5 * width)
            low_half = f2 * lanes_at(weights, at + 2 * width) + low_half
            high_half = f6 * lanes_at(weights, at + 6 * width) + high_half
            low_half = f3 * lanes_at(weights, at + 3 * width) + low_half
            high_half = f7 * lanes_at(weights, at + 7 * width) + high_half
            put_lanes(out, k, lanes_at(out, k) + (low_half + high_half))
    return min(m, n)


@EXACT_PART
def integrate(a: Array, n: int, half: float, first: float, out: Array) -> None:
    """Write the n + 1 coefficients of first + integral of a series.

    The integral is from the left end; half is half the length of the piece.
    """
    total = 0.0
    for k in range(1, n + 1):
        before = 2.0 * a[0] if k == 1 else a[k - 1]
        after = a[k + 1] if k + 1 < n else 0.0
        out[k] = half * (before - after) / (2.0 * k)
        total += out[k] if k % 2 == 0 else -out[k]
    out[0] = first - total


@EXACT_PART
def relax(rate: float, b: Array, first: float, order: int, y: Array, work: Array) -> None:
    """Solve y' = -rate y + b on [-1, 1] with y(-1) = ``first``.

    The rate is not negative. The tau method, with so many coefficients: backward elimination y_k = p_k y_{k-1} + r_k
    (Olver, Miller). All p_k are negative, so nothing cancels.
    """
    c = r = g = q = 0.0
    sign = -1.0 if order % 2 == 0 else 1.0  # of the last coefficient at -1
    d, before = 1.0, 0.0  # the pivot of a row is d over that of the row before: no row waits for a division
    for k in range(order - 1, 0, -1):
        after = b[k + 1] if k + 1 < order else 0.0
        last, w = c, 0.5 / k
        c = rate * w
        if d > MAX_PIVOT:
            d, before = d / MAX_PIVOT, before / MAX_PIVOT
        d, before = d + c * last * before, d
        part = before / d
        r = w * part * (b[k - 1] - after if k > 1 else 2.0 * b[0] - after) + c * part * r
        p = -c * part if k > 1 else -2.0 * c * part
        q += r * (sign + g)  # at -1, the coefficients from this one on sum to g times the one before, plus q
        g = p * (sign + g)
        sign = -sign
        work[0, k] = p
        work[1, k] = r
    y[0] = (first - q) / (1.0 + g)
    for k in range(1, order):
        y[k] = work[0, k] * y[k - 1] + work[1, k]


@EXACT_PART
def without_layer(rate: float, b: Array, first: float, n: int, floor: float, y: Array) -> bool:
    """Write the solution of y' = -rate y + b that has no layer.

    It is written on [-1, 1]; returned is whether it starts at ``first``.

    For a load of n coefficients it is a polynomial of n coefficients, b/rate - b'/rate**2 + ..., found from the last
    one on. It differs from the solution that starts at ``first`` by a layer exp(-rate (1 + x)). A layer below the floor
    is rounding; resolving it would cut [-1, 1] into pieces of its length.
    """
    start = last = rise = later = 0.0  # later coefficients: y[k + 1], and k + 1 and k + 2 of the derivative
    for k in range(n - 1, -1, -1):
        rise, later = later + 2.0 * (k + 1) * last, rise
        if k == 0:
            rise *= 0.5
        y[k] = last = (b[k] - rise) / rate
        start += last if k % 2 == 0 else -last
    return bool(abs(start - first) <= floor)


@EXACT_PART
def split(part: Array, early: Array, late: Array, floor: float) -> None:
    """Write the halves of a part: the late one in its place, the early one on top."""
    middle = 0.5 * (part[LOW] + part[HIGH])
    size = int(part[SIZE])
    early[SIZE] = chopped(early, restrict(part, size, -1.0, 0.0, early), 1e-3 * floor)
    early[LOW], early[HIGH] = part[LOW], middle
    size = restrict(part, size, 0.0, 1.0, late)
    for k in range(size):
        part[k] = late[k]
    part[SIZE] = chopped(part, size, 1e-3 * floor)
    part[LOW] = middle


@EXACT_PART
def zero(f: Array, n: int) -> float:
    """Return the zero of a decreasing series on [-1, 1].

    The series falls from above zero to below it. Newton's steps inside a bracket that only shrinks; where one leaves
    it, or gains less than halving, it is halved.
    """
    above, below = -1.0, 1.0
    x, before = 0.0, 2.0
    for _ in range(200):
        b1 = b2 = d1 = d2 = 0.0
        twice = 2.0 * x
        for k in range(n - 1, 0, -1):  # Clenshaw, and its derivative
            d1, d2 = twice * d1 + (2.0 * b1 - d2), d1
            b1, b2 = twice * b1 + (f[k] - b2), b1
        height, slope = x * b1 - b2 + f[0], x * d1 - d2 + b1
        if height > 0.0:
            above = x
        else:
            below = x
        step = height / slope if slope < 0.0 else 4.0
        near = x - step
        if abs(step) <= 0.5 * before and above < near < below:
            before = abs(step)
            if near == x:
                break
            x = near
        else:
            before = below - above
            x = 0.5 * (above + below)
            if x <= above or x >= below:
                x = below
                break
    return x


@EXACT_PART
def first_crossing(f: Array, n: int, floor: float, stack: Array) -> float:
    """Return where f first crosses zero downwards to below -floor, or 2 for never.

    The interval is halved until the coefficients prove a part positive or monotone; nothing is sampled. Values within
    the floor are no crossing; the place returned is the zero itself. The stack has MAX_DEPTH rows or more.
    """
    for k in range(n):
        stack[0, k] = f[k]
    stack[0, LOW], stack[0, HIGH], stack[0, SIZE] = -1.0, 1.0, n
    top = 0
    rose = False
    while top >= 0:
        c = stack[top]
        a, b, m = c[LOW], c[HIGH], int(c[SIZE])
        spread = 0.0
        bend = 0.0
        right = c[0]
        left = c[0]
        sign = 1.0
        for k in range(1, m):
            size = abs(c[k])
            sign = -sign
            spread += size
            bend += k * k * size
            right += c[k]
            left += sign * c[k]
        if c[0] - spread >= -floor:
            rose = rose or c[0] + spread > floor
            top -= 1
            continue
        slope = abs(c[1]) if m > 1 else 0.0
        whole = c[0] + spread >= -floor and 2.0 * slope <= bend
        if whole and b - a >= 1e-13 and top + 2 < MAX_DEPTH:
            split(c, stack[top + 1], stack[top + 2], floor)
            top += 1
            continue
        if min(left, right) >= -floor:
            rose = rose or max(left, right) > floor
            top -= 1
            continue
        if left <= floor and not rose:
            return -1.0  # f has been zero to rounding since the start: that is the crossing
        if left <= 0.0:
            # the zero lies in the part before, where f stayed within the floor; follow the tangent back to it
            rate = (value(c, m, -1.0 + 1e-6) - left) / 1e-6
            back = left / rate if rate < 0.0 else 0.0
            return float(max(-1.0, a - 0.5 * (b - a) * back))
        return float(0.5 * (a + b) + 0.5 * (b - a) * zero(c, m))
    return 2.0
