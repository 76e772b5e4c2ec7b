"""Whether all numbers of an array are finite: of few and of many, also where their sums overflow."""

from __future__ import annotations

import numpy as np
import pytest

from impactlab.scene.precision import MAX_DOT, all_finite


@pytest.mark.parametrize("size", [1, 7, MAX_DOT, MAX_DOT + 1])
def test_one_number_that_is_not_finite_is_found(size: int) -> None:
    values = np.random.default_rng(size).standard_normal(size)
    assert all_finite(values)
    for wrong in (np.nan, np.inf, -np.inf):
        values[size // 2] = wrong
        assert not all_finite(values)


@pytest.mark.parametrize("size", [2, MAX_DOT + 1])
def test_numbers_whose_sums_overflow_are_finite(size: int) -> None:
    with np.errstate(over="ignore"):
        assert all_finite(np.full(size, 1.7e308))
        assert not all_finite(np.concatenate((np.full(size, 1.7e308), [np.inf])))


def test_nothing_is_finite() -> None:
    assert all_finite(np.zeros((3, 0)))
