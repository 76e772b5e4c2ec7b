"""Solution of a factorised tridiagonal system in vector registers, eight rows at a time.

Substitution is a recurrence, y_i = b_i + r_i y_{i-1}: each row waits for the last one. Eight rows at once,

    s = b + r (b one back),  s = s + r r' (s two back),  s = s + r r' r'' r''' (s four back),

are the eight values that begin from zero; the value before them enters with the products q_i = r_0 r_1 ... r_i. So
eight rows wait once, for one product and one sum. Every value is the sum that substitution gives, in another order: the
products lie between 0 and 1 for the matrices of springs and masses, so that no rounding grows.

Far from the ends of a uniform rod the factors are constant: in such a run of rows r and its powers stay in registers.
"""

from __future__ import annotations

from impactlab.numerics.compiling import HELPER, UNPACK
from impactlab.numerics.lanes import (
    LANES,
    all_first,
    all_lanes,
    all_last,
    earlier_four,
    earlier_one,
    earlier_two,
    first_lane,
    lanes_at,
    later_four,
    later_one,
    later_two,
    put_lanes,
)
from impactlab.numerics.windows import window
from impactlab.types import Array

MIN_RUN = 32  # rows: a shorter run of equal ones takes as long row by row
SAME_TOL = 4.0 * 2.0**-52  # of a factor: those that differ by rounding are taken for equal


@UNPACK
def is_like(one: float, other: float) -> bool:
    """Return whether two factors differ by rounding at most."""
    return abs(one - other) <= SAME_TOL * abs(other)


@HELPER
def write_runs(n: int, pivot: Array, lower: Array, springs: Array, runs: Array) -> None:
    """Write the runs of equal rows of a factorised chain.

    First is their number, then the rows of each, negative where the rows differ. ``pivot`` holds 1/D, ``lower`` the
    band of L, ``springs`` those to the ground and between neighbours (2 n,), or nothing. In an even run factors and
    springs are equal, those on its left included, and none goes to the ground. So the first and the last row never
    belong to one. ``runs`` has room for n >= 2 entries.
    """
    count, first, same = 0, 0, 1
    for i in range(1, n):
        even = i < n - 1 and is_like(lower[i], lower[same - 1]) and is_like(lower[i - 1], lower[same - 1])
        even = even and is_like(pivot[i], pivot[same])
        if even and springs.size > 0:
            bands = window(springs, n, n)
            even = springs[i] == 0.0 and is_like(bands[i], bands[same - 1]) and is_like(bands[i - 1], bands[same - 1])
        if even:
            continue
        if i - same >= MIN_RUN:
            runs[1 + count] = -(same - first)
            runs[2 + count] = i - same
            count, first = count + 2, i
        same = i + 1
    runs[1 + count] = -(n - first)
    runs[0] = count + 1


@UNPACK
def scanned_up(s: Array, one: Array, two: Array, four: Array) -> Array:
    """Return the values of the recurrence that begin from zero, first lane first."""
    s = s + one * later_one(s)
    s = s + two * later_two(s)
    return s + four * later_four(s)


@UNPACK
def scanned_down(s: Array, one: Array, two: Array, four: Array) -> Array:
    """Return the values of the recurrence that begin from zero, last lane first."""
    s = s + one * earlier_one(s)
    s = s + two * earlier_two(s)
    return s + four * earlier_four(s)


@HELPER
def forward_even(count: int, factor: float, before: float, x: Array) -> float:
    """Substitute forward along a run of equal rows; return the last value.

    It is x_i += factor x_{i-1}.
    """
    squared = factor * factor
    one, two, four = all_lanes(factor), all_lanes(squared), all_lanes(squared * squared)
    eight = four * four
    powers = scanned_up(one - later_one(one), one, two, four)
    carried, i = all_lanes(before), 0
    while i + LANES <= count:
        s = scanned_up(lanes_at(x, i), one, two, four)
        put_lanes(x, i, s + powers * carried)
        carried = all_last(s) + eight * carried
        i += LANES
    value = first_lane(carried)
    for k in range(i, count):
        value = x[k] + factor * value
        x[k] = value
    return value


