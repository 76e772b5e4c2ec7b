"""Warnings of energy that a run lost and nothing booked."""

from __future__ import annotations

from typing import Any

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


def arm_on_spring(**solve: Any) -> tuple[float, list[str]]:
    """Return the largest loss of an arm of two links that strikes a spring, and the warnings of it.

    Neither links nor spring nor gravity take energy from the motion.
    """
    bodies = {"upper": il.Link(length=0.3, mass=1.0), "lower": il.Link(length=0.2, mass=0.5), "stop": il.Wall()}
    links = [{"body": "upper", "angle": -0.2, "rate": 8.0}, {"body": "lower", "angle": 1.5}]
    contact = il.Contact("lower.right", "stop", along="y", gap=0.05, law={"kind": "penalty", "stiffness": 1e7})
    case = {"mechanisms": {"arm": {"links": links}}, "solve": {"duration": 0.5, **solve}}
    history = il.run(il.Case(bodies=bodies, contacts=[contact], **case))
    assert len(history.contacts) == 1
    return history.energy.largest_loss, [each.text for each in history.warnings if each.code == "energy_loss"]


@pytest.mark.parametrize(
    ("method", "stated"),
    [
        ({"integrator": {"kind": "adaptive", "relative_tolerance": 1e-2}}, "tolerance of 0.01"),
        ({"integrator": {"kind": "midpoint"}, "step": {"dt": 5e-3}}, "steps, 5 ms long"),
    ],
)
def test_a_loss_without_damping_is_warned_of_at_the_limit_of_gains(method: dict[str, Any], stated: str) -> None:
    loss, texts = arm_on_spring(**method)
    assert 0.02 < loss < 0.1
    assert len(texts) == 1
    assert texts[0].startswith(f"{100 * loss:.2g} % of the reference energy")
    assert stated in texts[0]


def test_default_tolerances_keep_the_energy() -> None:
    loss, texts = arm_on_spring(integrator={"kind": "adaptive"})
    assert loss < 100 * 1e-8
    assert not texts
