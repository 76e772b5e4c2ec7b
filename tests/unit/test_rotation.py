"""Steady rotation in a case: its keys, the steady state, rate 0, and every refusal with its message."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import eigh

import impactlab as il
from impactlab.errors import CaseError, ImpactlabError
from impactlab.models.mesh.bars import Mesh
from impactlab.models.mesh.beams import BeamMesh
from impactlab.numerics.banded import full, solve
from impactlab.report.summary import rotation
from impactlab.scene.bodies import Beam, BeamSegment, End, Rod, Rotation, Segment

ROD = """\
schema_version: 1
bodies:
  rod:
    kind: rod
    length: 0.3
    area: 9.0e-4
    material: {young: 2.1e11, density: 7900}
    ends: {left: clamped}
    rotation: {rate: 100.0, axis_at: 0.0}
  hammer: {kind: mass, mass: 2.133, velocity: -1.0, rotation: {rate: 100.0}}
  stop: {kind: wall}
contacts:
  - {between: [rod.right, hammer], gap: 1.0e-6, law: {kind: penalty, stiffness: 1.0e9}}
  - {between: [hammer, stop], gap: 1.0, law: {kind: penalty, stiffness: 1.0e9}}
solve:
  duration: {round_trips: 1}
  model: {kind: finite_element, elements: 40}
  integrator: {kind: newmark}
"""
BEAM = """\
schema_version: 1
bodies:
  beam:
    kind: beam
    length: 1.0
    section: {width: 0.02, height: 0.005}
    material: {young: 2.1e11, density: 7850}
    ends: {left: clamped}
    rotation: {rate: 60.0, axis_at: 0.0, plane: chord}
  sphere: {kind: mass, mass: 0.2, velocity: 1.0, rotation: {rate: 60.0}}
contacts:
  - {between: [sphere, beam.at(0.75)], law: {kind: hertz, stiffness: 1.0e8}}
solve:
  duration: 1.0e-3
  model: {kind: modal, elements: 20, modes: 10}
  integrator: {kind: exact_modal}
  step: {dt: 1.0e-6}
