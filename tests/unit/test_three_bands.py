"""Systems of three bands, factorised from both ends, against a dense solve; forces of their springs."""

from __future__ import annotations

import numpy as np
import pytest

from impactlab.numerics.banded import full, grounded, multiply
from impactlab.numerics.banded_kernels import factorise, solve
from impactlab.numerics.three_bands import write_three_band_forces
from impactlab.types import Array


def matrix(n: int) -> Array:
    """Return a positive definite matrix with three random bands, lower banded."""
    banded = np.random.default_rng(n).standard_normal((4, n))
    for k in range(1, 4):
        banded[k, n - k :] = 0.0
    banded[0] = 6.0 + np.abs(banded[0])
    return banded


@pytest.mark.parametrize("n", [4, 5, 8, 9, 10, 11, 12, 13, 14, 20, 101, 400])
def test_both_ends_meet_in_the_solution_of_the_dense_matrix(n: int) -> None:
    banded = matrix(n)
    factors = np.concatenate((banded.ravel(), np.zeros(n)))
    factorise(n, 3, factors, np.zeros(0))
    right = np.random.default_rng(1).standard_normal(n)
    solve(n, 3, factors, x := right.copy())
    assert x == pytest.approx(np.linalg.solve(full(banded), right), rel=1e-13, abs=1e-14)


@pytest.mark.parametrize("n", [9, 10, 33])
def test_forces_of_all_bands_are_those_of_the_matrix(n: int) -> None:
    banded, u, force = matrix(n), np.random.default_rng(2).standard_normal(n), np.full(n, np.nan)
    springs = np.concatenate((grounded(banded), banded[1:].ravel()))
    write_three_band_forces(n, springs, u, force)
    assert force == pytest.approx(-multiply(banded, u), rel=1e-13, abs=1e-13)
    write_three_band_forces(n, np.concatenate((np.zeros(n), springs[n:])), np.full(n, 1e9), force)
    assert not force.any()  # travel alone stretches no spring
