"""Gauss elimination in compiled code, for dense and banded systems.

Dense systems are small, banded ones may have full rows at the end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from impactlab.numerics.compiling import ALLOCATING_PART, INLINE, PART
from impactlab.types import Array

MIN_PIVOT = 1e-12  # of a matrix with entries of order 1: below, only a sum of unknowns is determined


@INLINE
def first_column(row: int, band: int, size: int, width: int) -> int:
    """Return the column of a row's first stored entry.

    The matrix is banded.
    """
    return min(max(0, row - band), size - width)


@PART
def solve_banded(system: Array, size: int, band: int) -> None:
    """Solve a banded linear system in place by Gauss elimination.

    Its right-hand side is in the column after the matrix. Row i holds the columns from ``first_column`` on, ``width`` =
    min(3 band + 1, size) of them: pivoting by rows moves entries up to two bands to the right of the diagonal. A full
    matrix is one with a band of its size. Unknowns that the system leaves undetermined are zero.
    """
    width = min(3 * band + 1, size)
    known = width
    for pivot in range(size):
        last, beyond = min(size, pivot + band + 1), min(size, pivot + 2 * band + 1)
        own, best = first_column(pivot, band, size, width), pivot
        for i in range(pivot + 1, last):
            at = pivot - first_column(i, band, size, width)
            if abs(system[i, at]) > abs(system[best, pivot - first_column(best, band, size, width)]):
                best = i
        other = first_column(best, band, size, width)
        if best != pivot:
            for j in range(pivot, beyond):
                system[pivot, j - own], system[best, j - other] = system[best, j - other], system[pivot, j - own]
            system[pivot, known], system[best, known] = system[best, known], system[pivot, known]
        if abs(system[pivot, pivot - own]) <= MIN_PIVOT:
            continue
        for i in range(pivot + 1, last):
            first = first_column(i, band, size, width)
            factor = system[i, pivot - first] / system[pivot, pivot - own]
            if factor != 0.0:
                for j in range(pivot, beyond):
                    system[i, j - first] -= factor * system[pivot, j - own]
                system[i, known] -= factor * system[pivot, known]
    for i in range(size - 1, -1, -1):
        own = first_column(i, band, size, width)
        for j in range(i + 1, min(size, i + 2 * band + 1)):
            system[i, known] -= system[i, j - own] * system[j, known]
        diagonal = system[i, i - own]
        system[i, known] = system[i, known] / diagonal if abs(diagonal) > MIN_PIVOT else 0.0


@ALLOCATING_PART
def reaches(w: Array, size: int) -> NDArray[np.int64]:
    """Return one past the last entry of each row.

    Rows are those of w[:, :size]; it is never before the diagonal.
    """
    reach = np.zeros(size, np.int64)
    for i in range(size):
        reach[i] = size
        while reach[i] > i + 1 and w[i, reach[i] - 1] == 0.0:
            reach[i] -= 1
    return reach


@ALLOCATING_PART
def exchange(w: Array, size: int, columns: int, one: int, other: int, reach: NDArray[np.int64]) -> None:
    """Exchange two rows that are zero left of the earlier one's diagonal."""
    for k in range(one, max(reach[one], reach[other])):
        w[one, k], w[other, k] = w[other, k], w[one, k]
    for k in range(size, columns):
        w[one, k], w[other, k] = w[other, k], w[one, k]
    reach[one], reach[other] = reach[other], reach[one]


@ALLOCATING_PART
def solve_bordered(w: Array, size: int, columns: int, band: int, tail: int) -> None:
    """Solve a banded system with full rows at its end in place.

    It is w[:, :size] x = w[:, size:columns]. Row pivoting. Rows before size - tail hold zeros left of their band;
    pivots are sought ``band`` rows below the diagonal and in the full rows. No row is read beyond its last entry, which
    pivoting moves. The solution is written to w[:, size:columns].
    """
    reach = reaches(w, size)
    for c in range(size):
        last = min(c + band, size - tail)
        skipped = max(0, size - tail - max(c + 1, last))  # rows of which nothing is in this column
        best = c
        for at in range(c + 1, size - skipped):
            i = at if at < last else at + skipped
            if abs(w[i, c]) > abs(w[best, c]):
                best = i
        if best != c:
            exchange(w, size, columns, c, best, reach)
        for at in range(c + 1, size - skipped):
            i = at if at < last else at + skipped
            if w[i, c] != 0.0:
                factor = w[i, c] / w[c, c]
                for k in range(c, reach[c]):
                    w[i, k] -= factor * w[c, k]
                for k in range(size, columns):
                    w[i, k] -= factor * w[c, k]
                reach[i] = max(reach[i], reach[c])
    for c in range(size - 1, -1, -1):
        for k in range(size, columns):
            total = w[c, k]
            for i in range(c + 1, reach[c]):
                total -= w[c, i] * w[i, k]
            w[c, k] = total / w[c, c]
