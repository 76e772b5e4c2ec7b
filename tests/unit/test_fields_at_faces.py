"""Fields of displacement at faces that a contact presses in beyond their coordinates: those of the channels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.simulate import channels
from impactlab.types import Quantity
from tests.solving import run_case

TIMES = (2.0e-5, 5.05e-5, 1.0e-4)
PRESSED = (
    ({"kind": "modal", "elements": 60, "modes": 8, "basis": {"kind": "macneal"}}, "addition_deletion"),
    ({"kind": "modal", "modes": 8}, "dispersive_identification"),
    ({"kind": "finite_element", "elements": 60}, "addition_deletion"),
)


def snapshots(body: il.Beam | il.Rod, face: str, model: dict[str, Any], law: str, **solve: Any) -> il.History:
    return run_case(
        bodies={"b": body, "m": il.Mass(0.1, velocity=1.0)},
        contacts=[il.Contact("m", face, {"kind": law})],
        snapshots=list(TIMES),
        solve={"duration": 2e-4, "model": model, "integrator": {"kind": "newmark"}, "step": {"dt": 1e-6}, **solve},
    )


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


@pytest.mark.parametrize("quantity", ["displacement", "velocity", "stress"])
def test_fields_of_a_mesh_at_many_times_are_those_of_each_time(quantity: Quantity) -> None:
    """The rod is viscous, so that its stress follows from strains and their rates."""
    rod = il.Rod(length=1.0, diameter=0.02, material={"young": 2e11, "density": 7850.0, "viscosity": 1e6})
    model = {"kind": "finite_element", "elements": 60, "mass": "redistributed"}
    history = snapshots(rod, "b.left", model, "addition_deletion")
    for x in (None, [0.0, 0.37, 1.0]):
        found = history.fields_at("b", TIMES[::-1], quantity, x)
        each = [history.field("b", t, quantity, x).values for t in TIMES[::-1]]
        np.testing.assert_array_equal(found.values, each)
        assert np.ptp(found.values) > 0.0
    with pytest.raises(il.ImpactlabError, match=r"no snapshot at t = 3e-05 s; snapshots: 2e-05, 5\.05e-05, 0\.0001"):
        history.fields_at("b", [2e-5, 3e-5, 4e-5], quantity)


def test_places_of_a_field_that_are_changed_leave_the_next_one_as_it_is() -> None:
    """The places of a grid are kept by the run, and those of a field are the reader's own: here in millimetres."""
    rod = il.Rod(length=1.0, diameter=0.02, material={"young": 2e11, "density": 7850.0, "viscosity": 1e6})
    history = snapshots(rod, "b.left", {"kind": "finite_element", "elements": 60}, "addition_deletion")
    for x in (None, np.linspace(0.0, 1.0, 7)):
        first = history.field("b", TIMES[1], "stress", x)
        wanted = first.x.copy(), first.values.copy()
        first.x[:] *= 1e3
        again = history.field("b", TIMES[1], "stress", x)
        np.testing.assert_array_equal(again.x, wanted[0])
        np.testing.assert_array_equal(again.values, wanted[1])


def test_rows_of_places_given_again_are_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader of many instants gives the same places each time; others and other quantities have rows of their own."""
    rod = il.Rod(length=1.0, diameter=0.02, material={"young": 2e11, "density": 7850.0, "viscosity": 1e6})

    def run() -> il.History:
        return snapshots(rod, "b.left", {"kind": "finite_element", "elements": 60}, "addition_deletion")

    history, made, rows_of = run(), list[int](), channels.rows_of

    def counted(dense: Sequence[Any]) -> channels.Rows:
        made.append(len(dense))
        return rows_of(dense)

    monkeypatch.setattr(channels, "rows_of", counted)
    places, others = np.linspace(0.0, 1.0, 7), np.linspace(0.1, 1.0, 5)
    for x in (places, others, places):
        for quantity in ("stress", "velocity"):
            alone = run().field("b", TIMES[1], quantity, x).values  # of a run that has read nothing before
            np.testing.assert_array_equal(history.field("b", TIMES[1], quantity, x).values, alone)
    made.clear()
    for t in TIMES:
        history.field("b", t, "stress", places)
        history.field("b", t, "velocity", places.tolist())
    assert not made
