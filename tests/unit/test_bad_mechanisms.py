"""Errors in cases with mechanisms, and their messages: place, value given, values allowed, fix."""

from __future__ import annotations

import copy
import math
import re
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.errors import CaseError, PairingError, StepError
from tests.solving import in_steps

HERTZ = {"kind": "hertz", "stiffness": 1.0e9}
CASE: dict[str, Any] = {
    "schema_version": 1,
    "bodies": {
        "crank": {"kind": "link", "length": 0.1, "mass": 0.2},
        "rod": {
            "kind": "beam",
            "length": 0.3,
            "section": {"width": 0.01, "height": 0.004},
            "material": {"young": 2.1e11, "density": 7850.0},
        },
        "block": {"kind": "mass", "mass": 0.25},
    },
    "mechanisms": {
        "press": {
            "links": [
                {"body": "crank", "angle": -1.9, "drive": {"rate": 30.0}},
                {"body": "rod", "axial_modes": 2, "end_mass": 0.5},
            ],
            "end": {"slide": 0.0},
        }
    },
    "contacts": [{"between": ["rod.right", "block"], "along": "x", "gap": 0.02, "law": HERTZ}],
    "solve": in_steps(2.0e-4, "midpoint", {"kind": "modal", "elements": 40, "modes": 6}, dt=1.0e-5),
}
LINKS, LAST = "mechanisms.press.links", "mechanisms.press.links.1"
GONE = object()
FINE = {"kind": "modal", "elements": 40, "modes": 6}
SIDEWAYS = {"between": ["rod.at(0.1)", "block"], "along": "y", "gap": 1.0, "law": HERTZ}
ITSELF = {"between": ["rod.at(0.1)", "crank.right"], "along": "y", "gap": 1.0, "law": HERTZ}
ALONE = {LINKS: [{"body": "rod"}], "bodies.crank": GONE}
NO_MECHANISM = {"mechanisms": {}, "bodies.crank": {"kind": "wall"}, "contacts.0.along": GONE}


def case_with(changes: dict[str, Any]) -> il.Case:
    """Return the case with other values at dotted paths."""
    document = copy.deepcopy(CASE)
    for path, given in changes.items():
        value = given if given is GONE else copy.deepcopy(given)
        *keys, last = path.split(".")
        at: Any = document
        for key in keys:
            at = at[int(key)] if isinstance(at, list) else at.setdefault(key, {})
        if value is GONE:
            del at[last]
        elif isinstance(at, list):
            at[int(last) : int(last) + 1] = [value]
        else:
            at[last] = value
    return il.Case.from_dict(document)


