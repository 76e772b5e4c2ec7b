"""The one place of cross-field physics: scenes that can be are accepted, in every arrangement."""

from __future__ import annotations

import re

import pytest

import impactlab as il
from impactlab import CaseError, load_case
from impactlab.casefile.case import case_of
from impactlab.casefile.document import parse_yaml

BODIES = """\
schema_version: 1
bodies:
  wall: {kind: wall}
  ball: {kind: mass, mass: 1, velocity: 1}
  cart: {kind: mass, mass: 2}
  bar: {kind: rod, length: 1, area: 1e-4, material: {young: 2e11, density: 8000}, ends: {left: free, right: free}}
  rod: {kind: rod, length: 2, area: 1e-4, material: {young: 2e11, density: 8000}, ends: {left: free, right: clamped}}
solve: {duration: 1 ms}
contacts:
"""


def load(tmp_path, *pairs: str, more: str = ""):
    law = "law: {kind: penalty, stiffness: 1e9}"
    path = tmp_path / "scene.yaml"
    path.write_text(BODIES + "".join(f"  - {{between: [{pair}], {law}}}\n" for pair in pairs) + more)
    return load_case(path)


@pytest.mark.parametrize(
    "pairs",
    [
        ("ball, cart",),
        ("ball, wall",),
        ("wall, ball",),
        ("wall, bar.left", "bar.right, wall"),
        ("ball, bar.left", "bar.right, rod.left"),
        ("ball, bar.left", "bar.right, cart", "cart, rod.left"),
        ("ball, bar.at(0.5)", "bar.at(0.25), cart"),
        ("bar.right, rod.at(1.5)",),
        ("ball, bar.at(0)",),
        ("bar.at(1), ball",),
        ("ball, bar.left", "cart, bar.left"),
    ],
)
def test_arrangements_that_can_be(tmp_path, pairs):
    assert len(load(tmp_path, *pairs).scene().contacts) == len(pairs)


@pytest.mark.parametrize(
    ("pairs", "text"),
    [
        (("wall, wall",), "cannot be in contact with itself"),
        (("bar.left, ball",), "'bar.left' faces away from 'ball'"),
        (("bar.at(0), ball",), "faces away from 'ball'"),
        (("ball, bar.at(1)",), "faces away from 'ball'"),
        (("bar.left, rod.left",), "the first must be a mass, a wall, or the right end of a rod"),
        (("ball, rod.right",), "the second must be a mass, a wall, or the left end of a rod"),
        (("rod.right, ball",), "the end 'rod.right' is clamped and never moves"),
        (("ball, cart", "ball, cart"), "ball and cart already meet in contacts.0"),
        (("ball, cart", "cart, ball"), "cart and ball already meet in contacts.0"),
        (("ball, bar.at(0.5)", "ball, bar.at(500 mm)"), "ball and bar.at(0.5) already meet in contacts.0"),
        (("ball, bar.at(0.5)", "ball, bar.at(0.5000001)"), "ball and bar.at(0.5) already meet in contacts.0"),
        (("bar.right, rod.left", "rod.left, ball"), "faces away"),
        (("ball, bar.at(1.001)",), "x = 1.001 m lies outside the body 'bar'. Allowed: 0 to 1 m"),
        (("ball, bar.at(-0.1)",), "lies outside the body 'bar'"),
        (("ball, bar.at(1,5)",), "a contact is between two faces"),
        (("ball, bar.at(x)",), "'x' is not a number with a unit"),
        (("ball, bar.middle",), "a rod has no end 'middle'"),
        (("ball, bar.left(1)",), "a rod has no end 'left'"),
        (("ball, wall.left",), "'wall' is a wall and has no ends"),
        (("ball, Bar.left",), "there is no body 'Bar'. Did you mean 'bar'?"),
    ],
)
def test_arrangements_that_cannot_be(tmp_path, pairs, text):
    with pytest.raises(CaseError) as caught:
        load(tmp_path, *pairs)
    assert text in str(caught.value)
    assert caught.value.line is not None
    assert caught.value.remedy


def test_walls_that_meet(tmp_path):
    path = tmp_path / "walls.yaml"
    path.write_text(
        "schema_version: 1\nbodies: {a: {kind: wall}, b: {kind: wall}}\nsolve: {duration: 1}\n"
        "contacts: [{between: [a, b], law: {kind: penalty, stiffness: 1}}]\n"
    )
    with pytest.raises(CaseError, match="'a' and 'b' are walls and never move"):
        load_case(path)


@pytest.mark.parametrize(
    ("more", "text"),
    [
        ("probes: [{body: ball, quantity: velocity}]", None),
        ("probes: [{body: ball, quantity: stress}]", "the mass 'ball' has no stress to record"),
        ("probes: [{body: ball, at: 1, quantity: velocity}]", "1 m on the mass 'ball', which has no length"),
        ("probes: [{body: wall, quantity: velocity}]", "the wall 'wall' has no velocity to record"),
        ("probes: [{body: rdo, quantity: stress}]", "there is no body 'rdo'. Did you mean 'rod'?"),
        ("probes: [{body: bar, at: 0.5, quantity: strain}, {body: bar, at: 500 mm, quantity: strain}]", None),
        ("probes: [{body: bar, at: 0.5, quantity: strain}, {body: bar, at: 0.5000001, quantity: stress}]", None),
        (
            "probes: [{body: bar, at: 0.5, quantity: strain}, {body: bar, at: 0.5000001, quantity: strain}]",
            "probes.0 at 0.5 m and this one at 0.5000001 m have one channel, strain:bar@0.5",
        ),
        ("snapshots: [0, 1 ms]", None),
        ("snapshots: [1.1 ms]", "0.0011 s lies after the end of the run. Allowed: 0 to 0.001 s"),
        ("snapshots: [-1]", "-1 s is out of range"),
        ("gravity: -9.81 m/s^2", None),
    ],
)
def test_quantities_that_a_probe_may_record(tmp_path, more, text):
    if text is None:
        load(tmp_path, "ball, cart", more=more + "\n")
        return
    with pytest.raises(CaseError) as caught:
        load(tmp_path, "ball, cart", more=more + "\n")
    assert text in str(caught.value)


