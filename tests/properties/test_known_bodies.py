"""Bodies taken over from the scene before: every run has the bits of one in a session that ran nothing before it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import impactlab as il
from impactlab.errors import ImpactlabError
from impactlab.scene.recent import KeepsResults
from impactlab.simulate import stepped_run
from tests.solving import in_steps, mesh

CASE: dict[str, Any] = {
    "bodies": {
        "hammer": {"kind": "mass", "mass": 0.5, "velocity": 1.0},
        "rod": {"kind": "rod", "length": 0.3, "area": 3e-4, "material": {"young": 2.1e11, "density": 7800.0}},
        "stop": {
            "kind": "rod",
            "length": 0.2,
            "area": 2e-4,
            "material": {"young": 2.1e11, "density": 7800.0},
            "ends": {"right": "clamped"},
        },
    },
    "contacts": [
        {"between": ["hammer", "rod.left"], "law": {"kind": "penalty", "stiffness": 1e8}},
        {"between": ["rod.right", "stop.left"], "gap": 1e-6, "law": {"kind": "penalty", "stiffness": 1e8}},
    ],
    "solve": in_steps(1e-4, "newmark", mesh(6, "lumped"), dt=1e-6),
}
MESH = {"kind": "finite_element", "elements": 6, "mass": "lumped"}
CHANGES: tuple[tuple[str, Any], ...] = (
    ("bodies.hammer.mass", 0.6),
    ("bodies.hammer.velocity", 1.5),
    ("bodies.hammer.velocity", 0.0),
    ("bodies.rod.length", 0.31),
    ("bodies.rod.area", 4e-4),
    ("bodies.rod.material.young", 2.0e11),
    ("bodies.rod.material.density", 7700.0),
    ("bodies.rod.material.viscosity", 1e4),
    ("bodies.rod.velocity", 0.2),
    ("bodies.rod.displacement", "1e-6*cos(pi*x/0.3)"),
    ("bodies.rod.displacement", "2e-6*cos(pi*x/0.3)"),
    ("bodies.rod.damping", {"mass": 10.0}),
    ("bodies.rod.ends", {"right": {"mass": 0.01}}),
    ("bodies.stop.length", 0.21),
    ("bodies.stop.ends", {"right": {"spring": 1e8}}),
    ("bodies.stop.ends", {"right": {"dashpot": 1e3}}),
    ("bodies.stop.velocity", -0.1),
    ("contacts.0.between", ["hammer", "rod.at(0.1)"]),
    ("contacts.0.law", {"kind": "hertz", "stiffness": 1e10}),
    ("contacts.0.law", {"kind": "addition_deletion"}),
    ("contacts.0.law.stiffness", 2e8),
    ("contacts.0.gap", 1e-7),
    ("contacts.1.gap", 0.0),
    ("contacts.1.law", {"kind": "velocity_complementarity", "restitution": 0.5}),
    ("gravity", 9.81),
    ("probes", [{"body": "rod", "at": 0.1, "quantity": "strain"}]),
    ("probes", [{"body": "stop", "at": 0.1, "quantity": "velocity"}]),
    ("snapshots", [5e-5]),
    ("solve.duration", 1.2e-4),
    ("solve.records", 200),
    ("solve.step.dt", 0.9e-6),
    ("solve.step", {"courant": 0.7}),
    ("solve.events", "located"),
    ("solve.integrator", {"kind": "central_difference"}),
    ("solve.integrator", {"kind": "midpoint"}),
    ("solve.integrator", {"kind": "hht_alpha"}),
    ("solve.integrator", {"kind": "hht_alpha", "alpha": -0.2}),
    ("solve.integrator", {"kind": "exact_modal"}),
    ("solve.model.elements", 7),
    ("solve.model.mass", "consistent"),
    ("solve.model.mass", "redistributed"),
    ("solve.model", {"kind": "modal", "elements": 8, "modes": 5}),
    ("solve.model", {"kind": "modal", "elements": 8, "modes": 5, "basis": {"kind": "craig_bampton"}}),
    ("solve.model", {"kind": "modal", "elements": 8, "modes": 5, "basis": {"kind": "macneal"}}),
    ("solve.model", {"kind": "modal", "elements": 8, "modes": 5, "basis": {"kind": "ritz"}}),
    ("solve.model", {"kind": "modal", "modes": 6}),
    ("solve.model", {"kind": "continuous"}),
    ("solve.models", {"rod": {"kind": "modal", "elements": 8, "modes": 4, "basis": {"kind": "striker_attached"}}}),
    ("solve.models", {"stop": MESH | {"elements": 9}}),
)


def forget() -> None:
    """Begin as a new session does."""
    stepped_run.ready = KeepsResults(stepped_run.Prepared, lambda made: made.can_repeat)
    stepped_run.Prepared.bodies = stepped_run.Prepared.arrays = None


def bits(case: il.Case) -> tuple[Any, ...]:
    """Return all that a run has found, to the last bit."""
    try:
        history = il.run(case)
    except ImpactlabError as error:
        return type(error), error.text, error.path
    times = np.linspace(0.0, history.duration, 101)
    channels = [(name, history.evaluate(times, name).tobytes()) for name in history.channels()]
    return channels, history.events, history.contacts, history.energy_ends(), history.warnings


@pytest.mark.filterwarnings("ignore::impactlab.errors.RunWarning", "ignore::impactlab.errors.UnusualValue")
@settings(max_examples=60)
@given(st.lists(st.sampled_from(CHANGES), min_size=1, max_size=3), st.lists(st.sampled_from(CHANGES), max_size=2))
def test_a_run_after_another_has_the_bits_of_the_first_run_of_a_session(
    before: list[tuple[str, Any]], change: list[tuple[str, Any]]
) -> None:
    base = il.Case.from_dict(CASE)
    try:
        known = base.with_settings(before)
        sought = base.with_settings([*before, *change])
    except ImpactlabError:
        return
    forget()
    wanted = bits(sought)
    for first in (base, known):
        forget()
        bits(first)
        assert repr(bits(sought)) == repr(wanted)
