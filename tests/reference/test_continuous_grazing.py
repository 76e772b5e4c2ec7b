"""The warning near_grazing on the exact paper case (PHYSICS: alpha 0.98 to 1.03, not 0.97 nor 1.04)."""

from __future__ import annotations

import time

import numpy as np
import pytest

from impactlab.exact.solve import solve
from impactlab.metrics.grazing import near_grazing
from impactlab.scene import Probe
from tests.reference.exact_scenes import name_of, struck


@pytest.mark.parametrize("alpha", [0.98, 0.99, 1.0, 1.0106, 1.0108, 1.02, 1.03])
def test_fires_near_the_edge(alpha):
    history = solve(*struck(alpha, 6.0))
    assert [warned.code for warned in history.warnings] == ["near_grazing"]
    assert name_of(history) in history.warnings[0].text


@pytest.mark.parametrize("alpha", [0.7, 0.97, 1.04, 1.5])
def test_is_silent_away_from_it(alpha):
    assert solve(*struck(alpha, 6.0)).warnings == []


def test_contacts_of_less_than_three_steps_are_left_to_chance():
    history = solve(*struck(1.0, 6.0))
    assert near_grazing(history, name_of(history), 2.0, dt=0.02) is not None
    assert near_grazing(history, name_of(history), 2.0, dt=0.03) is None


def test_the_paper_case_is_fast():
    scene = struck(1.0, 6.0, probes=[Probe("rod", 0.0, "displacement"), Probe("rod", 0.5, "stress")])
    solve(*scene)
    best = {"solve": np.inf, "evaluate": np.inf}
    t = np.linspace(0.0, 6.0, 6000)
    for _ in range(10):
        began = time.perf_counter()
        history = solve(*scene)
        best["solve"] = min(best["solve"], time.perf_counter() - began)
        began = time.perf_counter()
        for channel in ("displacement:rod@0", "stress:rod@0.5", "position:hammer", "force:hammer|rod.left"):
            history.evaluate(t, channel)
        best["evaluate"] = min(best["evaluate"], time.perf_counter() - began)
    print(best)
    assert best["solve"] < 4e-3  # 2 ms is asked for; a busy machine gets twice that
    assert best["evaluate"] < 4e-2
