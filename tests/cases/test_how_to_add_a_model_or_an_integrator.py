"""The pages docs/how-to-add-an-integrator.md and docs/how-to-add-a-model.md run as they stand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

import impactlab as il
from impactlab.numerics.banded import full
from impactlab.plugins import MODELS
from impactlab.scene import End, Rod, Segment
from tests.cases.pages import Page

INTEGRATOR, MODEL = Page("how-to-add-an-integrator"), Page("how-to-add-a-model")


@pytest.mark.parametrize(("page", "most"), [(INTEGRATOR, 60), (MODEL, 50)])
def test_its_part_is_short_and_keeps_its_contract(
    page: Page, most: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert page.lines() <= most
    page.registry(tmp_path, monkeypatch)
    page.check_contract(monkeypatch)


def test_the_integrator_agrees_with_exact_modes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = il.load_case(tmp_path / "page.yaml", registry=INTEGRATOR.registry(tmp_path, monkeypatch))
    found = []
    for kind in ("velocity_verlet", "exact_modal"):
        [contact] = il.run(case.with_("solve.integrator", kind=kind)).contacts
        found.append((contact.impulse, contact.peak_force))
    # The phase error of the highest mode, at 40 steps in its period, is (2 pi/40)^2/24 of its phase: 1e-3.
    assert found[0] == pytest.approx(found[1], rel=1e-3)


def test_frequencies_of_the_model_are_of_the_fourth_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    registry = MODEL.registry(tmp_path, monkeypatch)
    steel = Rod("rod", (Segment(0.3, 9e-4, 2.1e11, 7900.0),), End("free"), End("clamped"))
    errors = []
    for elements in (20, 40):
        system = registry.load(MODELS, "averaged_mass")(elements).build(steel, 0.0).operators()
        third = np.sqrt(eigh(full(system.stiffness), full(system.mass), eigvals_only=True)[2])
        errors.append(third / (2.5 * np.pi * steel.segments[0].wave_speed / steel.length) - 1.0)
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.05)
    history = il.run(il.load_case(tmp_path / "page.yaml", registry=registry))
    given = sum(contact.impulse for contact in history.contacts)
    # The hammer's momentum changes by what the contacts give, to rounding.
    assert 2.133 * (1.0 - float(history.evaluate(history.duration, "velocity:hammer"))) == pytest.approx(
        given, rel=1e-10
    )
