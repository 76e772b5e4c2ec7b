"""The damping of a body as groups of dashpots."""

from __future__ import annotations

import numpy as np
import pytest

from impactlab.models.base import Operators
from impactlab.numerics.banded import multiply
from impactlab.simulate.stepping.setup.flat_arrays import dashpots, groups


def body(damping: np.ndarray, ends: np.ndarray) -> Operators:
    n = ends.size
    ones, zeros = np.ones((1, n)), np.zeros(n)
    return Operators(ones, damping, ones, zeros, zeros, zeros, 1.0, 1.0, True, False, end_dashpots=ends)


@pytest.mark.parametrize("bandwidth", [0, 1, 3])
def test_the_power_of_all_dashpots_is_that_of_the_matrix(bandwidth: int) -> None:
    rng = np.random.default_rng(bandwidth)
    n = 12
    damping = np.zeros((bandwidth + 1, n))
    for offset in range(1, bandwidth + 1):
        damping[offset, : n - offset] = -rng.random(n - offset)
    damping[1:, 5] = 0.0  # the groups end there
    ends = np.zeros(n)
    ends[0], ends[-1] = rng.random(2)
    damping[0] = 1.0 + rng.random(n) + ends
    system, v = body(damping, ends), rng.standard_normal(n)
    power = {True: 0.0, False: 0.0}
    for group in dashpots(system):
        count = group.damping.size
        far = v[group.other :][:count] if group.other >= 0 else 0.0
        power[group.inside] += float(group.damping @ (v[group.first :][:count] - far) ** 2)
    assert sum(power.values()) == pytest.approx(float(v @ multiply(damping, v)), rel=1e-13)
    assert power[False] == pytest.approx(float(ends @ v**2), rel=1e-13)


def test_a_body_without_damping_has_no_dashpots() -> None:
    assert dashpots(body(np.zeros((2, 4)), np.zeros(4))) == []


def test_groups_end_at_zeros() -> None:
    found = groups(np.array([0.0, 2.0, 3.0, 0.0, 0.0, 5.0]))
    assert [(first, values.tolist()) for first, values in found] == [(1, [2.0, 3.0]), (5, [5.0])]
    assert groups(np.zeros(3)) == []