FAULTS = [  # changes of the case, the path of the fault, and words of its message and remedy
    ({f"{LAST}.body": "rot"}, f"{LAST}.body", "no body 'rot'. Did you mean 'rod'?", "Links: crank, rod."),
    ({LINKS: []}, LINKS, "Allowed: at least 1", ""),
    ({LINKS: [{"body": "crank"}] * 1000}, LINKS, "a list of 1000 has the wrong length", ""),
    ({LAST: {"body": "crank"}}, f"{LAST}.body", "a link of 'press' already", "a body of its own"),
    (
        {"mechanisms.other": {"links": [{"body": "crank"}]}},
        "mechanisms.other.links.0.body",
        "'crank' is a link of 'press' already",
        "a body of its own",
    ),
    ({"mechanisms": {}}, "bodies.crank", "a link of no mechanism", "Name it in the links"),
    (
        {"mechanisms": {"block": CASE["mechanisms"]["press"]}},
        "mechanisms.block",
        "names a mechanism here and a body in bodies.block",
        "another name",
    ),
    ({f"{LAST}.body": "block"}, f"{LAST}.body", "'block' is a mass. Allowed: link (rigid), beam", "Name a body"),
    ({f"{LINKS}.0.torque": 1.0}, f"{LINKS}.0.drive", "driven or bears a torque", "Keep one of the two"),
    ({f"{LINKS}.0.rate": 1.0}, f"{LINKS}.0.rate", "that of its drive", "Remove one of the two"),
    ({f"{LAST}.rate": 1.0}, f"{LAST}.joint", "follows from the slide", "Drive or turn another link"),
    (
        {**ALONE, f"{LINKS}.0.drive": {"rate": 1.0}, "mechanisms.press.end": "free"},
        f"{LINKS}.0.joint",
        "turns the root section of a beam",
        "joint: clamped",
    ),
    ({f"{LINKS}.0.axial_modes": 2}, f"{LINKS}.0.axial_modes", "'crank' is rigid", "describe the link as a beam"),
    ({"bodies.rod.ends": {"left": "clamped"}}, f"{LAST}.body", "the ends of a link are its joints", "Leave `ends`"),
    ({"bodies.rod.ends": {"right": {"mass": 0.5}}}, f"{LAST}.body", "the ends of a link", "is its end_mass"),
    (
        {"bodies.rod.rotation": {"rate": 10.0, "axis_at": 0.0, "plane": "chord"}},
        f"{LAST}.body",
        "a link turns by its joints",
        "Remove rotation",
    ),
    ({f"{LAST}.joint": "welded"}, f"{LAST}.joint", "'welded' is not allowed here. Allowed: hinge, clamped", ""),
    ({f"{LINKS}.0.drive": {"rate": 30.0, "within": 0.0}}, f"{LINKS}.0.drive.within", "0 s is out of range", ""),
    ({f"{LINKS}.0.angle": "60 m"}, f"{LINKS}.0.angle", "a unit of another dimension", ""),
    ({"mechanisms.press.end": {"slide": math.nan}}, "mechanisms.press.end", "nan is not a finite number", ""),
    ({"contacts.0.along": "z"}, "contacts.0.along", "'z' is not a direction. Allowed: x, y, or [cos, sin]", ""),
    (
        {"contacts.0.between": ["rod.at(0.5)", "block"]},
        "contacts.0.between.0",
        "x = 0.5 m lies outside the body 'rod'. Allowed: 0 to 0.3 m",
        "left end",
    ),
    ({"bodies.rod.damping": {"mass": 1.0}}, f"{LAST}.body", "a link has no damping", "Remove damping"),
    ({"bodies.rod.material.viscosity": 1.0e3}, f"{LAST}.body", "a link has no damping", "viscosity"),
    ({"bodies.rod.tension": 10.0}, f"{LAST}.body", "straight and without preload", "Remove tension"),
    (ALONE, "mechanisms.press.end", "one link on a slide cannot move", "two links or more"),
    ({"mechanisms.press.end": {"slide": 5.0}}, "mechanisms.press.end", "out of reach of link 'rod'", "another"),
    ({"mechanisms.press.end": "fixed"}, "mechanisms.press.end", "Allowed: free, or {slide: y}", ""),
    ({"contacts.0.along": GONE}, "contacts.0.along", "this key is missing", "along: x, y or [cos, sin]"),
    ({"contacts.0.along": [0.0, 0.0]}, "contacts.0.along", "the direction [0, 0] has no length", ""),
    ({"contacts.0.along": [math.nan, 1.0]}, "contacts.0.along", "nan is not a finite number", ""),
    ({**NO_MECHANISM, "contacts.0.along": "x", "bodies.crank": GONE}, "contacts.0.along", "no link", "Remove along"),
    ({"contacts.1": SIDEWAYS}, "contacts.1.along", "'block' moves along one line", "one direction"),
    ({"contacts.1": ITSELF}, "contacts.1.between", "cannot strike itself", "Let a link meet another body"),
    ({"bodies.block.rotation": {}}, "contacts.0.between", "'block' has a steady rotation", "Remove its rotation"),
    ({"bodies.crank.length": 0.0}, "bodies.crank.length", "0 m is out of range", ""),
    ({"bodies.crank.mass": math.nan}, "bodies.crank.mass", "nan is not a finite number", ""),
    ({f"{LAST}.end_mass": -1.0}, f"{LAST}.end_mass", "-1 kg is out of range", ""),
    ({f"{LINKS}.0.drive.rate": math.inf}, f"{LINKS}.0.drive.rate", "inf is not a finite number", ""),
    (
        {"gravity": [0.0, 0.0, -9.81]},
        "gravity",
        "a list of 3 is not a valid gravity. Allowed: a number in m/s2, or [x, y]",
        "",
    ),
    ({**NO_MECHANISM, "gravity": [0.0, -9.81]}, "gravity", "and this case has none", "Give a number"),
    (
        {"bodies.idle": {"kind": "mass", "mass": 1.0}, "gravity": [0.0, -9.81]},
        "gravity",
        "the direction in which 'idle' moves is not known",
        "Give gravity as a number",
    ),
    (
        {"bodies.idle": {"kind": "mass", "mass": 1.0}, "gravity": 9.81, "contacts.0.along": [0.6, 0.8]},
        "gravity",
        "5.886 m/s2 on 'block'",
        "in one direction",
    ),
    (
        {"probes": [{"body": "rod", "at": 0.1, "quantity": "displacement"}]},
        "probes.0.quantity",
        "the link 'rod' has no displacement",
        "Each run records angle:rod",
    ),
    ({"solve.models": {"crank": FINE}}, "solve.models.crank", "'crank' is a link", "Remove it"),
    ({"solve.duration": {"round_trips": 2}}, "solve.duration", "this case has none", "in seconds"),
    ({"solve.round_trips_of": "rod"}, "solve.round_trips_of", "is a link and has no round trip", "this case"),
    ({"solve.step": {"courant": 1.0}}, "solve.step", "courant needs a rod with a mesh", "dt: ..."),
    (
        {"solve": {"duration": 1.0e-3, "tolerance": 1.0e-2}},
        "solve.tolerance",
        "the automatic choice does not support mechanisms, and 'press' is one",
        "half the step",
    ),
    *(
        ({"solve.model": model}, "solve.models.rod", "needs modes of a mesh", "{kind: modal, elements: 160")
        for model in (
            {"kind": "continuous"},
            {"kind": "finite_element", "elements": 20},
            {"kind": "modal", "modes": 10},
        )
    ),
    *(
        ({"solve.model": {**FINE, key: value}}, f"solve.models.rod.{key}", f"{key} {word} is", f"Remove {key}")
        for key, value, word in (
            ("mass", "lumped", "lumped"),
            ("order", 2, "2"),
            ("basis", {"kind": "craig_bampton"}, "craig_bampton"),
        )
    ),
    (
        {"solve.model": {**FINE, "elements": 4, "modes": 40}},
        "solve.models.rod",
        "40 modes of link 'rod', and its mesh of 4 elements has 8",
        "Give fewer",
    ),
    (
        {"solve.model": {**FINE, "elements": 3}, f"{LAST}.axial_modes": 12},
        "solve.models.rod",
        "12 axial_modes of link 'rod', and its mesh of 3 elements has 3",
        "Give fewer",
    ),
]


