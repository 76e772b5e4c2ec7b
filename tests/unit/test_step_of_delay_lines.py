"""``points_per_period`` on stepped delay lines counts the period of mode d: ``modes``, else ``elements``, else 100."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.errors import CaseError, PairingError
from impactlab.scene.method import StepRule
from impactlab.simulate import prepare

C, LENGTH = 5000.0, 0.5  # m/s, m
STEEL = {"young": 2e11, "density": 8000.0}
HERTZ = {"kind": "hertz", "stiffness": 3e10}


def struck(model: dict[str, Any], law: dict[str, Any] = HERTZ, **more: Any) -> il.Case:
    """Return a ball on a free rod, with ten points per period."""
    rod = il.Rod(length=LENGTH, area=1e-3, material=STEEL)
    return il.Case(
        bodies={"ball": il.Mass(0.5, velocity=2.0), "rod": rod},
        contacts=[il.Contact("ball", "rod.left", law)],
        solve={"duration": 2e-4, "model": model, "step": {"points_per_period": 10.0}},
        **more,
    )


@pytest.mark.parametrize(
    ("options", "mode"),
    [({}, 100), ({"modes": 40}, 40), ({"elements": 60}, 60), ({"modes": 40, "elements": 60}, 40), ({"modes": 1}, 1)],
)
@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_the_step_is_a_tenth_of_the_period_of_mode_d(options: dict[str, int], mode: int, gravity: float) -> None:
    """The period of w = (2d + 1) pi c/(2L) is 4L/((2d + 1) c); under gravity the step is up to a fifth less."""
    plan = prepare(*struck({"kind": "continuous"} | options, gravity=gravity).simulation())
    step = 4.0 * LENGTH / ((2 * mode + 1) * C) / 10.0
    assert plan.dt is not None
    assert plan.dt == pytest.approx(step, rel=1e-12) if gravity == 0.0 else 0.8 * step <= plan.dt <= step


def test_it_is_the_step_of_the_modal_model_with_as_many_modes() -> None:
    delays, modal = (prepare(*struck({"kind": kind, "modes": 40}).simulation()) for kind in ("continuous", "modal"))
    assert delays.dt == pytest.approx(modal.dt, rel=1e-12)


def test_fewer_modes_change_the_step_and_not_the_physics() -> None:
    fine, coarse = (il.run(struck({"kind": "continuous", "modes": modes})) for modes in (200, 50))
    assert coarse.cost.steps == pytest.approx(fine.cost.steps / 4.0, rel=0.02)
    times = np.linspace(1e-5, 1.9e-4, 200)
    force, other = (each.evaluate(times, "force:ball|rod.left") for each in (fine, coarse))
    assert np.abs(force - other).max() < 0.01 * force.max()


def test_a_run_without_steps_warns_that_they_are_ignored() -> None:
    hard = {"kind": "addition_deletion"}
    plain, counted = (il.run(struck({"kind": "continuous"} | more, hard)) for more in ({}, {"modes": 40}))
    assert {each.code for each in counted.warnings} - {each.code for each in plain.warnings} == {"modes_unused"}
    case = struck({"kind": "continuous"}, hard)
    stepped = il.run(case.with_("solve.step", {"dt": 1e-6}))
    assert {each.code for each in stepped.warnings} - {each.code for each in plain.warnings} == {"step_unused"}
    times = np.linspace(0.0, 2e-4, 50)
    assert np.array_equal(plain.evaluate(times, "velocity:ball"), counted.evaluate(times, "velocity:ball"))


@pytest.mark.parametrize("ignored", [{"step": {"courant": 0.9}}, {"events": "located"}])
def test_a_run_without_steps_names_each_key_of_steps_that_it_ignores(ignored: dict[str, Any]) -> None:
    case = struck({"kind": "continuous"}, {"kind": "addition_deletion"})
    key, value = next(iter(ignored.items()))
    texts = [each.text for each in il.run(case.with_(f"solve.{key}", value)).warnings if each.code == "step_unused"]
    assert len(texts) == 1
    assert ("courant: 0.9" if key == "step" else "events: located") in texts[0]


def test_an_infinite_beam_without_shear_has_neither() -> None:
    ends = {"left": "infinite", "right": "infinite"}
    beam = il.Beam(length=1.0, section={"diameter": 0.02}, material="steel", ends=ends)
    case = il.Case(
        bodies={"ball": il.Mass(0.5, velocity=-2.0), "beam": beam},
        contacts=[il.Contact("beam.at(0.5)", "ball", HERTZ)],
        solve={"duration": 1e-4, "model": {"kind": "continuous", "modes": 40}},
    )
    with pytest.raises(PairingError, match="is infinite, and has neither modes nor elements"):
        il.run(case)


@pytest.mark.parametrize("dt", [math.inf, math.nan])
def test_a_step_without_end_is_refused(dt: float) -> None:
    """From Python; a case file refuses it when it is read."""
    ends = {"left": "pinned", "right": "pinned"}
    material = STEEL | {"poisson": 0.3}
    beam = il.Beam(
        length=0.3, section={"width": 0.01, "height": 0.01}, material=material, theory="timoshenko", ends=ends
    )
    case = il.Case(
        bodies={"ball": il.Mass(0.05, velocity=1.0), "beam": beam},
        contacts=[il.Contact("ball", "beam.at(0.15)", HERTZ)],
        solve={"duration": 1e-4, "model": {"kind": "continuous"}, "step": {"dt": 1e-6}},
    )
    scene, method = case.simulation()
    with pytest.raises(CaseError, match="the step"):
        prepare(scene, dataclasses.replace(method, step=StepRule(dt=dt)))