@HELPER
def back_even(count: int, factor: float, pivot: float, after: float, x: Array) -> float:
    """Substitute back along a run of equal rows; return the first value.

    It is x_i = pivot x_i + factor x_{i+1}.
    """
    squared = factor * factor
    one, two, four = all_lanes(factor), all_lanes(squared), all_lanes(squared * squared)
    eight, scale = four * four, all_lanes(pivot)
    powers = scanned_down(one - earlier_one(one), one, two, four)
    carried, i = all_lanes(after), count
    while i >= LANES:
        i -= LANES
        s = scanned_down(scale * lanes_at(x, i), one, two, four)
        put_lanes(x, i, s + powers * carried)
        carried = all_first(s) + eight * carried
    value = first_lane(carried)
    for k in range(i - 1, -1, -1):
        value = pivot * x[k] + factor * value
        x[k] = value
    return value


@HELPER
def forward_each(count: int, lower: Array, before: float, x: Array) -> float:
    """Substitute forward, x_i -= lower_i x_{i-1}; return the last value.

    ``lower`` begins with the factor to the row before.
    """
    zero, ones = all_lanes(0.0), all_lanes(1.0)
    alone = ones - later_one(ones)
    carried, i = all_lanes(before), 0
    while i + LANES <= count:
        one = zero - lanes_at(lower, i)
        two = one * later_one(one)
        four = two * later_two(two)
        s = scanned_up(lanes_at(x, i), one, two, four)
        products = scanned_up(alone * one, one, two, four)
        put_lanes(x, i, s + products * carried)
        carried = all_last(s) + all_last(products) * carried
        i += LANES
    value = first_lane(carried)
    for k in range(i, count):
        value = x[k] - lower[k] * value
        x[k] = value
    return value


@HELPER
def back_each(count: int, lower: Array, pivot: Array, after: float, x: Array) -> float:
    """Substitute back, x_i = pivot_i x_i - lower_i x_{i+1}; return the first value."""
    zero, ones = all_lanes(0.0), all_lanes(1.0)
    alone = ones - earlier_one(ones)
    carried, i = all_lanes(after), count
    while i >= LANES:
        i -= LANES
        one = zero - lanes_at(lower, i)
        two = one * earlier_one(one)
        four = two * earlier_two(two)
        s = scanned_down(lanes_at(pivot, i) * lanes_at(x, i), one, two, four)
        products = scanned_down(alone * one, one, two, four)
        put_lanes(x, i, s + products * carried)
        carried = all_first(s) + all_first(products) * carried
    value = first_lane(carried)
    for k in range(i - 1, -1, -1):
        value = pivot[k] * x[k] - lower[k] * value
        x[k] = value
    return value


@HELPER
def solve_chain(pivot: Array, lower: Array, runs: Array, x: Array) -> None:
    """Solve a factorised tridiagonal system in place.

    It has at least two rows; the runs are those of `write_runs`.
    """
    value, done = x[0], 1
    for run in range(int(runs[0])):
        size = int(abs(runs[1 + run])) - (1 if run == 0 else 0)  # the first row stands already
        part = window(x, done, size)
        if runs[1 + run] > 0.0:
            value = forward_even(size, -lower[done - 1], value, part)
        else:
            value = forward_each(size, window(lower, done - 1, size), value, part)
        done += size
    value = 0.0
    for run in range(int(runs[0]) - 1, -1, -1):
        size = int(abs(runs[1 + run]))
        done -= size
        part = window(x, done, size)
        if runs[1 + run] > 0.0:
            value = back_even(size, -lower[done], pivot[done], value, part)
        else:
            value = back_each(size, window(lower, done, size), window(pivot, done, size), value, part)
