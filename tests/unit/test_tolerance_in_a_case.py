"""`solve.tolerance` in a case: what it replaces, what it refuses, and how it comes and goes by editing."""

from __future__ import annotations

from pathlib import Path

import pytest

import impactlab as il
from impactlab.contact.power_law import Hertz
from impactlab.errors import CaseError
from impactlab.refine.descriptions.suitable import has_unique_solution
from impactlab.scene.method import laws_of
from tests.unit.case_texts import PAPER

TEXT = PAPER[: PAPER.index("    gap:")] + "LAW\nsolve:\n  duration: {round_trips: 2}\nSOLVE\n"


def load(tmp_path: Path, solve: str = "  tolerance: 1.0e-3", law: str = "") -> il.casefile.Case:
    file = tmp_path / "case.yaml"
    file.write_text(TEXT.replace("SOLVE", solve).replace("LAW", law and f"    law: {law}"), encoding="utf-8")
    return il.load_case(file)


def test_a_contact_without_a_law_is_hard(tmp_path):
    case = load(tmp_path)
    assert case.simulation().method.tolerance.error == 1e-3
    assert laws_of(*case.simulation())[0].hard
    exact = load(tmp_path, "  model: {kind: continuous}", "{kind: addition_deletion}")
    assert il.run(case).events == il.run(exact).events


def test_a_physical_law_stays(tmp_path):
    case = load(tmp_path, law="{kind: hertz, stiffness: 1.0e+10}")
    assert laws_of(*case.simulation())[0] == Hertz(1e10)
    assert next(iter(il.run(case).choice.method.laws.values())) == Hertz(1e10)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("model", "{kind: continuous}"),
        ("models", "{rod: {kind: continuous}}"),
        ("integrator", "{kind: newmark}"),
        ("step", "{dt: 1.0e-6}"),
        ("events", "located"),
    ],
)
def test_a_tolerance_beside_a_description_is_refused(tmp_path, key, value):
    with pytest.raises(CaseError, match=f"leaves {key} to the automatic choice") as caught:
        load(tmp_path, f"  tolerance: 1.0e-3\n  {key}: {value}")
    assert caught.value.path == f"solve.{key}"
    assert caught.value.line is not None
    assert "Keep either tolerance" in str(caught.value)


@pytest.mark.parametrize("value", ["0.6", "1.0e-9", "-1.0e-3", "0", "nan", "tight", "'1 mm'"])
def test_a_tolerance_out_of_range_is_refused(tmp_path, value):
    with pytest.raises(CaseError) as caught:
        load(tmp_path, f"  tolerance: {value}")
    assert caught.value.path == "solve.tolerance"


@pytest.mark.parametrize("value", [1e-8, 0.5])
def test_the_ends_of_the_range_are_allowed(tmp_path, value):
    assert load(tmp_path, f"  tolerance: {value!r}").simulation().method.tolerance.error == value


def test_without_a_tolerance_a_law_is_needed(tmp_path):
    with pytest.raises(CaseError, match="this key is missing") as caught:
        load(tmp_path, "")
    assert caught.value.path == "contacts.0.law"
    assert "solve.tolerance" in str(caught.value)


def test_a_stiffness_relative_to_a_mesh_is_refused(tmp_path):
    with pytest.raises(CaseError, match="relative to the elements of a mesh") as caught:
        load(tmp_path, law="{kind: penalty, stiffness: {relative: 0.8}}")
    assert caught.value.path == "contacts.0.law.stiffness"


def test_a_law_whose_default_is_relative_names_the_value_to_give(tmp_path):
    """Nobody gave a stiffness: the message named one, at a line without it."""
    with pytest.raises(CaseError, match="'penalty' needs stiffness in N/m here: its default is relative") as caught:
        load(tmp_path).with_settings({"contacts.0.law.kind": "penalty"}, by="--set")
    assert "given by --set: contacts.0.law: law" in str(caught.value)
    assert "--set 'contacts.0.law={kind: penalty, stiffness: 1e9}'" in caught.value.remedy
    load(tmp_path).with_("contacts.0.law", {"kind": "penalty", "stiffness": 1e9})


def test_setting_a_tolerance_drops_the_description(tmp_path):
    solve = "  model: {kind: modal, modes: 5}\n  step: {points_per_period: 20}\n  integrator: {kind: exact_modal}"
    case = load(tmp_path, solve, "{kind: wave_identification}")
    changed = case.with_("solve.tolerance", 0.01)
    assert changed.simulation().method.tolerance.error == 0.01
    assert set(changed.document.data["solve"]) == {"duration", "tolerance"}
    whole = case.with_("solve", tolerance=0.02)
    assert whole.simulation().method.tolerance.error == 0.02


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("solve.model", {"kind": "finite_element", "elements": 20}),
        ("solve.model.kind", "continuous"),
        ("solve.models.rod", {"kind": "continuous"}),
        ("solve.integrator", {"kind": "newmark"}),
        ("solve.step.dt", 1e-7),
        ("solve.events", "dated"),
    ],
)
def test_setting_a_description_drops_the_tolerance(tmp_path, path, value):
    case = load(tmp_path, law="{kind: wave_identification}")
    assert case.with_(path, value).simulation().method.tolerance is None