"""
C = math.sqrt(2.1e11 / 7900)
STEEL = Segment(0.3, 9e-4, 2.1e11, 7900.0)


@pytest.fixture(autouse=True)
def _beside_the_case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def case(text: str, *changes: tuple[str, str]) -> il.Case:
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    Path("turning.yaml").write_text(text, encoding="utf-8")
    return il.load_case("turning.yaml")


# --- the keys


def test_a_rate_has_units_and_hertz_are_refused() -> None:
    turning = case(ROD, ("rate: 100.0", "rate: 600 rpm")).scene()
    assert turning.bodies["rod"].rotation == Rotation(pytest.approx(20.0 * math.pi), 0.0)
    with pytest.raises(CaseError, match=r"'16 Hz' may count turns or radians.*'600 rpm'"):
        case(ROD, ("rate: 100.0", "rate: 16 Hz"))


def test_a_mass_takes_its_distance_from_the_face_that_it_meets() -> None:
    w = 100.0 * 0.3 / C
    scene = case(ROD).scene()
    assert -scene.bodies["hammer"].rotation.axis_at == pytest.approx(0.3 * math.tan(w) / w + 1e-6, rel=1e-14)
    beam = case(BEAM, ("beam.at(0.75)]", "beam.at(0.75)], gap: 0.01")).scene()
    assert beam.bodies["sphere"].rotation == Rotation(60.0, 0.01, "chord")  # below the beam, on the line to the axis
    flap = case(BEAM, ("chord", "flap")).scene()
    assert flap.bodies["sphere"].rotation.plane == "flap"
    assert flap.bodies["sphere"].softening == 0.0


def test_a_mass_turns_with_the_body_that_it_meets() -> None:
    given, left_out = case(ROD).scene(), case(ROD, ("-1.0, rotation: {rate: 100.0}", "-1.0, rotation: {}")).scene()
    assert left_out.bodies["hammer"] == given.bodies["hammer"]
    chain = ("stop: {kind: wall}", "stop: {kind: mass, mass: 1.0, rotation: {}}")
    bodies = case(ROD, ("-1.0, rotation: {rate: 100.0}", "-1.0, rotation: {}"), chain).scene().bodies
    assert bodies["stop"].rotation.rate == 100.0


def test_masses_that_state_their_place_come_first() -> None:
    """A stack of two masses without rod: the second takes its distance from the first."""
    stated = "stop: {kind: wall}\n  first: {kind: mass, mass: 1.0, rotation: {rate: 5.0, axis_at: -0.2}}"
    text = ROD.replace("stop: {kind: wall}", stated + "\n  second: {kind: mass, mass: 1.0, rotation: {}}")
    text = text.replace(
        "solve:", "  - {between: [first, second], gap: 0.1, law: {kind: penalty, stiffness: 1.0e9}}\nsolve:"
    )
    bodies = case(text).scene().bodies
    assert bodies["second"].rotation == Rotation(5.0, pytest.approx(-0.3))


def test_distances_go_from_mass_to_mass() -> None:
    text = ROD.replace("stop: {kind: wall}", "stop: {kind: mass, mass: 1.0, rotation: {rate: 100.0}}")
    bodies = case(text).scene().bodies
    assert bodies["stop"].rotation.axis_at == pytest.approx(bodies["hammer"].rotation.axis_at - 1.0)


def test_python_and_check_state_the_rotation() -> None:
    data = case(ROD).resolved()
    assert data["bodies"]["rod"]["rotation"] == {"rate": 100.0, "axis_at": 0.0}
    assert data["derived"]["rotation"]["rod"]["stretch"] == pytest.approx(3.385760e-6, rel=1e-6)
    given = il.Mass(2.133, velocity=-1.0, rotation={"rate": 100.0})
    assert given == {"kind": "mass", "mass": 2.133, "velocity": -1.0, "rotation": {"rate": 100.0}}
    ran = subprocess.run(
        [sys.executable, "-m", "impactlab", "check", "turning.yaml"], capture_output=True, text=True, check=True
    )
    for text in ("tip_radius: 0.3000033857", "stretch: 3.3857601", "root_stress: 3555050.15"):
        assert text in ran.stdout, ran.stdout


# --- the steady state


@pytest.mark.parametrize(("rate", "radius"), [(60.0, 0.3000012188630853), (100.0, 0.3000033857601386)])
def test_a_rod_clamped_at_the_axis_stretches_by_the_closed_form(rate: float, radius: float) -> None:
    """L tan(w)/w; the root carries E (r' - 1) = E (1/cos w - 1)."""
    w = rate * 0.3 / C
    state = Rod("rod", (STEEL,), End("clamped"), End("free"), rotation=Rotation(rate)).steady
    assert state.radii == pytest.approx((0.0, radius), rel=1e-14)
    assert state.radii[1] == pytest.approx(0.3 * math.tan(w) / w, rel=1e-14)
    assert state.root_stress == pytest.approx(2.1e11 * (1.0 / math.cos(w) - 1.0), rel=1e-6)


PIECES = (Segment(0.1, 9e-4, 2.1e11, 7900.0), Segment(0.2, 4e-4, 7e10, 2700.0))


@pytest.mark.parametrize(
    ("left", "right"),
    [
        (End("clamped"), End("free")),
        (End("spring", 1e8), End("mass", 1.0)),
        (End("mass", 2.0), End("clamped")),
        (End("clamped"), End("spring", 1e7)),
        (End("clamped"), End("clamped")),
    ],
)
def test_the_steady_state_of_rods_solves_its_equation(left: End, right: End) -> None:
    """Against a fine mesh under its own centrifugal force, and against the mirrored rod."""
    rate, axis = 2000.0, -0.2
    rod = Rod("rod", PIECES, left, right, rotation=Rotation(rate, axis))
    mesh = Mesh(rod, 12, "lumped", 0.0, 8)
    moved = solve(mesh.stiffness, rate**2 * mesh.mass[0] * mesh.coordinates(lambda x: x - axis))
    x = 0.17
    assert_allclose(x - axis + mesh.row(x, "displacement") @ moved, rod.steady_place(x), rtol=1e-6)
    turned = Rod("rod", PIECES[::-1], right, left, rotation=Rotation(rate, rod.length - axis))
    assert_allclose(turned.steady.radii, [-rod.steady.radii[1], -rod.steady.radii[0]], rtol=1e-12)
    assert turned.steady.root_stress == pytest.approx(rod.steady.root_stress, rel=1e-6)


@pytest.mark.parametrize("pieces", [(STEEL,), PIECES, PIECES[::-1]])
@pytest.mark.parametrize(
    "ends", [(End("clamped"), End("free")), (End("spring", 1e8), End("mass", 1.0)), (End("clamped"), End("clamped"))]
)
def test_the_limit_rate_is_the_lowest_frequency_at_rest(pieces: tuple[Segment, ...], ends: tuple[End, End]) -> None:
    rod = Rod("rod", pieces, *ends)
    mesh = Mesh(rod, 24, "consistent", 0.0, 6)
    lowest = math.sqrt(eigh(full(mesh.stiffness), full(mesh.mass), eigvals_only=True)[0])
    assert rod.limit_rate == pytest.approx(lowest, rel=1e-9)
    assert Rod("rod", pieces, End("free"), End("mass", 1.0)).limit_rate == 0.0


@pytest.mark.parametrize("length", [0.1, 0.3, 0.5, 0.7, 1.1, 1.3])
@pytest.mark.parametrize("held", [End("clamped"), End("spring", 1e30)])
def test_a_uniform_rod_held_at_both_ends_has_its_limit_at_half_a_wave(length: float, held: End) -> None:
    piece = Segment(length, 4e-4, 2e9, 1500.0)
    limit = math.pi * math.sqrt(2e9 / 1500.0) / length
    assert Rod("rod", (piece,), held, held).limit_rate == pytest.approx(limit, rel=1e-12)


@pytest.mark.parametrize("stiffness", [1e-12, 1e-20, 1e-100])
def test_a_rod_on_the_weakest_springs_has_its_limit_as_a_mass(stiffness: float) -> None:
    piece = Segment(0.5, 4e-4, 2e9, 1500.0)
    rod = Rod("rod", (piece,), End("spring", stiffness), End("mass", 0.7))
    assert rod.limit_rate == pytest.approx(math.sqrt(stiffness / (0.3 + 0.7)), rel=1e-12)


def test_the_tension_of_a_beam_is_its_centrifugal_force() -> None:
    """rho A Omega^2 (L^2 - x^2)/2 with the axis at the root, and m Omega^2 L of a mass at the tip."""
    piece = BeamSegment(1.0, 1e-4, 2.1e11, 7850.0, inertia=2.0833e-10)
    beam = Beam("beam", (piece,), End("clamped"), End("mass", 0.3), rotation=Rotation(60.0, 0.0, "flap"))
    x = np.linspace(0.0, 1.0, 7)
    force = 60.0**2 * (0.785 * 0.5 * (1.0 - x**2) + 0.3)
    assert_allclose(beam.steady_beam(beam.rotation).tension(x), force, rtol=1e-13)
    halves = (
        BeamSegment(0.4, 1e-4, 2.1e11, 7850.0, inertia=1e-10),
        BeamSegment(0.6, 1e-4, 2.1e11, 7850.0, inertia=2e-10),
    )
    turned = Beam("beam", halves, End("mass", 0.3), End("clamped"), rotation=Rotation(60.0, 1.0, "flap"))
    assert_allclose(turned.steady_beam(turned.rotation).tension(1.0 - x), force, rtol=1e-13)
    assert turned.steady.root_stress == pytest.approx(force[0] / 1e-4)


def test_a_beam_held_at_both_ends_keeps_its_length() -> None:
    pieces = (
        BeamSegment(0.4, 1e-4, 2.1e11, 7850.0, inertia=1e-10),
        BeamSegment(0.6, 3e-4, 2.1e11, 7850.0, inertia=2e-10),
    )
    beam = Beam("beam", pieces, End("clamped"), End("pinned"), rotation=Rotation(60.0, -0.5, "flap"))
    assert beam.steady.stretch == pytest.approx(0.0, abs=1e-18)
    force = beam.steady_beam(beam.rotation).tension(np.array([0.0, 1.0]))
    moment = 7850.0 * 1e-4 * (0.4 * 0.7 + 1.8 * 1.2)  # kg m about the axis
    assert force[0] - force[1] == pytest.approx(60.0**2 * moment)


# --- rate 0


@pytest.mark.parametrize(("text", "rate"), [(ROD, "100.0"), (BEAM, "60.0")])
def test_rate_0_gives_the_bits_of_the_case_without_rotation(text: str, rate: str) -> None:
    still = il.run(case(text, (f"rate: {rate}", "rate: 0.0")))
    bare = re.sub(r",? *rotation: \{[^}]*\}", "", text)
    assert "rate" not in bare
    plain = il.run(case(bare))
    assert still.events == plain.events
    t = np.linspace(0.0, plain.duration, 301)
    for channel in plain.channels():
        assert_array_equal(still.evaluate(t, channel), plain.evaluate(t, channel))


# --- what is refused

OTHER = "stop: {kind: wall}\n  other: {kind: mass, mass: 1.0, rotation: {rate: 5.0}}"


@pytest.mark.parametrize(
    ("text", "changes", "path", "words"),
    [
        (ROD, [("-1.0, rotation: {rate: 100.0}", "-1.0, rotation: {rate: 90.0}")], "contacts.0.between",
         ["'rod' at 100 rad/s and 'hammer' at 90 rad/s", "one rate for all bodies that meet"]),
        (ROD, [(", rotation: {rate: 100.0}}", "}")], "contacts.0.between", ["'hammer' at 0 rad/s"]),
        (ROD, [("-1.0, rotation: {rate: 100.0}", "-1.0, rotation: {rate: 100.0, axis_at: -0.3}")],
         "bodies.hammer.rotation.axis_at",
         ["'hammer' is at 0.3 m from the axis by its axis_at",
          "gap of 1e-06 m it is at 0.300004386 m", "or give -0.300004386"]),
        (ROD, [("kind: wall}", "kind: wall, rotation: {rate: 100.0}}")], "bodies.stop",
         ["a wall has no rotation of its own"]),
        (ROD, [("axis_at: 0.0}", "axis_at: 0.0, plane: chord}")], "bodies.rod.rotation.plane",
         ["`plane` applies only to beams"]),
        (ROD, [("rate: 100.0", "rate: 27000.0")], "bodies.rod.rotation.rate",
         ["turns at 27000 rad/s", "below 26995.7 rad/s", "Give a lower rate"]),
        (ROD, [("ends: {left: clamped}", "ends: {left: free}")], "bodies.rod.ends",
         ["nothing holds it along its axis", "Only masses may be free", "clamped or on a spring"]),
        (ROD, [("ends: {left: clamped}", "ends: {left: {mass: 2.0}}")], "bodies.rod.ends", ["nothing holds it"]),
        (ROD, [("ends: {left: clamped}", "ends: {left: infinite}")], "bodies.rod.ends", ["has an infinite end"]),
        (ROD, [("rate: 100.0, axis_at: 0.0", "axis_at: 0.0")], "bodies.rod.rotation.rate",
         ["this key is missing", "'600 rpm'"]),
        (ROD, [("[hammer, stop]", "[other, stop]"), ("stop: {kind: wall}", OTHER.replace("rate: 5.0", ""))],
         "bodies.other.rotation.rate", ["'other' meets no body whose rate is known"]),
        (ROD, [(", axis_at: 0.0}", "}")], "bodies.rod.rotation.axis_at", ["this key is missing", "0 at its left end"]),
        (ROD, [("solve:", "gravity: 9.81\nsolve:")], "gravity",
         ["gravity acts along the motion of 'rod'", "plane of rotation", "Leave gravity out."]),
        (ROD, [("[hammer, stop]", "[other, stop]"), ("stop: {kind: wall}", OTHER)],
         "bodies.other.rotation.axis_at", ["'other' meets no body whose distance from the axis is known"]),
        (ROD, [("{kind: finite_element, elements: 40}", "{kind: continuous}"), ("penalty", "hertz")],
         "solve.models.rod", ["model 'continuous' describes bodies that do not turn", "turns at 100 rad/s"]),
        (BEAM, [(", plane: chord}", "}")], "bodies.beam.rotation.plane", ["this key is missing", "chord", "flap"]),
        (BEAM, [("1.0, rotation: {rate: 60.0}", "1.0, rotation: {rate: 60.0, plane: flap}")], "contacts.0.between",
         ["'beam' moves in the plane of rotation, and 'sphere' across it"]),
        (BEAM, [("axis_at: 0.0, plane: chord", "axis_at: 2.0, plane: flap")], "bodies.beam.rotation",
         ["at 60 rad/s 'beam' buckles under its centrifugal force"]),
        (BEAM, [("ends: {left: clamped}", "ends: {left: pinned}")], "bodies.beam.rotation",
         ["'beam' buckles", "or swings about its support"]),
        (BEAM, [("ends: {left: clamped}", "ends: {left: {spring: 1.0e6, rotational: 1.0e6}}")], "bodies.beam.ends",
         ["nothing holds it along its axis", "clamped or pinned"]),
        (BEAM, [("elements: 20, modes: 10", "modes: 10")], "solve.model",
         ["the modes of a beam that turns have no closed form", "'beam' turns at 60 rad/s"]),
        (BEAM, [("{kind: modal, elements: 20, modes: 10}", "{kind: continuous}")], "solve.models.beam",
         ["model 'continuous' describes bodies that do not turn"]),
    ],
)  # fmt: skip
def test_refused(text: str, changes: list[tuple[str, str]], path: str, words: list[str]) -> None:
    with pytest.raises(ImpactlabError) as caught:
        il.run(case(text, *changes))
    assert caught.value.path == path, caught.value
    for word in words:
        assert word in str(caught.value), str(caught.value)


def test_hard_contact_on_a_continuous_rod_that_turns_is_refused_by_name() -> None:
    hard = [("{kind: penalty, stiffness: 1.0e9}", "{kind: addition_deletion}")]
    with pytest.raises(ImpactlabError, match="'rod' turns at 100 rad/s, which disperses its waves"):
        il.run(case(ROD, *hard, ("{kind: finite_element, elements: 40}", "{kind: continuous}")))


def test_gravity_along_the_axis_acts() -> None:
    """Across the plane of rotation a weight is a constant load, as at rest."""
    weight = ("velocity: 1.0", "velocity: 0.0"), ("0.75)]", "0.75)], gap: 0.01"), ("solve:", "gravity: -9.81\nsolve:")
    history = il.run(case(BEAM, ("chord", "flap"), *weight))
    assert history.evaluate([1e-3], "velocity:sphere")[0] == pytest.approx(-9.81e-3, rel=1e-12)


def test_a_run_states_that_momentum_is_not_checked() -> None:
    found = rotation(il.run(case(ROD)).scene)
    assert found["hammer"]["momentum_unchecked"] is True
    assert found["rod"]["tip_radius"] == pytest.approx(0.3000033857601)
    flap = rotation(il.run(case(BEAM, ("chord", "flap"))).scene)
    assert flap["sphere"]["momentum_unchecked"] is False


def test_the_mesh_of_a_buckled_beam_is_refused_without_a_case() -> None:
    piece = BeamSegment(1.0, 1e-4, 2.1e11, 7850.0, inertia=2.0833e-10)
    inwards = Beam("beam", (piece,), End("clamped"), End("free"), rotation=Rotation(60.0, 2.0, "flap"))
    with pytest.raises(CaseError, match="buckles"):
        BeamMesh(inwards, 20, "consistent", 0.0)
    slow = Beam("beam", (piece,), End("clamped"), End("free"), rotation=Rotation(6.0, 1.0, "flap"))
    assert BeamMesh(slow, 20, "consistent", 0.0).is_held
