"""Bases whose modes are not those of the mesh are warned of where they vibrate."""

from __future__ import annotations

import numpy as np
import pytest

import impactlab as il
from tests.solving import in_steps

DURATION = 5e-3


def struck_cantilever(model: dict[str, object], ends: tuple[str, str] = ("clamped", "free")) -> il.Case:
    integrator = "newmark" if model["kind"] == "finite_element" else "exact_modal"
    section, material = {"width": 0.02, "height": 0.02}, {"young": 2e11, "density": 8000.0}
    sides = dict(zip(("left", "right"), ends, strict=True))
    beam = il.Beam(length=1.0, section=section, material=material, theory="euler_bernoulli", ends=sides)
    return il.Case(
        bodies={"beam": beam, "ball": il.Mass(0.1, velocity=-1.0)},
        contacts=[il.Contact("beam.at(0.5)", "ball", {"kind": "hertz", "stiffness": 1e9})],
        solve=in_steps(DURATION, integrator, model, dt=2e-6),
        probes=[{"body": "beam", "at": 0.0, "quantity": "bending_moment"}],
    )


def modal(modes: int, basis: object) -> dict[str, object]:
    return {"kind": "modal", "elements": 100, "modes": modes, "basis": basis}


def error_and_warnings(case: il.Case) -> tuple[float, list[str]]:
    """Return the error of the moment at the clamp beside the mesh itself, and the warnings of its modes."""
    history, mesh = il.run(case), il.run(struck_cantilever({"kind": "finite_element", "elements": 100}))
    times = np.linspace(0.0, DURATION, 2001)
    found, true = (each.evaluate(times, "bending_moment:beam@0") for each in (history, mesh))
    texts = [each.text for each in history.warnings if each.code == "approximate_modes"]
    return float(np.linalg.norm(found - true) / np.linalg.norm(true)), texts


@pytest.mark.parametrize(("modes", "basis"), [(20, "substructured"), (8, "craig_bampton"), (8, "ritz")])
def test_a_moment_far_from_the_contact_in_approximate_modes_is_warned_of(modes: int, basis: str) -> None:
    # The static answer to the contact is exact in all three, and the moment at the clamp is wrong by 33 to 77 %.
    error, texts = error_and_warnings(struck_cantilever(modal(modes, basis)))
    assert error > 0.3
    assert len(texts) == 1
    assert "bending_moment:beam@0" in texts[0]
    assert basis in texts[0]
    assert ("others" in texts[0]) == (basis == "substructured")


@pytest.mark.parametrize(
    ("modes", "basis"),
    [(40, {"kind": "substructured", "others": 3}), (16, "craig_bampton"), (12, "ritz"), (20, "eigenvectors")],
)
def test_modes_that_are_near_enough_are_not_warned_of(modes: int, basis: object) -> None:
    error, texts = error_and_warnings(struck_cantilever(modal(modes, basis)))
    assert error < 0.05
    assert not texts


def test_the_zero_moment_of_a_free_end_is_not_warned_of() -> None:
    history = il.run(struck_cantilever(modal(8, "craig_bampton"), ("free", "free")))
    assert "approximate_modes" not in {each.code for each in history.warnings}