def test_settings_of_the_scene_keep_the_tolerance(tmp_path):
    case = load(tmp_path)
    assert case.with_("solve.duration", {"round_trips": 1}).simulation().method.tolerance.error == 1e-3
    assert case.with_("contacts.0.gap", 1e-5).simulation().method.tolerance.error == 1e-3
    assert (
        case.with_settings([("contacts.0.law", {"kind": "addition_deletion"}), ("solve.tolerance", None)])
        .simulation()
        .method.tolerance
        is None
    )


def test_a_method_may_have_a_tolerance(tmp_path):
    methods = "methods:\n  automatic: {solve.tolerance: 1.0e-2}"
    case = load(tmp_path, f"  step: {{points_per_period: 10}}\n{methods}", "{kind: wave_identification}")
    chosen = case.method("automatic")
    assert chosen.simulation().method.tolerance.error == 0.01
    comparison = il.compare(case)
    base, automatic = comparison.rows
    assert base.summary["choice"] is None
    assert automatic.summary["choice"]["tolerance"] == 0.01
    assert automatic.summary["errors"]["mass_displacement"] <= 0.01


def test_resolved_values_name_the_tolerance_alone(tmp_path):
    resolved = load(tmp_path).resolved()
    assert set(resolved["solve"]) == {"duration", "records", "tolerance", "tolerance_on"}
    assert resolved["solve"]["tolerance"] == 1e-3
    assert "law" not in resolved["contacts"][0]


def test_two_masses_in_hard_contact_are_refused(tmp_path):
    text = (
        TEXT.replace("SOLVE", "  tolerance: 1.0e-3")
        .replace("LAW", "")
        .replace("{left: free, right: clamped}", "{left: {mass: 0.1}}")
    )
    file = tmp_path / "heavy.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(
        CaseError, match=r"no method within a tolerance suits this scene: .*both faces have mass"
    ) as caught:
        il.run(il.load_case(file))
    assert caught.value.path == "solve.tolerance"
    assert caught.value.line is not None


BARE_FACE = """
schema_version: 1
bodies:
  one: {kind: mass, mass: 2.0, velocity: 1.0}
  two: {kind: mass, mass: 1.0, velocity: -1.0}
  rod: {kind: rod, length: 0.3, area: 9.0e-4, material: {young: 2.1e11, density: 7900}}
contacts:
  - {between: [one, rod.PLACE]}
  - {between: [SECOND]}
solve: {duration: 1.0e-4, tolerance: 1.0e-3}
"""


@pytest.mark.parametrize(("place", "second"), [("left", "two, rod.left"), ("at(0.1)", "rod.at(0.1), two")])
def test_masses_that_meet_through_one_bare_face_are_refused(tmp_path, place, second):
    file = tmp_path / "case.yaml"
    file.write_text(BARE_FACE.replace("PLACE", place).replace("SECOND", second), encoding="utf-8")
    with pytest.raises(CaseError, match="depend on a coefficient of restitution") as caught:
        il.run(il.load_case(file))
    assert "Give the contact a law with a stiffness, or law" in str(caught.value)


def test_a_face_between_two_stops_with_room_has_a_unique_solution(tmp_path):
    file = tmp_path / "case.yaml"
    text = BARE_FACE.replace("two: {kind: mass, mass: 1.0, velocity: -1.0}", "two: {kind: wall}")
    text = text.replace("one: {kind: mass, mass: 2.0, velocity: 1.0}", "one: {kind: wall}")
    text = text.replace("[one, rod.PLACE]", "[one, rod.at(0.1)], gap: 1.0e-6")
    text = text.replace("[SECOND]", "[rod.at(0.1), two], gap: 1.0e-6").replace("7900}}", "7900}, velocity: 1.0}")
    file.write_text(text, encoding="utf-8")
    assert has_unique_solution(il.load_case(file).simulation())


@pytest.mark.parametrize("kind", ["velocity_complementarity", "impulse_momentum"])
def test_masses_that_part_by_impulses_are_refused_without_a_law_to_refine(tmp_path, kind):
    file = tmp_path / "case.yaml"
    text = """
schema_version: 1
bodies: {a: {kind: mass, mass: 1.0, velocity: 1.0}, b: {kind: mass, mass: 1.0}}
contacts: [{between: [a, b], law: {kind: KIND, restitution: 0.5}}]
solve: {duration: 1.0e-3, tolerance: 1.0e-3}
"""
    file.write_text(text.replace("KIND", kind), encoding="utf-8")
    with pytest.raises(CaseError, match="a hard contact of two masses, or a law of impulses") as caught:
        il.run(il.load_case(file))
    assert "a law with a stiffness" in str(caught.value)


def test_a_choice_is_printed_as_in_the_summary(tmp_path):
    """It was the repr of a record with all laws of the case."""
    choice = il.run(load(tmp_path)).choice
    lines = str(choice).splitlines()
    assert lines[0] == f"tolerance 0.001: {choice.chosen}"
    assert lines[1].startswith("  expected error")
    assert lines[-1].endswith("ms spent choosing")
    assert "AdditionDeletion" not in str(choice)