@pytest.mark.parametrize(("changes", "path", "text", "remedy"), FAULTS)
def test_a_wrong_mechanism_is_refused_with_its_place_and_a_fix(
    changes: dict[str, Any], path: str, text: str, remedy: str
) -> None:
    with pytest.raises(CaseError) as raised:
        il.run(case_with(changes))
    assert raised.value.path == path
    assert text in raised.value.text
    assert remedy in raised.value.remedy


@pytest.mark.parametrize("key", ["length", "section", "material"])
def test_a_beam_of_a_mechanism_without_a_shape_is_refused_by_its_key(key: str) -> None:
    """It ended with an AttributeError."""
    with pytest.raises(CaseError, match="this key is missing") as raised:
        il.run(case_with({f"bodies.rod.{key}": GONE}))
    assert raised.value.path == f"bodies.rod.{key}"


@pytest.mark.parametrize("kind", ["newmark", "exact_modal", "central_difference", "hht_alpha"])
def test_a_scheme_for_constant_matrices_is_refused(kind: str) -> None:
    with pytest.raises(PairingError, match=f"'{kind}' needs constant matrices.*Allowed: midpoint, adaptive") as raised:
        il.run(case_with({"solve.integrator": {"kind": kind}}))
    assert raised.value.path == "solve.integrator"


