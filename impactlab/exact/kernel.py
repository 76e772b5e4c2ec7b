"""Chebyshev series on an interval, compiled: evaluation, restriction, integration, linear equations, zero crossings.

All signals of a junction share one piece: a record [t0, t1] with the same number of coefficients per row.
Rows of a record: velocity of each node, displacement of each node, wave emitted by each end, its time integral,
force of each contact.
"""

from __future__ import annotations

import numpy as np

from impactlab.numerics.compiling import EXACT_PART
from impactlab.numerics.lanes import LANES, all_lanes, lane, lanes_at
from impactlab.numerics.windows import window
from impactlab.types import Array

ROOM = 72  # coefficients a piece may have; the numbers of points below divide it
ORDER = 68  # coefficients of a solve; the rest is room for integration
MAX_LOAD_HALF, MAX_RATE_HALF = 20, 4.0  # coefficients of the load and rate up to which HALF_ORDER is tried first
HALF_ORDER = 34
COSINES = np.cos(np.pi * np.arange(4 * ROOM) / (2 * ROOM))
# For m points, x_i = cos((2 i + 1) pi/(2 m)) from POINTS_AT[m] on, and cos((2 i + 1) k pi/(2 m)) row by row from
# WAVES_AT[m] on; the points with room beyond the last, as they are read eight at a time.
FEWEST = 6
COUNTS = [m for m in range(FEWEST, ROOM + 1, FEWEST) if ROOM % m == 0]
POINTS = np.concatenate([np.append(COSINES[(2 * np.arange(m) + 1) * (ROOM // m)], np.zeros(LANES)) for m in COUNTS])
WAVES = np.concatenate(
    [COSINES[np.outer((2 * np.arange(m) + 1) * (ROOM // m), np.arange(m)) % (4 * ROOM)].ravel() for m in COUNTS]
)
POINTS_AT, WAVES_AT = np.zeros((2, ROOM + 1), dtype=np.int64)
POINTS_AT[COUNTS] = np.cumsum([0, *(m + LANES for m in COUNTS[:-1])])
WAVES_AT[COUNTS] = np.cumsum([0, *(m * m for m in COUNTS[:-1])])
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
    for k in range(n - 1, 0, -1):
        b1, b2 = 2.0 * x * b1 - b2 + a[k], b1
    return float(x * b1 - b2 + a[0])


@EXACT_PART
def chopped(a: Array, n: int, floor: float) -> int:
    """Return how many coefficients of a[:n] are needed when those at the end below the floor are dropped."""
    while n > 1 and abs(a[n - 1]) <= floor:
        n -= 1
    return n


@EXACT_PART
def restrict(a: Array, n: int, low: float, high: float, out: Array) -> int:
    """Write the coefficients of the series on [low, high] of its interval; return how many.

    The series is taken at the zeros of a Chebyshev polynomial (Clenshaw) and the values are transformed back. Eight
    points go side by side, in one vector register: the recurrence of one waits for itself at every term.
    """
    m = FEWEST
    while m < n or ROOM % m != 0:
        m += FEWEST
    middle, half = all_lanes(0.5 * (low + high)), all_lanes(0.5 * (high - low))
    two, nothing = all_lanes(2.0), all_lanes(0.0)
    points, waves = window(POINTS, POINTS_AT[m], m + LANES), window(WAVES, WAVES_AT[m], m * m)
    for k in range(m):
        out[k] = 0.0
    for i in range(0, m, LANES):
        x = middle + half * lanes_at(points, i)
        twice, p, q = two * x, nothing, nothing
        for k in range(n - 1, 0, -1):
            p, q = twice * p + (all_lanes(a[k]) - q), p
        f = x * p + (all_lanes(a[0]) - q)
        for place in range(0, min(LANES, m - i), 2):
            even, odd = lane(f, place), lane(f, place + 1)
            c, d = window(waves, (i + place) * m, m), window(waves, (i + place + 1) * m, m)
            for k in range(m):
                out[k] += even * c[k] + odd * d[k]
    out[0] /= m
    for k in range(1, m):
        out[k] *= 2.0 / m
    return min(m, n)


@EXACT_PART
def integrate(a: Array, n: int, half: float, first: float, out: Array) -> None:
    """Write n + 1 coefficients of first + integral from the left end; half is half the length of the piece."""
    total = 0.0
    for k in range(1, n + 1):
        before = 2.0 * a[0] if k == 1 else a[k - 1]
        after = a[k + 1] if k + 1 < n else 0.0
        out[k] = half * (before - after) / (2.0 * k)
        total += out[k] if k % 2 == 0 else -out[k]
    out[0] = first - total


@EXACT_PART
def relax(rate: float, b: Array, first: float, order: int, y: Array, work: Array) -> None:
    """Solve y' = -rate y + b on [-1, 1], y(-1) = first, rate >= 0.

    The tau method, with so many coefficients.

    Backward elimination y_k = p_k y_{k-1} + r_k (Olver, Miller): all p_k are negative, so nothing cancels.
    """
    p = 0.0
    r = 0.0
    for k in range(order - 1, 0, -1):
        w = 0.5 / k
        twice = 2.0 if k == 1 else 1.0
        after = b[k + 1] if k + 1 < order else 0.0
        pivot = 1.0 - rate * w * p
        part = 1.0 / pivot
        r = (w * (twice * b[k - 1] - after) + rate * w * r) * part
        p = -rate * w * twice * part
        work[0, k] = p
        work[1, k] = r
    g = 1.0
    q = 0.0
    sum_g = 1.0
    sum_q = 0.0
    for k in range(1, order):
        g = work[0, k] * g
        q = work[0, k] * q + work[1, k]
        sign = 1.0 if k % 2 == 0 else -1.0
        sum_g += sign * g
        sum_q += sign * q
    y[0] = (first - sum_q) / sum_g
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
    """Write the two halves of a part: the late one in its place, the early one on top of it."""
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
    """Return the zero of a series that decreases on [-1, 1] from above zero to below it.

    Newton's steps inside a bracket that only shrinks; where one leaves it, or gains less than halving, it is halved.
    """
    above, below = -1.0, 1.0
    x, before = 0.0, 2.0
    for _ in range(200):
        b1 = b2 = d1 = d2 = 0.0
        for k in range(n - 1, 0, -1):  # Clenshaw, and its derivative
            d1, d2 = 2.0 * (x * d1 + b1) - d2, d1
            b1, b2 = 2.0 * x * b1 - b2 + f[k], b1
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
