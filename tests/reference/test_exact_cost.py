"""The predicted cost of the exact solver, against the same counts taken over the whole run: no clock is read."""

from __future__ import annotations

import numpy as np
import pytest

from impactlab.exact import cost
from impactlab.exact.solve import solve
from tests.reference.exact_scenes import CLAMPED, struck
from tests.reference.trains import random_train


def whole(scene):
    """The cost counted over all of a run."""
    return cost.spent(solve(*scene).log)


@pytest.mark.parametrize("seed", range(12))
def test_fronts_that_die_out_are_not_counted(seed):
    scene = random_train(np.random.default_rng(500 + seed)).scene()
    assert 1.0 / 3.0 < cost.predicted_s(*scene) / whole(scene) < 3.0


@pytest.mark.parametrize("trips", [3, 300, 10_000])
@pytest.mark.parametrize("alpha", [0.01, 1.0, 10.0])
def test_a_mass_on_a_rod(alpha, trips):
    scene = struck(alpha, 2.0 * trips, CLAMPED)
    assert 1.0 / 3.0 < cost.predicted_s(*scene) / whole(scene) < 3.0


def test_the_same_scene_has_the_same_prediction():
    scene = random_train(np.random.default_rng(3)).scene()
    assert cost.predicted_s(*scene) == cost.predicted_s(*scene)