@pytest.mark.parametrize(
    ("law", "text"),
    [
        ({"kind": "wave_identification"}, "whose links all move it"),
        ({"kind": "wave_initialised"}, "law 'wave_initialised' needs the waves that arrive at a face"),
        ({"kind": "nitsche"}, "law 'nitsche' needs the waves"),
        ({"kind": "impedance_residual"}, "law 'impedance_residual' needs the waves"),
        ({"kind": "modal_messengers"}, "law 'modal_messengers' needs the waves"),
    ],
)
def test_a_law_of_waves_is_refused(law: dict[str, Any], text: str) -> None:
    with pytest.raises(PairingError, match=text) as raised:
        il.run(case_with({"contacts.0.law": law}))
    assert raised.value.path == "contacts.0.law"
    assert "hertz" in raised.value.remedy


def test_an_effective_mass_must_be_given_where_it_changes_with_the_position() -> None:
    law = {"kind": "khulief_shabana", "stiffness": 1.0e7, "restitution": 0.5}
    with pytest.raises(PairingError, match="that of a mechanism changes with its position") as raised:
        il.run(case_with({"contacts.0.law": law}))
    assert raised.value.path == "contacts.0.law.effective_mass"
    assert "Give effective_mass in kg" in raised.value.remedy
    il.run(case_with({"contacts.0.law": {**law, "effective_mass": 0.25}}))


@pytest.mark.parametrize("law", ["velocity_complementarity", "impulse_momentum", "addition_deletion"])
def test_adaptive_steps_serve_laws_of_smooth_forces_alone(law: str) -> None:
    text = "integrator 'adaptive' needs a force that follows from gap and gap rate alone, and only presses; "
    text += f"law '{law}' has no such force"
    with pytest.raises(PairingError, match=text) as raised:
        il.run(case_with({"solve.integrator": {"kind": "adaptive"}, "contacts.0.law": {"kind": law}}))
    assert raised.value.path == "contacts.0.law"
    assert "midpoint" in raised.value.remedy


ADAPTIVE = [{"kind": "adaptive", "method": method} for method in ("DOP853", "Radau")]


def short(crank: dict[str, Any], scheme: dict[str, Any]) -> dict[str, Any]:
    """Return a mechanism whose slide comes out of reach: a rod shorter than its lowest joint is high."""
    return {
        "bodies.rod": {"kind": "link", "length": 0.105, "mass": 0.1},
        LINKS: [{"body": "crank", **crank}, {"body": "rod"}],
        "mechanisms.press.end": {"slide": -0.02},
        "contacts.0.gap": 1.0,
        "solve.duration": 0.2,
        "solve.integrator": scheme,
        "solve.step": {"dt": 1.0e-5} if scheme["kind"] == "midpoint" else {"points_per_period": 10},
    }


@pytest.mark.parametrize("scheme", [{"kind": "midpoint"}, *ADAPTIVE], ids=["midpoint", "DOP853", "Radau"])
@pytest.mark.parametrize("crank", [{"drive": {"rate": 30.0}}, {"rate": 30.0}], ids=["driven", "free"])
def test_a_slide_that_comes_out_of_reach_ends_the_run_with_time_and_angle(
    crank: dict[str, Any], scheme: dict[str, Any]
) -> None:
    with pytest.raises(StepError, match=r"slide of 'press' is out of reach: link 'rod' .* rad \(t = ") as raised:
        il.run(case_with(short(crank, scheme)))
    assert raised.value.remedy.startswith("Move the slide")
    [angle] = (float(word) for word in re.findall(r"at (-?[\d.]+) rad", raised.value.text))
    assert angle == pytest.approx(-0.5 * math.pi, abs=0.02)
    assert raised.value.time < 0.1  # of 0.2 s
    if scheme["kind"] == "midpoint":
        assert raised.value.step == round(raised.value.time / 1.0e-5)
    if "drive" in crank:  # the joint is 0.105 m above the slide
        assert raised.value.time == pytest.approx(math.asin(0.85) / 30.0, abs=1.1e-5)


