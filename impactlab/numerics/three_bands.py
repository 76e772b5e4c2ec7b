"""Factorisation of three-band systems, as of beams, from both ends.

Solutions and forces of springs are computed, too. Rows are eliminated from both ends towards three rows in the middle,
which no two outer rows of different sides couple: two chains run side by side and take half the time of one. A band
stands where that of the matrix stands, the entry between rows i and i + k at i: of the upper side it belongs to row i,
of the lower side to row i + k.
"""

from __future__ import annotations

from impactlab.numerics.compiling import HELPER, IN_ORDER
from impactlab.numerics.windows import window
from impactlab.types import Array

MIN_ROWS = 9  # rows: three on each side and three in the middle


@HELPER
def eliminate(n: int, row: int, way: int, reach: int, pivot: Array, bands: Array) -> None:
    """Eliminate a row from up to three next ones.

    They are further on (way 1) or back (-1).
    """
    inverse = 1.0 / pivot[row]
    for far in range(1, reach + 1):
        given = bands[(far - 1) * n + min(row, row + way * far)]
        pivot[row + way * far] -= given * given * inverse
        for near in range(1, far):
            between = (far - near - 1) * n + min(row + way * near, row + way * far)
            bands[between] -= given * bands[(near - 1) * n + min(row, row + way * near)] * inverse
    for far in range(1, reach + 1):
        bands[(far - 1) * n + min(row, row + way * far)] *= inverse
    pivot[row] = inverse


@HELPER
def factorise_three(n: int, pivot: Array, bands: Array) -> None:
    """Replace a matrix of three bands by factors from both ends.

    The diagonal becomes 1/D.
    """
    middle = (n - 3) // 2
    for row in range(middle):
        eliminate(n, row, 1, 3, pivot, bands)
    for row in range(n - 1, middle + 2, -1):
        eliminate(n, row, -1, 3, pivot, bands)
    for row in range(middle, middle + 3):
        eliminate(n, row, 1, middle + 2 - row, pivot, bands)


@IN_ORDER
def solve_three(n: int, pivot: Array, bands: Array, x: Array) -> None:
    """Solve a system that is factorised from both ends, in place.

    It has at least nine rows; values stay in registers.
    """
    one, two, three = window(bands, 0, n), window(bands, n, n), window(bands, 2 * n, n)
    middle, sides = (n - 3) // 2, n - 3 - (n - 3) // 2  # rows above and below the middle three
    far, near, here = 0.0, 0.0, 0.0
    last_far, last_near, last = 0.0, 0.0, 0.0
    x[1] -= one[0] * x[0]
    x[2] -= one[1] * x[1] + two[0] * x[0]
    far, near, here = x[0], x[1], x[2]
    x[n - 2] -= one[n - 2] * x[n - 1]
    x[n - 3] -= one[n - 3] * x[n - 2] + two[n - 3] * x[n - 1]
    last_far, last_near, last = x[n - 1], x[n - 2], x[n - 3]
    # Ranges that begin at zero and counters that grow from it: numba then checks no index for being negative.
    count = middle - 3
    rows, lows = window(x, 3, count), window(x, n - middle, count)
    one_up, two_up = window(one, 2, count), window(two, 1, count)
    one_low, two_low, three_low = (
        window(one, n - middle, count),
        window(two, n - middle, count),
        window(three, n - middle, count),
    )
    i = 0
    for j in range(count - 1, -1, -1):
        down = rows[i] - three[i] * far - two_up[i] * near - one_up[i] * here
        up = lows[j] - three_low[j] * last_far - two_low[j] * last_near - one_low[j] * last
        far, near, here = near, here, down
        last_far, last_near, last = last_near, last, up
        rows[i], lows[j] = down, up
        i += 1  # noqa: SIM113 - no enumerate in compiled loops
    if sides > middle:  # one row more below
        j = middle + 3
        x[j] -= three[j] * last_far + two[j] * last_near + one[j] * last
    for row in range(middle, middle + 3):
        rest = x[row] - one[row - 1] * x[row - 1] - two[row - 2] * x[row - 2] - three[row - 3] * x[row - 3]
        for k in range(middle + 3 - row, 4):
            rest -= bands[(k - 1) * n + row] * x[row + k]
        x[row] = rest
    here = x[middle + 2] * pivot[middle + 2]
    near = x[middle + 1] * pivot[middle + 1] - one[middle + 1] * here
    far = x[middle] * pivot[middle] - one[middle] * near - two[middle] * here
    x[middle], x[middle + 1], x[middle + 2] = far, near, here
    last_far, last_near, last = far, near, here  # those of rows further on, where three, two and one reach
    far, here = here, far
    lows, pivot_low = window(x, middle + 3, middle), window(pivot, middle + 3, middle)
    one_low, two_low, three_low = (
        window(one, middle + 2, middle),
        window(two, middle + 1, middle),
        window(three, middle, middle),
    )
    j = 0
    for i in range(middle - 1, -1, -1):
        down = x[i] * pivot[i] - three[i] * far - two[i] * near - one[i] * here
        up = lows[j] * pivot_low[j] - three_low[j] * last_far - two_low[j] * last_near - one_low[j] * last
        far, near, here = near, here, down
        last_far, last_near, last = last_near, last, up
        x[i], lows[j] = down, up
        j += 1  # noqa: SIM113
    if sides > middle:
        x[n - 1] = x[n - 1] * pivot[n - 1] - three[n - 4] * last_far - two[n - 3] * last_near - one[n - 2] * last


@IN_ORDER
def write_three_band_forces(n: int, springs: Array, u: Array, force: Array) -> None:
    """Write the forces of springs at displacements u [N].

    Springs are flat: to the ground, then three bands, less than zero or not. All bands in one pass over the inner rows;
    of at least seven rows.
    """
    ground, one = window(springs, 0, n), window(springs, n, n)
    two, three = window(springs, 2 * n, n), window(springs, 3 * n, n)
    inner = window(force, 3, n - 6)
    middle, one_back, two_back = window(ground, 3, n - 6), window(one, 2, n - 5), window(two, 1, n - 4)
    for i in range(n - 6):
        here = u[i + 3]
        total = middle[i] * here + one_back[i + 1] * (u[i + 4] - here) + one_back[i] * (u[i + 2] - here)
        total += two_back[i + 2] * (u[i + 5] - here) + two_back[i] * (u[i + 1] - here)
        inner[i] = -(total + three[i + 3] * (u[i + 6] - here) + three[i] * (u[i] - here))
    for side in range(2):
        for row in range(3):
            i = n - 1 - row if side else row
            total = ground[i] * u[i]
            for k in range(1, 4):
                if i + k < n:
                    total += springs[k * n + i] * (u[i + k] - u[i])
                if i >= k:
                    total += springs[k * n + i - k] * (u[i - k] - u[i])
            force[i] = -total
