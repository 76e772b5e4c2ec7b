"""Fits warn where noise hides the front by which a free shift is found, beside a free offset."""

from __future__ import annotations

import numpy as np
import pytest

import impactlab as il
from impactlab.fits.model import Means
from impactlab.types import Array
from tests.solving import struck_rod

CHANNEL, SAMPLES, FRONT = "force:hammer|rod.left", 100, 36657.0


@pytest.mark.parametrize(("noise", "offset", "warned"), [(1.0, "free", True), (0.02, "free", False), (1.0, 0.0, False)])
def test_a_front_that_the_noise_hides_is_warned_of(noise: float, offset: str | float, warned: bool) -> None:
    solve = {"duration": {"round_trips": 1.5}, "model": {"kind": "continuous"}}
    case = struck_rod({"kind": "addition_deletion"}, solve)
    history = il.run(case)
    width = 1.05 * history.duration / SAMPLES
    times = np.asarray((np.arange(SAMPLES) + 0.5) * width, dtype=float)
    clean: Array = Means(history, CHANNEL).over(il.Signal(CHANNEL, times, 0.0 * times).edges, 2.0 * width)
    values: Array = clean + noise * FRONT * np.random.default_rng(5).standard_normal(SAMPLES)
    found = il.fit(
        case, il.Signal(CHANNEL, times, values), {"bodies.hammer.mass": (0.4, 10.0)}, shift="free", offset=offset
    )
    assert any("the shift of" in each for each in found.warnings) == warned
