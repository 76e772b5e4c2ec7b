"""Fields of displacement at faces that a contact presses in beyond their coordinates: those of the channels."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import impactlab as il

TIMES = (2.0e-5, 5.05e-5, 1.0e-4)
PRESSED = (
    ({"kind": "modal", "elements": 60, "modes": 8, "basis": {"kind": "macneal"}}, "addition_deletion"),
    ({"kind": "modal", "modes": 8}, "dispersive_identification"),
    ({"kind": "finite_element", "elements": 60}, "addition_deletion"),
)


def snapshots(body: il.Beam | il.Rod, face: str, model: dict[str, Any], law: str, **solve: Any) -> il.History:
    case = il.Case(
        bodies={"b": body, "m": il.Mass(0.1, velocity=1.0)},
        contacts=[il.Contact("m", face, {"kind": law})],
        snapshots=list(TIMES),
        solve={
            "duration": 2e-4,
            "model": model,
            "integrator": {"kind": "newmark"},
            "step": {"dt": 1e-6},
            **solve,
        },
    )
    return il.run(case)


@pytest.mark.parametrize(("model", "law"), PRESSED)
def test_the_field_of_a_beam_holds_the_offset_of_its_face(model: dict[str, Any], law: str) -> None:
    section, ends = {"width": 0.02, "height": 0.02}, {"left": "pinned", "right": "pinned"}
    beam = il.Beam(length=1.0, section=section, material="steel", ends=ends)
    history = snapshots(beam, "b.at(0.3)", model, law)
    for t in TIMES:
        known = float(history.evaluate(t, "displacement:b@0.3"))
        field = history.field("b", t, "displacement")
        assert history.field("b", t, "displacement", [0.3]).values == pytest.approx(known, rel=1e-9)
        nodes = np.flatnonzero(np.abs(field.x - 0.3) < 1e-9)
        assert np.all(np.abs(field.values[nodes] - known) <= 1e-9 * abs(known))


@pytest.mark.parametrize("records", [6000, 100])
def test_the_field_of_a_rod_holds_the_offset_of_its_massless_face(records: int) -> None:
    rod = il.Rod(length=1.0, diameter=0.02, material="steel", ends={"right": "clamped"})
    model = {"kind": "finite_element", "elements": 60, "mass": "redistributed"}
    history = snapshots(rod, "b.left", model, "addition_deletion", records=records)
    for t in TIMES:
        known = float(history.evaluate(t, "displacement:b@0"))
        assert history.field("b", t, "displacement").values[0] == pytest.approx(known, rel=1e-12)
