"""The coupling of the two grids of a continuous beam, its transpose, and the factors that its steps solve with."""

from __future__ import annotations

import numpy as np
import pytest

from impactlab.models.continuous.timoshenko_grids import Coupling, Grid, coupling, factor, in_blocks, transposed
from impactlab.models.continuous.timoshenko_kernel import NARROW
from impactlab.numerics.banded_kernels import solve_by_rows, solve_narrow
from impactlab.numerics.lanes import LANES

SHEAR, BEND = Grid(0.0, 1.0 / 70, 70), Grid(0.0, 1.0 / 41, 41)


def dense(couple: Coupling, columns: int) -> np.ndarray:
    whole = np.zeros((couple.first.size, columns))
    for row, (first, values) in enumerate(zip(couple.first.astype(int), couple.rows, strict=True)):
        part = whole[row, first : first + values.size]
        part[:] = values[: part.size]
        assert not np.any(values[part.size :])
    return whole


def test_the_transpose_is_one() -> None:
    couple = coupling(SHEAR, BEND)
    back = transposed(couple, BEND.cells)
    assert np.array_equal(dense(back, SHEAR.cells), dense(couple, BEND.cells).T)


@pytest.mark.parametrize("width", [1, LANES, LANES + 1])
def test_rows_are_padded_to_whole_blocks(width: int) -> None:
    rows = np.arange(1.0, 3.0 * width + 1.0).reshape(3, width)
    blocks, flat = in_blocks(Coupling(np.array([0.0, 1.0, 2.0]), rows))
    assert blocks == (1 if width <= LANES else 2)
    assert flat[:3].tolist() == [0.0, 1.0, 2.0]
    padded = flat[3:].reshape(3, LANES * blocks)
    assert np.array_equal(padded[:, :width], rows)
    assert not np.any(padded[:, width:])


@pytest.mark.parametrize(("of_rows", "of_columns"), [(SHEAR, BEND), (Grid(0.0, 0.1, 10), Grid(0.0, 1.0 / 73, 73))])
def test_the_factors_solve(of_rows: Grid, of_columns: Grid) -> None:
    """Narrow where shear waves are the slower ones, as in all beams that bend, wide where they are much faster."""
    couple, n, weight = coupling(of_rows, of_columns), of_columns.cells, 0.7
    bands, factors = factor(couple, n, weight)
    assert (bands <= NARROW) == (of_rows.cells > n)
    projection = dense(couple, n)
    given = np.random.default_rng(1).standard_normal(n)
    found = given.copy()
    if bands <= NARROW:
        below, above, inverse = np.split(factors, [NARROW * n, 2 * NARROW * n])
        solve_narrow(n, below, above, inverse, found)
    else:
        solve_by_rows(n, bands, factors, found)
    expected = np.linalg.solve(np.eye(n) + weight * projection.T @ projection, given)
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-13)
