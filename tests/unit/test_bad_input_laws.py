"""Refusals of the compliant laws alone; those from the options of any part stand in `test_bad_input_parts`."""

from __future__ import annotations

import pytest

import impactlab as il
from impactlab.casefile.edit import read_setting
from impactlab.errors import CaseError, ImpactlabError, PairingError
from impactlab.scene.method import laws_of
from tests.support import PAPER

CASE = """\
schema_version: 1
title: a ball on a wall
bodies:
  ball: {kind: mass, mass: 2.0, velocity: 1.0}
  wall: {kind: wall}
contacts:
  - between: [ball, wall]
    law: LAW
solve:
  duration: 1e-3
  integrator: {kind: newmark}
  step: {dt: 1e-6}
"""


def refused(folder, law: str) -> ImpactlabError:
    path = folder / "ball.yaml"
    path.write_text(CASE.replace("LAW", law))
    with pytest.raises((CaseError, PairingError)) as caught:
        il.run(il.load_case(path))
    assert str(caught.value).startswith(f"{path}:8: ")
    return caught.value


@pytest.mark.parametrize("kind", ["hertz", "hunt_crossley", "lankarani_nikravesh", "flores"])
def test_a_stiffness_with_a_unit_of_another_power_is_refused(tmp_path, kind):
    message = str(refused(tmp_path, f"{{kind: {kind}, stiffness: 1 GN/m}}"))
    assert "stiffness: '1 GN/m' has a unit of another dimension; allowed: a number in N/m^1.5" in message
    message = str(refused(tmp_path, f"{{kind: {kind}, exponent: 2, stiffness: 1 N/m^1.5}}"))
    assert "allowed: a number in N/m^2" in message


@pytest.mark.parametrize(
    ("given", "stiffness"),
    [
        ("stiffness: 2e10 N/m^1.5", 2e10),
        ("stiffness: 2 kN/mm^1.5", 2e3 * 1e3**1.5),
        ("stiffness: 3 kN/mm^2, exponent: 2", 3e9),
        ("stiffness: 3 kN/mm, exponent: 1", 3e6),
    ],
)
def test_a_stiffness_takes_the_unit_of_its_exponent(tmp_path, given, stiffness):
    path = tmp_path / "ball.yaml"
    path.write_text(CASE.replace("LAW", f"{{kind: hertz, {given}}}"))
    assert laws_of(*il.load_case(path).simulation())[0].stiffness == pytest.approx(stiffness, rel=1e-12)


@pytest.mark.parametrize("exponent", ["many", "true"])
def test_a_unit_beside_an_exponent_that_is_no_number_is_refused(tmp_path, exponent):
    message = str(refused(tmp_path, f"{{kind: hertz, stiffness: 1 GN/m, exponent: {exponent}}}"))
    assert "is not a number" in message or "is not allowed here" in message


def test_a_missing_stiffness_is_refused_with_a_way_to_get_it(tmp_path):
    message = str(refused(tmp_path, "{kind: hertz}"))
    assert "stiffness: this key is missing" in message
    assert "Add stiffness: K, force per indentation to the power n; of spheres and rounded ends" in message
    assert "{radius: 5 mm, material: steel}" in message


def test_a_radius_in_place_of_a_stiffness_is_refused_with_a_way_to_get_it(tmp_path):
    message = str(refused(tmp_path, "{kind: hertz, radius: 5 mm}"))
    assert "the key 'radius' is not known here" in message
    assert "{radius: 5 mm, material: steel}" in message


def test_other_sizes_of_spheres_beside_a_stiffness_are_refused_with_their_block(tmp_path):
    message = str(refused(tmp_path, "{kind: hertz, radius: 5 mm, material: glass}"))
    assert "law.radius: the key 'radius' is not known here. It stands inside 'stiffness'" in message
    assert "Write stiffness: {radius: 5 mm, material: glass}." in message


def test_a_relative_stiffness_needs_a_rod(tmp_path):
    message = str(refused(tmp_path, "{kind: khulief_shabana, restitution: 0.5}"))
    assert "stiffness is relative to a rod, and this contact has none" in message


def test_a_speed_may_have_a_unit_and_an_undamped_law_has_no_restitution(tmp_path):
    path = tmp_path / "ball.yaml"
    path.write_text(CASE.replace("LAW", "{kind: flores, stiffness: 1e9, slowest_approach: 1 mm/s}"))
    assert laws_of(*il.load_case(path).simulation())[0].slowest_approach == 1e-3
    assert "restitution" in str(refused(tmp_path, "{kind: hertz, stiffness: 1e9, restitution: 0.5}"))


def test_an_explicit_step_is_refused_for_a_stiff_khulief_shabana_spring(tmp_path):
    path = tmp_path / "ball.yaml"
    given = CASE.replace("LAW", "{kind: khulief_shabana, stiffness: 1e15}").replace("newmark", "central_difference")
    path.write_text(given)
    with pytest.raises(CaseError, match="too stiff for an explicit step"):
        il.run(il.load_case(path))


@pytest.mark.parametrize(("given", "taken"), [("0", "0"), ("-1", "-1"), ("1.0", "1"), ('"-1"', "-1")])
def test_a_word_that_is_a_whole_number_may_be_given_as_one(given: str, taken: str) -> None:
    """'0 is not allowed here. Allowed: 1, 0, -1'."""
    case = il.load_case(PAPER).with_settings([read_setting(f"contacts.0.law={{kind: nitsche, theta: {given}}}")])
    assert laws_of(*case.simulation())[0].theta == taken


@pytest.mark.parametrize("given", ["0.5", "2", "true", "1.0000001"])
def test_another_number_is_no_such_word(given: str) -> None:
    with pytest.raises(CaseError, match="Allowed: 1, 0, -1"):
        il.load_case(PAPER).with_settings([read_setting(f"contacts.0.law={{kind: nitsche, theta: {given}}}")])


@pytest.mark.parametrize(("key", "value"), [("gap", 1e-6), ("overlap", "allowed"), ("pieces", 3)])
def test_a_key_of_the_contact_given_to_its_law_is_named_as_such(key: str, value: object) -> None:
    law = {"kind": "hertz", "stiffness": 1e9, key: value}
    with pytest.raises(
        CaseError, match=rf"'{key}' is not known here\. It is a key of the contact: write it beside 'law'"
    ):
        il.Case(
            bodies={"ball": il.Mass(1.0, velocity=1.0), "wall": il.Wall()},
            contacts=[il.Contact("ball", "wall", law)],
            solve={"duration": 1e-3, "integrator": {"kind": "central_difference"}, "step": {"dt": 1e-6}},
        )


def test_nitsche_refuses_an_inner_point_of_a_rod() -> None:
    """Its force is a jump of the internal force; with the mean of the two a scene and its mirror image differed."""
    between, law = ["hammer", "rod.at(0.1)"], {"kind": "nitsche"}
    case = il.load_case("axial_impact").with_settings({"contacts.0.between": between, "contacts.0.law": law})
    with pytest.raises(PairingError, match=r"goes on beyond the inner point rod\.at\(0\.1\)") as caught:
        il.run(case.with_("solve.model", {"kind": "finite_element", "elements": 30}))
    assert "addition_deletion" in caught.value.remedy
