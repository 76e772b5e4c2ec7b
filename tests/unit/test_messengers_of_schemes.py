"""Modal messengers give free waves; a scheme that steps the modes otherwise lets pressed faces drift."""

from __future__ import annotations

import math

import numpy as np
import pytest

import impactlab as il
from impactlab.history import AbstractHistory
from tests.solving import in_steps

WEIGHT, MODES, POINTS = 0.3, 20, 10  # N of 1 kg on a rod of c = Z = 1, m = 1; it swings about 0.3 m of compression


def resting(scheme: str, duration: float = 6.0) -> AbstractHistory:
    rod = il.Rod(length=1.0, area=1.0, material={"young": 1.0, "density": 1.0}, ends={"right": "clamped"})
    case = il.Case(
        bodies={"m": il.Mass(1.0), "rod": rod},
        contacts=[il.Contact("m", "rod.left", {"kind": "modal_messengers"})],
        gravity=WEIGHT,
        solve=in_steps(duration, scheme, {"kind": "modal", "modes": MODES}, points_per_period=POINTS),
    )
    return il.run(case)


def test_a_drift_is_warned_of_with_its_size() -> None:
    """The gap grew by 7.4e-3 m without a word; it is the impulse times the difference of the velocities per force."""
    history = resting("newmark")
    w = (np.arange(MODES) + 0.5) * math.pi
    dt = history.dt or 0.0
    newmark, waves = 2.0 * np.sum(dt / (1.0 + 0.25 * (w * dt) ** 2)), 2.0 * np.sum(np.sin(w * dt) / w)
    share = 1.0 - newmark / waves
    (warned,) = [each for each in history.warnings if each.code == "messengers_apart"]
    assert f"differs by {100.0 * share:.3g} %" in warned.text
    drift = share * waves * history.impulse_of("m|rod.left")
    assert history.evaluate([6.0], "gap:m|rod.left")[0] == pytest.approx(drift, rel=0.05)


def test_steps_of_free_motion_do_not_drift() -> None:
    history = resting("exact_modal")
    assert "messengers_apart" not in [each.code for each in history.warnings]
    assert abs(history.evaluate([6.0], "gap:m|rod.left")[0]) < 3e-4


def test_a_scheme_that_gains_energy_is_refused_with_one_that_does_not() -> None:
    with pytest.raises(il.StepError, match="Use integrator exact_modal"):
        resting("generalised_alpha", 20.0)


def test_an_impedance_that_the_modes_do_not_have_is_warned_of() -> None:
    """At 4 to 9 points in the shortest period the speed of the mass was 12 to 48 % wrong without a word on it."""
    rod = il.Rod(length=1.0, area=1.0, material={"young": 1.0, "density": 1.0}, ends={"right": "clamped"})

    def struck(balance: str, points: float) -> AbstractHistory:
        case = il.Case(
            bodies={"m": il.Mass(1.0, velocity=0.1), "rod": rod},
            contacts=[il.Contact("m", "rod.left", {"kind": "modal_messengers", "balance": balance})],
            solve=in_steps(4.0, "exact_modal", {"kind": "modal", "modes": 10}, points_per_period=points),
        )
        return il.run(case)

    for points in (4, 8):
        history = struck("impedance", points)
        w, dt = (np.arange(10) + 0.5) * math.pi, history.dt or 0.0
        share = float(np.sum(2.0 * np.sin(w * dt) / w))
        (warned,) = [each for each in history.warnings if each.code == "messengers_apart"]
        assert f"the modes of 'rod' give {share:.3g}/Z" in warned.text
        assert "messengers_apart" not in [each.code for each in struck("modes", points).warnings]
