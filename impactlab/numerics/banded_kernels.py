"""Banded symmetric matrices in compiled code: L D L^T factors, solutions, springs.

Of springs, forces and energies are computed. Bands below the diagonal are flat. A stiffness stands as springs: to the
ground (the sums of its rows), then its bands.
"""

from __future__ import annotations

from impactlab.numerics.chain_solve import solve_chain, write_runs
from impactlab.numerics.compiling import HELPER
from impactlab.numerics.three_bands import MIN_ROWS, factorise_three, solve_three
from impactlab.numerics.windows import window
from impactlab.types import Array


@HELPER
def pull(n: int, bandwidth: int, springs: Array, u: Array, force: Array) -> None:
    """Subtract the forces of springs (ground, then bands; flat) at displacements u from ``force``."""
    if bandwidth == 1 and n > 1:
        ground, band = window(springs, 0, n), window(springs, n, n)
        force[0] -= ground[0] * u[0] + band[0] * (u[1] - u[0])
        for i in range(1, n - 1):
            force[i] -= ground[i] * u[i] + band[i] * (u[i + 1] - u[i]) + band[i - 1] * (u[i - 1] - u[i])
        force[n - 1] -= ground[n - 1] * u[n - 1] + band[n - 2] * (u[n - 2] - u[n - 1])
        return
    for i in range(n):
        force[i] -= springs[i] * u[i]
    for offset in range(1, bandwidth + 1):
        band = window(springs, offset * n, n)
        for i in range(n - offset):
            force[i] -= band[i] * (u[i + offset] - u[i])
        for i in range(offset, n):
            force[i] -= band[i - offset] * (u[i - offset] - u[i])


@HELPER
def solve(n: int, bandwidth: int, factors: Array, x: Array) -> None:
    """Solve a factorised system in place; ``factors`` as `factorise` leaves them."""
    pivot, lower = window(factors, 0, n), window(factors, n, bandwidth * n)
    if bandwidth == 1 and n > 1:
        solve_chain(pivot, lower, window(factors, 2 * n, n), x)
        return
    if bandwidth == 3 and n >= MIN_ROWS:
        solve_three(n, pivot, lower, x)
        return
    for i in range(n):
        rest = x[i]
        for offset in range(1, min(bandwidth, i) + 1):
            rest -= lower[(offset - 1) * n + i - offset] * x[i - offset]
        x[i] = rest
    for i in range(n):
        x[i] *= pivot[i]
    for i in range(n - 1, -1, -1):
        rest = x[i]
        for offset in range(1, min(bandwidth, n - 1 - i) + 1):
            rest -= lower[(offset - 1) * n + i] * x[i + offset]
        x[i] = rest


@HELPER
def factorise(n: int, bandwidth: int, factors: Array, springs: Array) -> None:
    """Replace a banded matrix by the factors of its L D L^T.

    The diagonal becomes 1/D, the bands below it become those of L. Three bands are those of
    `impactlab.numerics.three_bands`.

    ``factors`` has room for n numbers more: the runs of equal rows of a tridiagonal matrix, as `write_runs` finds them
    for these springs.
    """
    pivot, lower = window(factors, 0, n), window(factors, n, bandwidth * n)
    if bandwidth == 1 and n > 1:
        for i in range(n - 1):
            pivot[i] = 1.0 / pivot[i]
            scaled = lower[i] * pivot[i]
            pivot[i + 1] -= lower[i] * scaled
            lower[i] = scaled
        pivot[n - 1] = 1.0 / pivot[n - 1]
        write_runs(n, pivot, lower, springs, window(factors, 2 * n, n))
        return
    if bandwidth == 3 and n >= MIN_ROWS:
        factorise_three(n, pivot, lower)
        return
    for i in range(n):
        for offset in range(min(bandwidth, i), 0, -1):  # column by column of row i
            j = i - offset
            entry = lower[(offset - 1) * n + j]
            for other in range(offset + 1, min(bandwidth, i) + 1):
                k = i - other
                # L_ik D_k stands in row i until the row is done.
                entry -= lower[(other - 1) * n + k] * lower[(other - offset - 1) * n + k]
            lower[(offset - 1) * n + j] = entry
        left = pivot[i]
        for offset in range(1, min(bandwidth, i) + 1):
            at = (offset - 1) * n + i - offset
            scaled = lower[at] * pivot[i - offset]
            left -= lower[at] * scaled
            lower[at] = scaled
        pivot[i] = 1.0 / left


