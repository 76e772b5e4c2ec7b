"""Banded systems solved by LAPACK itself: the bits and the errors of `scipy.linalg.solveh_banded`."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import LinAlgError, solveh_banded

from impactlab.numerics.banded import solve, solve_each


def matrix(n: int, bands: int) -> np.ndarray:
    """Return a positive definite matrix in lower banded form."""
    found = np.random.default_rng(n).random((bands + 1, n))
    found[0] += 4.0 * bands
    for offset in range(1, bands + 1):
        found[offset, max(0, n - offset) :] = 0.0
    return found


@pytest.mark.parametrize(("n", "bands"), [(2, 1), (50, 1), (5, 2), (3, 3), (60, 3)])
def test_solutions_have_the_bits_of_scipy(n: int, bands: int) -> None:
    banded, given = matrix(n, bands), np.random.default_rng(bands).random((3, n))
    assert solve(banded, given[0]).tobytes() == solveh_banded(banded, given[0], lower=True).tobytes()
    each = np.ascontiguousarray(solveh_banded(banded, given.T, lower=True).T)
    assert solve_each(banded, given).tobytes() == each.tobytes()


def test_diagonal_systems_are_divided() -> None:
    banded = np.array([[2.0, 4.0, 8.0], [0.0, 0.0, 0.0]])
    assert solve_each(banded, np.ones((2, 3))).tolist() == [[0.5, 0.25, 0.125]] * 2
    assert solve_each(banded[:1], np.ones((0, 3))).shape == (0, 3)


@pytest.mark.parametrize("bands", [1, 3])
def test_a_singular_system_is_refused_as_by_scipy(bands: int) -> None:
    banded = matrix(9, bands)
    with pytest.raises(LinAlgError, match="not positive definite"):
        solve(-banded, np.ones(9))
    banded[0, 4] = np.nan
    with pytest.raises(ValueError, match="infs or NaNs"):
        solve(banded, np.ones(9))