def test_the_weight_of_a_body_acts_along_its_contact() -> None:
    """A block that moves along y falls, one that moves along x does not."""
    for along, speed in (("x", 0.0), ("y", -9.81 * 2.0e-4)):
        history = il.run(case_with({"contacts.0.along": along, "gravity": [0.0, -9.81]}))
        assert float(history.evaluate(history.duration, "velocity:block")) == pytest.approx(speed, abs=1e-12)


def test_a_mass_behind_the_struck_one_falls_along_the_same_line() -> None:
    behind = {"between": ["block", "second"], "gap": 1.0, "law": HERTZ}
    changes = {"contacts.0.along": "y", "bodies.second": {"kind": "mass", "mass": 1.0}, "contacts.1": behind}
    history = il.run(case_with({**changes, "gravity": [0.0, -9.81]}))
    for name in ("block", "second"):
        assert float(history.evaluate(history.duration, f"velocity:{name}")) == pytest.approx(-9.81 * 2.0e-4, abs=1e-12)


@pytest.mark.parametrize(
    ("along", "across"), [("x", "9.81"), ([0.6, -0.8], "5.886"), ("y", ""), ([0.0, -1.0], "")], ids=str
)
def test_a_weight_that_a_guide_takes_is_warned_of(along: Any, across: str) -> None:
    history = il.run(case_with({"contacts.0.along": along, "gravity": [0.0, -9.81]}))
    found = [warned.text for warned in history.warnings if warned.code == "guided_weight"]
    assert found == (
        [f"block: {across} m/s2 of gravity act across the motion; the guide carries this component"] * bool(across)
    )


def test_the_drive_of_a_second_link_acts_from_the_ground_with_a_warning() -> None:
    """The first link keeps its rate: no moment of the drive acts on it, and the hinge at its end carries no mass."""
    bodies = {"a": {"kind": "link", "length": 0.5, "mass": 0.5}, "b": {"kind": "link", "length": 0.8, "mass": 0.4}}
    links = [{"body": "a"}, {"body": "b", "drive": {"rate": 4.0, "within": 0.4}}]
    wall = {"between": ["a.right", "w"], "along": "x", "gap": 50.0, "law": {"kind": "hertz", "stiffness": 1.0}}
    history = il.run(
        il.Case.from_dict(
            {
                "schema_version": 1,
                "bodies": {**bodies, "w": {"kind": "wall"}},
                "mechanisms": {"arm": {"links": links}},
                "contacts": [wall],
                "gravity": [0, 0],
                "solve": {"duration": 0.4, "integrator": {"kind": "midpoint"}, "step": {"dt": 1e-3}},
            }
        )
    )
    [text] = [warned.text for warned in history.warnings if warned.code == "ground_drive"]
    assert text.startswith("b: its drive sets its absolute angle and acts from the ground")
    assert "does not act on 'a'" in text
    # All moments about the hinge at the ground are that of the drive: its impulse is the angular momentum.
    t = history.recorded["drive:b"].times
    moment = history.evaluate(t, "drive:b")
    given = float(np.sum(0.5 * (moment[1:] + moment[:-1]) * np.diff(t)))
    angles = [float(history.evaluate(0.4, f"angle:{name}")) for name in "ab"]
    rates = [float(history.evaluate(0.4, f"rate:{name}")) for name in "ab"]
    coupled = 0.4 * 0.5 * 0.4 * math.cos(angles[1] - angles[0])
    momentum = (0.5 / 3.0 + 0.4) * 0.25 * rates[0] + 0.4 * 0.64 / 3.0 * rates[1] + coupled * sum(rates)
    assert given == pytest.approx(momentum, rel=1e-3)
    assert "ground_drive" not in [warned.code for warned in il.run(case_with({})).warnings]


