"""Energy that a scheme loses slowly is told of in long runs."""

from __future__ import annotations

import numpy as np
import pytest

import impactlab as il
from tests.solving import in_steps


def swinging(integrator: str, step: float, steps: int = 200_000) -> il.Case:
    """Return a stretched rod that is let go and swings in one mode."""
    material, ends = {"young": 2e8, "density": 8000.0}, {"left": "clamped", "right": "free"}
    rod = il.Rod(length=1.0, area=1e-4, material=material, ends=ends, displacement="1e-3 * x")
    solve = in_steps(steps * step, integrator, {"kind": "modal", "modes": 1}, dt=step)
    return il.Case(bodies={"rod": rod}, solve=solve)


def lost(case: il.Case) -> tuple[float, list[str]]:
    history = il.run(case)
    texts = [each.text for each in history.warnings if each.code == "energy_loss"]
    return 1.0 - float(history.energy.total[-1] / history.energy.total[0]), texts


@pytest.mark.parametrize(("integrator", "step"), [("generalised_alpha", 5e-4), ("hht_alpha", 2.5e-4)])
def test_a_slow_loss_over_many_steps_is_warned_of(integrator: str, step: float) -> None:
    loss, texts = lost(swinging(integrator, step))
    assert 0.02 < loss < 0.1
    assert len(texts) == 1
    assert "2e+05 steps" in texts[0]


def test_a_scheme_without_losses_is_not_warned_of() -> None:
    loss, texts = lost(swinging("newmark", 5e-4))
    assert np.isclose(loss, 0.0, atol=1e-9)
    assert not texts
