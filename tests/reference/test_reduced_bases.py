"""Reduced bases on the paper's case with events located: what few coordinates can give."""

from __future__ import annotations

from pathlib import Path

import pytest

import impactlab as il

CASE = Path(__file__).parents[2] / "cases" / "axial_impact.yaml"
MESH = {"kind": "modal", "elements": 40, "order": 8}  # 320 coordinates, frequencies of the modes kept exact to 1e-9


def summary_of(**model):
    case = il.load_case(CASE).with_("contacts.0.law", kind="addition_deletion")
    case = case.with_("solve.model", {**MESH, **model}).with_("solve.integrator", kind="exact_modal")
    case = case.with_("solve.events", "located").with_("solve.step", points_per_period=200)
    return il.compare(case, methods=["base"]).rows[0].summary


# Errors of the force, the face and the mass found by an independent program with exact event times.
KNOWN = {10: (0.209, 5.7e-3, 8.6e-4), 40: (0.102, 6.9e-4, 2.0e-5)}


@pytest.mark.parametrize("modes", KNOWN)
def test_craig_bampton_reaches_what_its_coordinates_can_give(modes):
    summary = summary_of(basis="craig_bampton", modes=modes)
    errors = summary["errors"]
    found = [errors[key] for key in ("force", "face_displacement", "mass_displacement")]
    # Two digits were kept of the numbers: a force held over 1/200 of the shortest period changes them by less than 6 %.
    assert found == pytest.approx(KNOWN[modes], rel=0.06)
    # The second contact, at 2.1246 to 2.1628 T, is there.
    trip = summary["round_trip"]
    assert any(abs(contact["start"] / trip - 2.1246) < 5e-3 for contact in summary["contacts"])
    assert errors["events_missed"] == 0
    assert summary["energy"]["largest_gain"] < 1e-11


def test_few_coordinates_that_keep_the_contact_do_better_than_as_many_eigenvectors():
    kept, free = (summary_of(basis=basis, modes=10)["errors"] for basis in ("craig_bampton", "eigenvectors"))
    assert kept["face_displacement"] < 0.2 * free["face_displacement"]
    assert kept["mass_displacement"] < 0.2 * free["mass_displacement"]