def test_round_trips_need_a_rod(tmp_path):
    case = load(tmp_path, "ball, cart")
    assert case.with_("solve.duration", {"round_trips": 1}).scene().duration == pytest.approx(4e-4)
    with pytest.raises(CaseError, match="'ball' is a mass and has no round trip"):
        case.with_("solve.round_trips_of", "ball")
    path = tmp_path / "masses.yaml"
    path.write_text("schema_version: 1\nbodies: {a: {kind: mass, mass: 1}}\nsolve: {duration: {round_trips: 1}}\n")
    with pytest.raises(CaseError, match="counts the round trips of a rod, a beam or a shaft, and this case has none"):
        load_case(path)


@pytest.mark.parametrize("block", ["methods", "variants"])
def test_base_is_the_name_of_the_case_as_written(tmp_path, block):
    """A method of that name was never run."""
    with pytest.raises(CaseError, match=f"a {block[:-1]} of that name would never run") as caught:
        load(tmp_path, "ball, cart", more=f"{block}:\n  other: {{gravity: 1.0}}\n  base: {{gravity: 2.0}}\n")
    assert (caught.value.path, caught.value.line) == (f"{block}.base", 13)
    assert caught.value.remedy == f"Give the {block[:-1]} another name."


def test_segments_stand_alone(tmp_path):
    case = load(tmp_path, "ball, cart")
    piece = {"length": 1, "area": 1e-4, "material": {"young": 2e11, "density": 8000}}
    with pytest.raises(CaseError, match=r"bodies\.bar\.length: given together with segments"):
        case.with_("bodies.bar.segments", [piece])
    with pytest.raises(CaseError) as caught:
        case.with_("bodies.bar", {"segments": [{"length": 1, "material": piece["material"]}]})
    assert [(each.path, each.text) for each in caught.value.others] == [
        ("bodies.bar.segments.0.area", "this key is missing")
    ]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("schema_version: 1\n", ""), "Add schema_version: 1."),
        (("mass: 1.0, ", ""), "Add mass: mass [kg]."),
        (("ball: {kind: mass", "ball: {kind: mass, 3 m: 1"), "decimal comma"),
        (("duration: 1e-3", "duration: 1e-3, model: {kind: finite_element, elements: '50'}"), "without quotes"),
    ],
)
def test_common_mistakes_are_refused_with_the_right_form(change: tuple[str, str], words: str) -> None:
    text = """schema_version: 1
bodies:
  ball: {kind: mass, mass: 1.0, velocity: 1.0}
  rod: {kind: rod, length: 1.0, area: 1e-4, material: steel}
contacts: [{between: [ball, rod.left], law: {kind: penalty, stiffness: 1e8}}]
solve: {duration: 1e-3}
"""
    assert change[0] in text
    with pytest.raises(il.ImpactlabError) as refused:
        case_of("slip", "", parse_yaml(text.replace(*change)))
    assert words in str(refused.value)


def test_a_body_with_a_name_that_a_setting_misspells_is_not_made() -> None:
    text = "bodies.hamer.mass: the case has no body 'hamer'. Did you mean 'hammer'?"
    with pytest.raises(il.CaseError, match=re.escape(text)):
        il.load_case("axial_impact").with_("bodies.hamer.mass", 2.0)


def test_bodies_in_a_list_are_refused_as_they_need_names() -> None:
    with pytest.raises(il.CaseError) as refused:
        il.Case.from_dict({"bodies": [{"kind": "mass", "mass": 1.0}], "solve": {"duration": 1.0}})
    assert "Write NAME: {kind: ...}" in refused.value.remedy


def test_wrong_probes_are_reported_together(tmp_path):
    """The first hid the others."""
    probes = (
        "{body: rod, at: 7, quantity: strain}, {body: ball, at: 0, quantity: strain}, {body: rud, quantity: strain}"
    )
    with pytest.raises(CaseError, match="x = 7 m lies outside") as caught:
        load(tmp_path, "ball, bar.left", more=f"probes: [{probes}]\n")
    assert [each.path for each in caught.value.others] == ["probes.1.quantity", "probes.2.body"]


def test_a_list_whose_entries_are_all_faulty_is_not_called_too_short() -> None:
    """It read 'a list of 2 has the wrong length. Allowed: at least 1' beside the faults of its entries."""
    piece = {"length": -1.0, "area": 1e-4, "material": "steel"}
    rod = {"kind": "rod", "segments": [piece, piece]}
    with pytest.raises(il.CaseError) as caught:
        il.Case.from_dict({"schema_version": 1, "bodies": {"rod": rod}, "solve": {"duration": 1e-3}})
    paths = [caught.value.path, *(other.path for other in caught.value.others)]
    assert paths == ["bodies.rod.segments.0.length", "bodies.rod.segments.1.length"]