@HELPER
def add_matrix(
    n: int, factor: float, bandwidth: int, matrix: Array, as_springs: bool, diagonal: Array, lower: Array
) -> None:
    """Add a factor times a matrix to a banded matrix.

    The matrix is flat bands, or springs; it is added to a diagonal and the bands below it.
    """
    for i in range(n):
        diagonal[i] += factor * matrix[i]
    for offset in range(1, bandwidth + 1):
        band, into = window(matrix, offset * n, n), window(lower, (offset - 1) * n, n)
        for i in range(n - offset):
            into[i] += factor * band[i]
            if as_springs:
                diagonal[i] -= factor * band[i]
                diagonal[i + offset] -= factor * band[i]


@HELPER
def in_springs(n: int, bandwidth: int, springs: Array, x: Array, y: Array) -> float:
    """Return x K y/2 of springs; with displacements u for both, their energy."""
    energy = 0.0
    for i in range(n):
        energy += 0.5 * springs[i] * x[i] * y[i]
    for offset in range(1, bandwidth + 1):
        band = window(springs, offset * n, n)
        for i in range(n - offset):
            energy -= 0.5 * band[i] * (x[i + offset] - x[i]) * (y[i + offset] - y[i])
    return energy


@HELPER
def in_motion(n: int, bandwidth: int, masses: Array, v: Array) -> float:
    """Return v M v/2."""
    energy = 0.0
    for i in range(n):
        energy += 0.5 * masses[i] * v[i] * v[i]
    for offset in range(1, bandwidth + 1):
        band = window(masses, offset * n, n)
        for i in range(n - offset):
            energy += band[i] * v[i] * v[i + offset]
    return energy


@HELPER
def solve_narrow(n: int, below: Array, above: Array, inverse: Array, x: Array) -> None:
    """Solve with L D L^T of at most four bands, in place.

    The last four values stay in registers. Four entries a row, from beside the diagonal outwards: ``below`` of the rows
    of L, ``above`` of its columns; ``inverse`` that of D.
    """
    one, two, three, four = 0.0, 0.0, 0.0, 0.0
    for j in range(n):
        rest = x[j] - below[4 * j + 3] * four - below[4 * j + 2] * three - below[4 * j + 1] * two
        one, two, three, four = rest - below[4 * j] * one, one, two, three
        x[j] = one * inverse[j]
    one, two, three, four = 0.0, 0.0, 0.0, 0.0
    for j in range(n - 1, -1, -1):
        rest = x[j] - above[4 * j + 3] * four - above[4 * j + 2] * three - above[4 * j + 1] * two
        one, two, three, four = rest - above[4 * j] * one, one, two, three
        x[j] = one


@HELPER
def solve_by_rows(n: int, band: int, factor: Array, x: Array) -> None:
    """Solve with a banded Cholesky factor by rows, in place.

    Rows end with the inverse of their diagonal.
    """
    for j in range(n):
        total, row = x[j], j * (band + 1)
        for k in range(max(0, band - j), band):
            total -= factor[row + k] * x[j - band + k]
        x[j] = total * factor[row + band]
    for j in range(n - 1, -1, -1):
        row = j * (band + 1)
        solved = x[j] * factor[row + band]
        x[j] = solved
        for k in range(max(0, band - j), band):
            x[j - band + k] -= factor[row + k] * solved
