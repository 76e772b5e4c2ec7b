"""Each field of the compliant laws is refused beyond its limits: where, what was given, what is allowed."""

from __future__ import annotations

import pytest

import impactlab as il
from impactlab.errors import CaseError, ImpactlabError, PairingError

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
DAMPED = ["hunt_crossley", "lankarani_nikravesh", "flores"]


def refused(folder, law: str) -> ImpactlabError:
    path = folder / "ball.yaml"
    path.write_text(CASE.replace("LAW", law))
    with pytest.raises((CaseError, PairingError)) as caught:
        il.run(il.load_case(path))
    assert str(caught.value).startswith(f"{path}:8: ")
    return caught.value


@pytest.mark.parametrize("kind", ["hertz", *DAMPED])
@pytest.mark.parametrize(
    ("given", "text"),
    [
        ("exponent: 1.5", "stiffness: this key is missing"),
        ("stiffness: 0", "stiffness: 0 N/m^n is out of range. Allowed: a number in N/m^n above 0"),
        ("stiffness: -1e9", "stiffness: -1e+09 N/m^n is out of range. Allowed: a number in N/m^n above 0"),
        ("stiffness: .inf", ".inf is not a finite number"),
        ("stiffness: 1 GN/m", "stiffness: '1 GN/m' is a text; allowed: a plain number (in N/m^n, whose n is another"),
        ("stiffness: {relative: 1}", "stiffness: {relative: ...} is not allowed here. Allowed: a number in N/m^n"),
        ("stiffness: 1e9, exponent: 0.9", "exponent: 0.9 is out of range. Allowed: a number at least 1 and at most 10"),
        ("stiffness: 1e9, exponent: 11", "exponent: 11 is out of range. Allowed: a number at least 1 and at most 10"),
        ("stiffness: 1e9, damping: 1", "damping"),
    ],
)
def test_what_every_power_law_refuses(tmp_path, kind, given, text):
    message = str(refused(tmp_path, f"{{kind: {kind}, {given}}}"))
    assert text in message


@pytest.mark.parametrize("kind", DAMPED)
@pytest.mark.parametrize(
    ("given", "text"),
    [
        ("restitution: 0", "restitution: 0 is out of range. Allowed: a number above 0 and at most 1"),
        ("restitution: 1.1", "restitution: 1.1 is out of range. Allowed: a number above 0 and at most 1"),
        ("restitution: half", "restitution: 'half' is a text; allowed: a plain number (it has no unit)"),
        ("slowest_approach: 0", "slowest_approach: 0 m/s is out of range. Allowed: a number in m/s above 0"),
    ],
)
def test_what_the_damped_ones_refuse(tmp_path, kind, given, text):
    message = str(refused(tmp_path, f"{{kind: {kind}, stiffness: 1e9, {given}}}"))
    assert text in message


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ("stiffness: 0", "stiffness: 0 N/m is out of range. Allowed: a number in N/m above 0"),
        ("stiffness: 1e9, restitution: 0", "restitution: 0 is out of range. Allowed: a number above 0 and at most 1"),
        ("stiffness: 1e9, effective_mass: 0", "effective_mass: 0 kg is out of range. Allowed: a number in kg above 0"),
        ("restitution: 0.5", "stiffness is relative to a rod, and this contact has none"),
    ],
)
def test_what_khulief_shabana_refuses(tmp_path, given, text):
    message = str(refused(tmp_path, f"{{kind: khulief_shabana, {given}}}"))
    assert text in message


def test_a_speed_may_have_a_unit_and_an_undamped_law_has_no_restitution(tmp_path):
    path = tmp_path / "ball.yaml"
    path.write_text(CASE.replace("LAW", "{kind: flores, stiffness: 1e9, slowest_approach: 1 mm/s}"))
    assert il.load_case(path).scene().contacts[0].law.slowest_approach == 1e-3
    assert "restitution" in str(refused(tmp_path, "{kind: hertz, stiffness: 1e9, restitution: 0.5}"))


def test_an_explicit_step_is_refused_for_a_stiff_khulief_shabana_spring(tmp_path):
    path = tmp_path / "ball.yaml"
    given = CASE.replace("LAW", "{kind: khulief_shabana, stiffness: 1e15}").replace("newmark", "central_difference")
    path.write_text(given)
    with pytest.raises(CaseError, match="too stiff for an explicit step"):
        il.run(il.load_case(path))
