"""Gauss elimination in compiled code: small dense systems, and banded ones with full rows at the end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from impactlab.numerics.compiling import ALLOCATING_PART, PART
from impactlab.types import Array

MIN_PIVOT = 1e-12  # of a matrix with entries of order 1: below, only a sum of unknowns is determined


@PART
def solve_dense(system: Array, size: int) -> None:
    """Solve a small linear system in place, its right-hand side in column ``size``.

    Row pivoting. Unknowns that the system leaves undetermined are zero.
    """
    known = size
    for pivot in range(size):
        best = pivot
        for i in range(pivot + 1, size):
            if abs(system[i, pivot]) > abs(system[best, pivot]):
                best = i
        for j in range(pivot, known + 1):
            system[pivot, j], system[best, j] = system[best, j], system[pivot, j]
        if abs(system[pivot, pivot]) <= MIN_PIVOT:
            continue
        for i in range(pivot + 1, size):
            factor = system[i, pivot] / system[pivot, pivot]
            for j in range(pivot, known + 1):
                system[i, j] -= factor * system[pivot, j]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            system[i, known] -= system[i, j] * system[j, known]
        system[i, known] = system[i, known] / system[i, i] if abs(system[i, i]) > MIN_PIVOT else 0.0


@ALLOCATING_PART
def reaches(w: Array, size: int) -> NDArray[np.int64]:
    """Return one past the last entry of each row of w[:, :size], never before its diagonal."""
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
    """Solve w[:, :size] x = w[:, size:columns] in place, for a banded matrix with full rows at its end.

    Row pivoting. Rows before size - tail hold zeros left of their band; pivots are sought ``band`` rows below the
    diagonal and in the full rows. No row is read beyond its last entry, which pivoting moves. The solution is written
    to w[:, size:columns].
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
