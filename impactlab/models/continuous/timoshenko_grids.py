"""Two uniform grids of a beam, and the coupling of rotations to shear strains.

The operator takes rotations on one grid to shear strains on the other.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from impactlab.models.continuous.timoshenko_kernel import NARROW
from impactlab.numerics.lanes import LANES
from impactlab.types import Array


class Grid(NamedTuple):
    """Cells of one family of waves."""

    start: float  # m, of the first cell
    spacing: float  # m
    cells: int

    @property
    def centres(self) -> Array:
        """Centres of the cells [m]."""
        return np.asarray(self.start + self.spacing * (np.arange(self.cells) + 0.5))


class Coupling(NamedTuple):
    """Averages over the cells of one grid of a quantity on another."""

    first: Array  # (n_to,) the first cell that each row meets
    rows: Array  # (n_to, width)


def coupling(of_rows: Grid, of_columns: Grid) -> Coupling:
    """Return the projection P from one grid to another.

    P_ij = 1/h int f_i g_j dx with the hat functions f and g on the centres of two grids, h that of the first.

    Beyond the outermost centre a hat stays 1. Rows of P sum to 1 and carry straight lines over, and h/h' times its
    transpose does so in the other direction: both ways are of second order, and their work is equal.
    """
    to, spacing, of = of_rows.centres, of_rows.spacing, of_columns.centres
    low, high = to[0] - 0.5 * spacing, to[-1] + 0.5 * spacing
    edges = np.union1d(np.clip(np.concatenate((to, of)), low, high), [low, high])
    left, right = edges[:-1], edges[1:]
    middle = 0.5 * (left + right)
    entries: dict[str, list[Array]] = {"row": [], "column": [], "value": []}
    hats = [_hats(grid, middle, left, right) for grid in (to, of)]
    for i, f_left, f_right in hats[0]:
        for j, g_left, g_right in hats[1]:
            product = 2.0 * f_left * g_left + f_left * g_right + f_right * g_left + 2.0 * f_right * g_right
            entries["row"].append(i)
            entries["column"].append(j)
            entries["value"].append((right - left) * product / (6.0 * spacing))
    row, column = (np.concatenate(entries[key]).astype(int) for key in ("row", "column"))
    value = np.concatenate(entries["value"])
    used = value != 0.0
    row, column, value = row[used], column[used], value[used]
    first, last = np.full(to.size, of.size), np.zeros(to.size, int)
    np.minimum.at(first, row, column)
    np.maximum.at(last, row, column)
    width = min(int(np.max(last - first)) + 1, of.size)
    first = np.minimum(first, of.size - width)
    rows = np.zeros((to.size, width))
    np.add.at(rows, (row, column - first[row]), value)
    return Coupling(first.astype(float), rows)


def _hats(grid: Array, middle: Array, left: Array, right: Array) -> list[tuple[Any, Array, Array]]:
    """Return the two hat functions of each interval: number, value at left and right."""
    if grid.size == 1:
        return [(np.zeros(middle.size), np.ones(middle.size), np.ones(middle.size))]
    below = np.clip(np.searchsorted(grid, middle) - 1, 0, grid.size - 2)
    h = grid[below + 1] - grid[below]
    shares = [np.clip((x - grid[below]) / h, 0.0, 1.0) for x in (left, right)]
    return [(below, 1.0 - shares[0], 1.0 - shares[1]), (below + 1, shares[0], shares[1])]


def transposed(couple: Coupling, count: int) -> Coupling:
    """Return the transpose of a coupling with ``count`` columns."""
    n, width = couple.rows.shape
    row, column = np.repeat(np.arange(n), width), (couple.first.astype(int)[:, None] + np.arange(width)).ravel()
    value = couple.rows.ravel()
    used = value != 0.0
    row, column, value = row[used], column[used], value[used]
    first, last = np.full(count, n), np.zeros(count, int)
    np.minimum.at(first, column, row)
    np.maximum.at(last, column, row)
    rows = np.zeros((count, int(np.max(last - first)) + 1))
    rows[column, row - first[column]] = value
    return Coupling(np.minimum(first, n - 1).astype(float), rows)


def in_blocks(couple: Coupling) -> tuple[int, Array]:
    """Return the blocks of eight in a row, and the coupling as a flat array.

    The array holds the first cells, then the rows padded with zeros.
    """
    n, width = couple.rows.shape
    blocks = -(-width // LANES)
    rows = np.zeros((n, LANES * blocks))
    rows[:, :width] = couple.rows
    return blocks, np.concatenate((couple.first, rows.ravel()))


def factor(couple: Coupling, count: int, weight: float) -> tuple[int, Array]:
    """Return the bandwidth of 1 + weight P^T P and its factors, flat.

    Up to `NARROW` bands: L D L^T for `solve_narrow`. Wider: the rows of the Cholesky factor, each with the inverse of
    its diagonal at its end.
    """
    from scipy.linalg import cholesky_banded

    width = couple.rows.shape[1]
    banded = np.zeros((width, count))
    start = couple.first.astype(int)
    for i in range(width):
        for j in range(i + 1):
            np.add.at(banded[i - j], start + j, weight * couple.rows[:, i] * couple.rows[:, j])
    banded[0] += 1.0
    lower = cholesky_banded(banded, lower=True)
    if width - 1 <= NARROW:
        below, above = np.zeros((count, NARROW)), np.zeros((count, NARROW))
        for offset in range(1, width):
            entries = lower[offset, : count - offset] / lower[0, : count - offset]
            below[offset:, offset - 1], above[: count - offset, offset - 1] = entries, entries
        return width - 1, np.concatenate((below.ravel(), above.ravel(), 1.0 / lower[0] ** 2))
    rows = np.zeros((count, width))
    for offset in range(width):
        rows[offset:, width - 1 - offset] = lower[offset, : count - offset]
    rows[:, -1] = 1.0 / rows[:, -1]
    return width - 1, rows.ravel()