@pytest.mark.parametrize("law", [{"kind": "penalty", "stiffness": 1e5}, {"kind": "velocity_complementarity"}], ids=str)
def test_rigid_links_that_drives_alone_move_meet_no_wall(law: dict[str, Any]) -> None:
    rigid = {"kind": "link", "length": 0.3, "mass": 0.3}
    links = [{"body": "crank", "angle": -1.9, "drive": {"rate": 30.0}}, {"body": "rod", "end_mass": 0.5}]
    changes = {"bodies.rod": rigid, "mechanisms.press.links": links, "contacts.0.law": law}
    with pytest.raises(CaseError, match=r"change the motion of the faces of rod\.right\|block: all links are rigid"):
        il.run(case_with({**changes, "bodies.block": {"kind": "wall"}}))
    assert il.run(case_with(changes)).duration > 0.0


@pytest.mark.parametrize("quantity", ["final_velocity", "final_momentum"])
def test_a_mechanism_has_no_velocity_or_momentum_along_one_direction(quantity: str) -> None:
    """It read 0: the motion of its links has no one direction."""
    found = il.sensitivities(case_with({}), ["bodies.block.mass"], [quantity])
    assert {row.label: math.isnan(row.value) for row in found.rows} == {"block": False, "press": True}
    assert "momentum:press" not in il.run(case_with({})).channels()


def test_a_bond_between_a_driven_rigid_chain_and_a_wall_is_refused() -> None:
    """Nothing could move so that its force follows: it would read zero without a word."""
    rigid = {"kind": "link", "length": 0.3, "mass": 0.3}
    links = [{"body": "crank", "angle": -1.9, "drive": {"rate": 30.0}}, {"body": "rod", "end_mass": 0.5}]
    changes = {"bodies.rod": rigid, "mechanisms.press.links": links, "contacts.0.law": {"kind": "bonded"}}
    with pytest.raises(CaseError, match="no force can change the motion"):
        il.run(case_with({**changes, "bodies.block": {"kind": "wall"}, "contacts.0.gap": GONE}))


@pytest.mark.parametrize("law", [{"kind": "bonded"}, {"kind": "penalty", "stiffness": 1.0e6, "damping": 1.0}])
def test_a_wall_on_a_driven_link_is_refused_beside_a_link_that_swings(law: dict[str, object]) -> None:
    """The bond read zero without a word, and the spring divided by a compliance of zero."""
    rigid = {"kind": "link", "length": 0.3, "mass": 0.3}
    links = [{"body": "crank", "angle": -1.9, "drive": {"rate": 30.0}}, {"body": "rod", "angle": 0.5}]
    changes = {"bodies.rod": rigid, "mechanisms.press": {"links": links}, "contacts.0.law": law}
    changes |= {"bodies.block": {"kind": "wall"}, "contacts.0.gap": 0.0}
    for face in ("crank.right", "crank.at(0.05)"):
        with pytest.raises(CaseError, match="no force can change the motion"):
            il.run(case_with({**changes, "contacts.0.between": [face, "block"]}))
    assert il.run(case_with({**changes, "contacts.0.between": ["rod.right", "block"]})).duration > 0.0


def test_a_constraint_that_gains_energy_on_a_mechanism_names_a_remedy_that_works() -> None:
    """A mechanism takes no other scheme and no mesh of its own, which the law would name on other bodies."""
    changes = {
        "bodies": {"arm": {"kind": "link", "length": 1.0, "mass": 0.54}, "stop": {"kind": "wall"}},
        "mechanisms": {"press": {"links": [{"body": "arm", "rate": 0.1, "end_mass": 0.1}]}},
        "contacts": [
            {"between": ["arm.right", "stop"], "along": "y", "gap": 1e-5, "law": {"kind": "addition_deletion"}}
        ],
        "solve": {"duration": 1e-3, "integrator": {"kind": "midpoint"}, "step": {"dt": 1e-6}},
    }
    with pytest.raises(StepError, match="energy grew") as raised:
        il.run(il.Case(**changes))
    assert raised.value.remedy == "Give events: located, or a law with a stiffness, such as hertz."
    located = il.run(il.Case(**{**changes, "solve": {**changes["solve"], "events": "located"}}))
    assert located.energy.largest_gain < 1e-9
