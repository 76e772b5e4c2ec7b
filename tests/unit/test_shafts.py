"""Shafts: torsion against closed forms, and against the rod that a contact at the lever arm meets."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import impactlab as il
from impactlab.errors import ImpactlabError
from impactlab.models.continuous import Continuous
from impactlab.models.modal import Modal
from impactlab.scene.bodies import End, Rod, Shaft, shaft_end, shaft_segment
from impactlab.simulate.planning.building import build_body

SHEAR, DENSITY, DIAMETER, LENGTH, ARM = 8.0e10, 7850.0, 0.04, 0.5, 0.25
POLAR = math.pi * DIAMETER**4 / 32.0
SPEED = math.sqrt(SHEAR / DENSITY)
IMPEDANCE = math.sqrt(SHEAR * POLAR * DENSITY * POLAR)  # N m s/rad

SHAFT = """
schema_version: 1
bodies:
  hammer: {kind: mass, mass: 0.02, velocity: 1.0}
  bar: {kind: BAR, ends: {left: LEFT, right: RIGHT}}
contacts:
  - {between: [hammer, bar.left], ARM law: LAW}
solve:
  duration: {round_trips: 2.3}
  model: MODEL
  integrator: {kind: newmark}
probes: [PROBES]
snapshots: [1.0e-4]
"""
OF_SHAFT = "shaft, length: 0.5, section: {diameter: 0.04}, material: {shear_modulus: 8.0e10, density: 7850}"
MODELS = ("continuous", "modal, elements: 40, modes: 20", "modal, modes: 20", "finite_element, elements: 40")
LAWS = ("wave_identification", "penalty, stiffness: 1.0e6", "hertz, stiffness: 1.0e9")


def case_of(path: Path, **changes: str) -> il.Case:
    text = SHAFT
    given = {
        "BAR": OF_SHAFT,
        "LEFT": "free",
        "RIGHT": "clamped",
        "ARM": "lever_arm: 0.25,",
        "LAW": "{kind: hertz, stiffness: 1.0e9}",
    }
    given |= {"MODEL": "{kind: modal, elements: 40, modes: 20}", "PROBES": "{body: bar, at: 0.5, quantity: torque}"}
    for word, value in {**given, **changes}.items():
        text = text.replace(word, value)
    (path / "shaft.yaml").write_text(text, encoding="utf-8")
    return il.load_case(path / "shaft.yaml")


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("law", LAWS)
def test_a_contact_meets_the_rod_at_the_lever_arm(tmp_path: Path, model: str, law: str) -> None:
    """E = G, E A = G J/r2, rho A = rho I_p/r2: the same forces, and twist, torque by r, to rounding."""
    probes = ("displacement", "force", "velocity")
    reduced = f"rod, length: 0.5, area: {POLAR / ARM**2!r}, material: {{young: 8.0e10, density: 7850}}"
    same = {"MODEL": f"{{kind: {model}}}", "LAW": f"{{kind: {law}}}"}
    at_end = "0.0" if model == "continuous" and "hertz" in law else "0.5"
    asked = probes[::2] if at_end == "0.0" else probes
    own = {"displacement": "twist", "force": "torque", "velocity": "twist_rate"}
    row = "{{body: bar, at: {}, quantity: {}}}"
    shaft = il.run(case_of(tmp_path, **same, PROBES=", ".join(row.format(at_end, own[each]) for each in asked)))
    rod = il.run(
        case_of(tmp_path, **same, BAR=reduced, ARM="", PROBES=", ".join(row.format(at_end, each) for each in asked))
    )
    t = np.linspace(0.0, rod.duration, 300)
    for channel in ("force:hammer|bar.left", "velocity:hammer", "energy:bar"):
        expected = rod.evaluate(t, channel)
        assert np.allclose(shaft.evaluate(t, channel), expected, rtol=0.0, atol=1e-9 * np.max(np.abs(expected)))
    for each in asked:
        expected = rod.evaluate(t, f"{each}:bar@{float(at_end):g}") * (ARM if each == "force" else 1.0 / ARM)
        found = shaft.evaluate(t, f"{own[each]}:bar@{float(at_end):g}")
        assert np.allclose(found, expected, rtol=0.0, atol=1e-9 * (np.max(np.abs(expected)) or 1.0)), each


def shaft(right: str = "clamped", arm: float = ARM) -> Shaft:
    piece = shaft_segment(LENGTH, SHEAR, DENSITY, POLAR, POLAR, arm)
    return Shaft("shaft", (piece,), End("free"), End(right), lever_arm=arm)  # type: ignore[arg-type]


@pytest.mark.parametrize("arm", [0.01, 1.0, 3.0])
def test_the_natural_frequencies_of_a_clamped_shaft(arm: float) -> None:
    """(2 n - 1) pi c/(2 L): analytic modes to rounding, two-node elements with an error of order 2."""
    exact = (2.0 * np.arange(1, 4) - 1.0) * math.pi * SPEED / (2.0 * LENGTH)
    analytic = Modal(None, 8).build(shaft(arm=arm), 0.0).operators()
    assert np.sqrt(analytic.stiffness[0][:3]) == pytest.approx(exact, rel=1e-12)
    errors = []
    for elements in (20, 40):
        found = np.sort(np.sqrt(Modal(elements).build(shaft(arm=arm), 0.0).operators().stiffness[0]))[:3]
        errors.append(np.max(np.abs(found / exact - 1.0)))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("model", ["continuous", "finite_element, elements: 200"])
def test_angular_momentum_and_energy_in_the_shafts_own_quantities(tmp_path: Path, model: str) -> None:
    """Of rho I_p theta_t and T2/(G J) along the shaft; the contact gives r times its impulse."""
    case = case_of(tmp_path, RIGHT="free", MODEL=f"{{kind: {model}}}", LAW="{kind: penalty, stiffness: 1.0e6}")
    history, time = il.run(case), 1.0e-4
    rate, torque = (history.field("bar", time, each) for each in ("twist_rate", "torque"))
    within = 1e-3 if model == "continuous" else 1e-2  # 401 places with a front between two; and a mesh behind it
    impulse = 0.02 * (1.0 - float(history.evaluate(time, "velocity:hammer")))
    given = float(np.trapezoid(DENSITY * POLAR * rate.values, rate.x))
    assert given == pytest.approx(ARM * impulse, rel=within)
    assert ARM * float(history.evaluate(time, "momentum:bar")) == pytest.approx(
        ARM * impulse, rel=1e-4
    )  # between samples
    density = 0.5 * (DENSITY * POLAR * rate.values**2 + torque.values**2 / (SHEAR * POLAR))
    assert np.trapezoid(density, rate.x) == pytest.approx(float(history.evaluate(time, "energy:bar")), rel=within)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-6


def test_the_first_torque_is_that_of_the_impedance(tmp_path: Path) -> None:
    """sqrt(G J rho I_p) v0/r at the arm, twice as much where it meets the clamp."""
    hard = "{kind: wave_identification}"
    places = ", ".join(f"{{body: bar, at: {x}, quantity: torque}}" for x in ("0.0", "0.5"))
    history = il.run(case_of(tmp_path, LAW=hard, MODEL="{kind: continuous}", PROBES=places))
    first = IMPEDANCE / ARM
    assert float(history.evaluate(0.0, "torque:bar@0")) == pytest.approx(first, rel=1e-12)
    # The hammer slows down as exp(-Z t/(r2 m)) behind the front.
    assert float(history.evaluate(LENGTH / SPEED * (1.0 + 1e-9), "torque:bar@0.5")) == pytest.approx(
        2.0 * first, rel=1e-6
    )
    assert float(history.evaluate(0.0, "force:hammer|bar.left")) == pytest.approx(first / ARM, rel=1e-12)


@settings(max_examples=10, deadline=None)
@given(factor=st.floats(0.1, 10.0), stiffness=st.floats(1e5, 1e7))
def test_an_arm_longer_by_a_factor_is_a_lighter_faster_hammer(
    tmp_path_factory: pytest.TempPathFactory, factor: float, stiffness: float
) -> None:
    """The twist of arm k r under m/k2 at k v and a spring k0/k2 is that of arm r under m at v and k0."""
    path, twists = tmp_path_factory.mktemp("arm"), []
    for k in (1.0, factor):
        law = f"{{kind: penalty, stiffness: {stiffness / k**2!r}}}"
        case = case_of(path, ARM=f"lever_arm: {ARM * k!r},", LAW=law, PROBES="{body: bar, at: 0.0, quantity: twist}")
        history = il.run(case.with_("bodies.hammer", kind="mass", mass=0.02 / k**2, velocity=k))
        twists.append(history.evaluate(np.linspace(0.0, history.duration, 50), "twist:bar@0"))
    assert np.allclose(*twists, rtol=0.0, atol=1e-7 * np.max(np.abs(twists[0])))


def test_ends_are_those_of_torsion(tmp_path: Path) -> None:
    """A static torque twists a shaft with a spring at its end by T/k; an inertia adds to its momentum."""
    case = case_of(tmp_path, RIGHT="{spring: 500.0, torque: 10.0}", LAW="{kind: penalty, stiffness: 1.0}")
    [right] = [body.right for body in case.scene().bodies.values() if isinstance(body, Shaft)]
    assert right == shaft_end(End("spring", 500.0, 10.0), ARM)
    assert right.force / right.value / ARM == pytest.approx(10.0 / 500.0, rel=1e-12)
    with_inertia = case_of(tmp_path, RIGHT="{inertia: 0.003}").scene().bodies["bar"]
    assert with_inertia.moving_mass * ARM**2 == pytest.approx(DENSITY * POLAR * LENGTH + 0.003, rel=1e-12)


def test_gravity_does_not_turn_a_shaft(tmp_path: Path) -> None:
    case = case_of(tmp_path, RIGHT="free").with_("gravity", 9.81).with_("contacts.0.gap", 1.0)
    history = il.run(case)
    assert float(history.evaluate(history.duration, "momentum:bar")) == 0.0
    with pytest.raises(ImpactlabError, match="gravity does not act on the shaft 'bar'"):
        il.run(case.with_("solve.model", kind="continuous").with_("contacts.0.law", kind="wave_identification"))


def test_other_sections_twist_by_their_torsion_constant(tmp_path: Path) -> None:
    """c = sqrt(G J/(rho I_p)): of a square of side a, J = 0.1406 a4 and I_p = a4/6."""
    side = 0.03
    section = f"{{torsion_constant: {0.1406 * side**4!r}, polar_moment: {side**4 / 6.0!r}}}"
    square = case_of(tmp_path, BAR=OF_SHAFT.replace("{diameter: 0.04}", section)).scene().elastic["bar"]
    assert 2.0 * LENGTH / square.round_trip == pytest.approx(SPEED * math.sqrt(0.1406 * 6.0), rel=1e-12)
    tube = case_of(tmp_path, BAR=OF_SHAFT.replace("0.04}", "0.04, bore: 0.03}")).scene().elastic["bar"]
    assert tube.mass * ARM**2 == pytest.approx(DENSITY * math.pi / 32.0 * (0.04**4 - 0.03**4) * LENGTH, rel=1e-12)


A_ROD = "kind: rod, length: 1.0, area: 1.0e-4, material: {young: 2.0e11, density: 7850}"
STOP = "  - {between: [bar.right, stop], lever_arm: 0.5, law: {kind: penalty, stiffness: 1.0}}\nsolve:"
STRUCK_BY_A_ROD = {"kind: mass, mass: 0.02, velocity: 1.0": A_ROD, "[hammer, bar": "[hammer.right, bar"}
TWO_ARMS = {"solve:": STOP, "RIGHT": "free", "bodies:": "bodies:\n  stop: {kind: wall}"}


def with_section(section: str) -> dict[str, str]:
    return {"BAR": OF_SHAFT.replace("diameter: 0.04", section)}


@pytest.mark.parametrize(
    ("changes", "place", "texts"),
    [
        (with_section("width: 0.01, height: 0.02"), "bodies.bar.section", ["height, width", "of a beam", "diameter"]),
        (with_section("area: 1.0e-4, inertia: 1.0e-9"), "bodies.bar.section", ["area, inertia", "of a beam"]),
        (with_section("diameter: 0.04, bore: 0.05"), "bodies.bar.section", ["smaller bore"]),
        ({"BAR": OF_SHAFT.replace("shear_modulus", "young")}, "bodies.bar.material", ["young and poisson"]),
        ({"ARM": ""}, "contacts.0.lever_arm", ["shaft 'bar'", "Give lever_arm in m"]),
        ({"ARM": "lever_arm: 0.0,"}, "contacts.0.lever_arm", ["above 0"]),
        ({"BAR": A_ROD.removeprefix("kind: ")}, "contacts.0.lever_arm", ["neither 'hammer' nor 'bar'"]),
        (STRUCK_BY_A_ROD, "contacts.0.between", ["rod 'hammer' meets the shaft 'bar'", "Put a mass between"]),
        ({"PROBES": "{body: bar, quantity: stress}"}, "probes.0.quantity", ["twist, twist_rate, torque"]),
        (TWO_ARMS, "contacts.1.lever_arm", ["0.25 m at another contact", "0.5 m here"]),
    ],
)
def test_refused_by_name_with_place_and_remedy(
    tmp_path: Path, changes: dict[str, str], place: str, texts: list[str]
) -> None:
    with pytest.raises(ImpactlabError) as refused:
        case_of(tmp_path, **changes).scene()
    message = str(refused.value)
    assert place in message
    for text in texts:
        assert text in message, message
    assert refused.value.remedy


def test_a_theory_of_rods_does_not_describe_a_shaft() -> None:
    @dataclasses.dataclass(frozen=True)
    class Lateral(Continuous.__base__):  # type: ignore[misc, name-defined]
        theory = "lateral"
        has_mesh = False

        def element_length(self, body: Rod) -> float:
            return body.length

        def build(self, rod: Rod, gravity: float, faces: tuple[object, ...] = ()) -> None:
            raise AssertionError

    with pytest.raises(ImpactlabError, match="theory 'lateral' applies to rods, but 'shaft' is a shaft"):
        build_body(shaft(), {"shaft": Lateral()}, 0.0, ())


def test_a_shaft_that_turns_has_no_infinite_end(tmp_path: Path) -> None:
    with pytest.raises(ImpactlabError, match=r"'bar' has twist_rate 2 rad/s at t = 0 and an infinite end") as caught:
        case_of(tmp_path, BAR=f"{OF_SHAFT}, twist_rate: 2.0", RIGHT="infinite").scene()
    assert caught.value.path == "bodies.bar.twist_rate"
    assert f"ends: {{right: {{dashpot: {IMPEDANCE:.6g}}}}}" in caught.value.remedy
    assert case_of(tmp_path, RIGHT="infinite").scene().bodies["bar"].right.kind == "dashpot"
    with pytest.raises(ImpactlabError, match=r"'bar' has a twist of 0.01 rad/m at t = 0 at its infinite end") as caught:
        case_of(tmp_path, BAR=f"{OF_SHAFT}, twist: 0.01*x", RIGHT="infinite").scene()
    assert caught.value.path == "bodies.bar.twist"


def test_a_table_of_twists_is_in_rad() -> None:
    shaft = il.Shaft(
        length=LENGTH,
        section={"diameter": DIAMETER},
        material={"shear_modulus": SHEAR, "density": DENSITY},
        twist={"x": [0, "50 cm"], "u": ["0.5 deg", "2 mrad"]},
    )
    probes = [{"body": "bar", "at": x, "quantity": "twist"} for x in (0.0, LENGTH)]
    solve = {"duration": 1e-4, "model": {"kind": "continuous"}}
    case = il.Case(bodies={"bar": shaft}, probes=probes, solve=solve)
    history = il.run(case)
    start = [float(history.evaluate(0.0, f"twist:bar@{x:.6g}")) for x in (0.0, LENGTH)]
    assert start == pytest.approx([math.radians(0.5), 2e-3], rel=1e-12)
    with pytest.raises(ImpactlabError, match=r"'1 mm'.*rad"):
        case.with_("bodies.bar.twist.u.1", "1 mm").simulation()
