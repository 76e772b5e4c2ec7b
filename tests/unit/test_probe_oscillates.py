"""Internal forces that last less than elements resolve carry a warning, others none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.history.base import AbstractHistory
from tests.support import codes

AREA, YOUNG, DENSITY = 9e-4, 2.1e11, 7900.0
FORCE = "force:rod@0.15"
MESH = {"kind": "finite_element", "elements": 200}
LUMPED = {**MESH, "mass": "lumped"}


def struck(model: dict[str, Any], integrator: str, courant: float, striker: float = 0.003) -> AbstractHistory:
    """A short bar strikes a long one of the same section at 1 m/s: a pulse of twice its length."""
    shape = {"kind": "rod", "area": AREA, "material": {"young": YOUNG, "density": DENSITY}}
    own = {**model, "elements": max(1, round(model["elements"] * striker / 0.3))}
    return il.run(
        il.Case.from_dict(
            {
                "schema_version": 1,
                "bodies": {
                    "rod": {**shape, "length": 0.3},
                    "striker": {**shape, "length": striker, "velocity": -1.0},
                },
                "contacts": [{"between": ["rod.right", "striker.left"], "law": {"kind": "addition_deletion"}}],
                "solve": {
                    "duration": 5e-5,
                    "models": {"rod": model, "striker": own},
                    "integrator": {"kind": integrator},
                    "step": {"courant": courant},
                },
                "probes": [{"body": "rod", "at": 0.15, "quantity": "force"}],
            }
        )
    )


@pytest.mark.parametrize("integrator", ["newmark", "midpoint", "contact_stabilised_newmark"])
def test_a_pulse_of_a_few_elements_disperses_with_a_warning(integrator: str) -> None:
    # The exact pulse is a rectangle of Z v/2 that only presses.
    run, force = struck(MESH, integrator, 0.5), AREA * np.sqrt(YOUNG * DENSITY) / 2.0
    signal = run.evaluate(np.linspace(0.0, run.duration, 5000), FORCE)
    assert signal.min() < -0.2 * force
    assert max(span.peak_force or 0.0 for span in run.contacts) > 1.1 * force
    assert codes(run) >= {"peak_oscillates", "probe_oscillates"}  # neither states the other


def test_the_same_pulse_at_courant_1_is_right_and_has_no_warning() -> None:
    run, force = struck(LUMPED, "central_difference", 1.0), AREA * np.sqrt(YOUNG * DENSITY) / 2.0
    signal = run.evaluate(np.linspace(0.0, run.duration, 5000), FORCE)
    assert signal.max() == pytest.approx(force, rel=1e-3)
    assert signal.min() > -1e-6 * force
    assert not codes(run) & {"peak_oscillates", "probe_oscillates"}


@pytest.mark.parametrize("quantity", ["force", "stress", "strain"])
def test_a_smooth_pulse_has_no_warning(quantity: str) -> None:
    # A ball on a spring: half a sine of 0.1 ms, fifty times as long as an element takes.
    case = il.Case(
        bodies={
            "ball": il.Mass(0.01, velocity=1.0),
            "rod": il.Rod(length=1.0, diameter=0.02, material="steel"),
        },
        contacts=[il.Contact("ball", "rod.left", {"kind": "penalty", "stiffness": 1e7})],
        probes=[il.Probe("rod", at=0.5, quantity=quantity)],
        solve={"duration": 3e-4, "model": {"kind": "finite_element", "elements": 100}, "step": {"courant": 0.5}},
    )
    assert not codes(il.run(case)) & {"peak_oscillates", "probe_oscillates"}
