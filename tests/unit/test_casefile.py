"""Cases are read in SI, checked, changed by path, and built into scenes."""

from __future__ import annotations

import json
import math
import pickle
import re
from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest

import impactlab as il
from impactlab import Case, CaseError, load_case
from impactlab.contact.penalty import Penalty
from impactlab.integrators.newmark import Newmark
from impactlab.models.finite_element import FiniteElement
from impactlab.scene import ElasticBody, End, Mass, Wall
from impactlab.scene.method import laws_of

CASE = """\
schema_version: 1
title: a test
bodies:
  hammer: {kind: mass, mass: 2.133, velocity: 1.0}
  rod:
    kind: rod
    length: 30 cm
    area: 9 cm^2
    material: {young: 210 GPa, density: 7.9 g/cm^3}
    ends: {left: free, right: {spring: 1 kN/mm}}
contacts:
  - between: [hammer, rod.left]
    law: {kind: penalty, stiffness: 1e9}
solve:
  duration: {round_trips: 3}
methods:
  hard: {contacts.0.law: {kind: addition_deletion}}
  coarse: {solve.model: {kind: modal, modes: 5}, solve.step.points_per_period: 20}
"""


@pytest.fixture
def case(tmp_path):
    return load_case(written(tmp_path, CASE))


def written(folder: Path, text: str, name: str = "test.yaml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_texts_with_units_are_the_very_numbers_in_si(case):
    rod = case.scene().bodies["rod"]
    piece = rod.segments[0]
    assert (piece.length, piece.area, piece.young, piece.density) == (0.3, 9.0e-4, 2.1e11, 7900.0)
    assert rod.right == End("spring", 1.0e6)


def test_numbers_that_yaml_1_1_misreads(tmp_path):
    text = CASE.replace("30 cm", "3e-1").replace("210 GPa", "2.1e11").replace("title: a test", "title: on")
    case = load_case(written(tmp_path, text))
    assert case.scene().bodies["rod"].length == 0.3
    assert case.title == "on"


def test_defaults_are_those_of_the_format(case):
    scene, method = case.simulation()
    assert (method.events, scene.gravity, scene.probes, scene.snapshots) == ("dated", 0.0, (), ())
    assert method.step.points_per_period == 10.0
    assert type(method.integrator).__name__ == "Newmark"
    model = method.models["rod"]
    assert (type(model).__name__, model.elements, model.modes) == ("Modal", 100, 40)
    assert scene.contacts[0].gap == 0.0


def test_scene_holds_bodies_contacts_and_round_trips(case):
    scene = case.scene()
    assert scene.name == "test"
    assert scene.bodies["hammer"] == Mass("hammer", 2.133, 1.0)
    assert scene.contacts[0].name == "hammer|rod.left"
    trip = 2 * 0.3 / math.sqrt(2.1e11 / 7900.0)
    assert scene.round_trip == pytest.approx(trip, rel=1e-15)
    assert scene.duration == pytest.approx(3 * trip, rel=1e-15)


def test_segments_and_walls_and_inner_points(tmp_path):
    text = """\
schema_version: 1
bodies:
  wall: {kind: wall}
  bar:
    kind: rod
    segments:
      - {length: 0.1, area: 1e-4, material: {young: 2e11, density: 8000}}
      - {length: 0.2, area: 2e-4, material: {young: 7e10, density: 2700}}
    velocity: -2
  ball: {kind: mass, mass: 1 g}
contacts:
  - {between: [wall, bar.left], law: {kind: penalty, stiffness: 1e9}}
  - {between: [ball, bar.at(15 cm)], gap: 1 mm, law: {kind: penalty, stiffness: 1e9}}
solve: {duration: 1 ms, round_trips_of: bar}
"""
    scene = load_case(written(tmp_path, text)).scene()
    bar = scene.bodies["bar"]
    assert isinstance(scene.bodies["wall"], Wall)
    assert (len(bar.segments), bar.velocity) == (2, -2.0)
    assert [contact.name for contact in scene.contacts] == ["wall|bar.left", "ball|bar.at(0.15)"]
    assert scene.contacts[1].right.x == 0.15
    assert scene.contacts[1].gap == 1e-3
    assert scene.duration == 1e-3
    assert scene.round_trip == pytest.approx(2 * 0.1 / 5000.0 + 2 * 0.2 / math.sqrt(7e10 / 2700), rel=1e-15)


def test_first_rod_counts_round_trips_unless_named(tmp_path):
    rods = "".join(
        f"  {name}: {{kind: rod, length: {length}, area: 1e-4, material: {{young: 2e11, density: 8000}}}}\n"
        for name, length in (("short", 0.1), ("long", 0.4))
    )
    text = f"schema_version: 1\nbodies:\n{rods}solve:\n  duration: {{round_trips: 1}}\n"
    assert load_case(written(tmp_path, text)).scene().duration == pytest.approx(4e-5)
    named = text + "  round_trips_of: long\n"
    assert load_case(written(tmp_path, named)).scene().duration == pytest.approx(16e-5)


def test_models_of_single_rods(tmp_path):
    text = CASE.replace("  duration", "  models: {rod: {kind: finite_element, elements: 7}}\n  duration")
    method = load_case(written(tmp_path, text)).simulation().method
    assert type(method.models["rod"]).__name__ == "FiniteElement"
    assert method.models["rod"].elements == 7


def test_initial_displacement_as_formula_and_table(tmp_path):
    free = CASE.replace("{spring: 1 kN/mm}", "free")
    formula = load_case(
        written(tmp_path, free.replace("    ends", "    displacement: 1e-5*(1 + cos(pi*x/L))\n    ends"))
    )
    shape = formula.scene().bodies["rod"].displacement
    np.testing.assert_allclose(shape(np.array([0.0, 0.15, 0.3])), [2e-5, 1e-5, 0.0], atol=1e-18)
    table = load_case(
        written(tmp_path, free.replace("    ends", "    displacement: {x: [0, 0.1, 30 cm], u: [1 um, 0, 0]}\n    ends"))
    )
    shape = table.scene().bodies["rod"].displacement
    np.testing.assert_allclose(shape(np.array([0.0, 0.05, 0.2])), [1e-6, 5e-7, 0.0], atol=1e-18)


def test_table_that_does_not_cover_the_rod(tmp_path):
    text = CASE.replace("    ends", "    displacement: {x: [0, 0.1], u: [0, 0]}\n    ends")
    with pytest.raises(CaseError, match=r"the table goes from 0 to 0\.1 m; the rod from 0 to 0\.3 m"):
        load_case(written(tmp_path, text))
    text = CASE.replace("    ends", "    displacement: {x: [0, 0.3, 0.2], u: [0, 0, 0]}\n    ends")
    with pytest.raises(CaseError, match="the places x of the table do not rise"):
        load_case(written(tmp_path, text))


def test_displacement_counts_in_the_first_gap(tmp_path):
    text = CASE.replace("    ends", "    displacement: -1e-5\n    ends")
    with pytest.raises(CaseError, match="the gap is -1e-05 m with the displacement at t = 0"):
        load_case(written(tmp_path, text))
    allowed = text.replace("    law:", "    overlap: allowed\n    law:")
    assert load_case(written(tmp_path, allowed)).scene().contacts[0].overlap_allowed


def test_relative_values_and_their_limits(case):
    changed = case.with_("contacts.0.law.stiffness", {"relative": 0.8})
    assert laws_of(*changed.simulation())[0].stiffness.relative == 0.8
    with pytest.raises(CaseError, match=r"contacts\.0\.law\.stiffness: .*Allowed: .*\{relative: number\}"):
        case.with_("contacts.0.law.stiffness", {"relativ": 0.8})
    with pytest.raises(CaseError, match="is out of range"):
        case.with_("contacts.0.law.stiffness", {"relative": -0.8})


def test_with_merges_blocks_of_one_kind_and_replaces_others(case):
    damped = case.with_("contacts.0.law", kind="penalty", damping=100.0)
    law = laws_of(*damped.simulation())[0]
    assert (law.stiffness, law.damping) == (1e9, 100.0)
    hard = case.with_("contacts.0.law", kind="addition_deletion")
    assert type(laws_of(*hard.simulation())[0]).__name__ == "AdditionDeletion"
    alone = case.with_("contacts.0.law.kind", "addition_deletion")
    assert alone.scene() == hard.scene()
    assert laws_of(*case.simulation())[0].stiffness == 1e9, "the case itself does not change"


def test_with_replaces_a_block_by_a_whole_one(case):
    """A new rod kept the spring at the end of the old one, without a word."""
    rod = il.Rod(length=0.2, diameter=0.02, material="steel")
    changed = case.with_("bodies.rod", rod).scene().bodies["rod"]
    assert (changed.length, changed.left, changed.right) == (0.2, End("free"), End("free"))
    merged = case.with_("bodies.rod", {"length": 0.2}).scene().bodies["rod"]
    assert (merged.length, merged.right) == (0.2, End("spring", 1.0e6))
    contact = il.Contact("hammer", "rod.left", {"kind": "addition_deletion"}, gap=1e-3)
    touched = case.with_("contacts.0", contact).with_("contacts.0", il.Contact("hammer", "rod.left", contact["law"]))
    assert touched.scene().contacts[0].gap == 0.0


@pytest.mark.parametrize(
    ("path", "part", "words"),
    [
        ("contacts.0.law", Penalty(stiffness=1e9), "the law Penalty is given as an object"),
        ("contacts.0.law", {"kind": Penalty, "stiffness": 1e9}, "the law Penalty is given as an object"),
        ("solve.model", FiniteElement(elements=20), "the model FiniteElement is given as an object"),
        ("solve.integrator", Newmark(), "the integrator Newmark is given as an object"),
    ],
)
def test_a_part_given_itself_is_refused_with_the_form_of_a_run(case, path, part, words):
    """A law of one's own in a notebook: "a value of type 'MyLaw'. Give a value that a case file could hold"."""
    with pytest.raises(CaseError) as caught:
        case.with_(path, part)
    assert words in caught.value.text
    word = words.split()[1]
    assert f"il.run(case.simulation().but({word}=" in caught.value.remedy
    with pytest.raises(CaseError, match="a value of type 'object'"):
        case.with_(path, object())


def test_the_remedy_for_a_part_runs(case):
    """The law of the case, put in by hand, gives the run of the case."""
    hand = il.run(case.simulation().but(law=Penalty(stiffness=1e9), integrator=Newmark()))
    written = il.run(case.with_("solve.integrator", {"kind": "newmark"}))
    assert hand.contacts == written.contacts


MATERIAL_OF = {
    "rod": (il.Rod(length=0.3, diameter=0.02, material="steel"), {"young": 2.1e11, "density": 7850.0}),
    "beam": (
        il.Beam(length=0.3, section={"diameter": 0.02}, material="steel", ends={"left": "clamped"}),
        {"young": 2.1e11, "poisson": 0.3, "density": 7850.0},
    ),
    "shaft": (
        il.Shaft(length=0.3, section={"diameter": 0.02}, material="steel", ends={"right": "clamped"}),
        {"young": 2.1e11, "poisson": 0.3, "density": 7850.0},
    ),
}


@pytest.mark.parametrize("kind", MATERIAL_OF)
def test_one_constant_of_a_named_material_is_set_alone(kind):
    """It was answered with "density: this key is missing" at the line of the file where steel stands."""
    body, constants = MATERIAL_OF[kind]
    steps = {"model": {"kind": "modal", "modes": 5}, "integrator": {"kind": "exact_modal"}, "step": {"dt": 1e-6}}
    of = il.Case(bodies={"body": body}, solve={"duration": 1e-4, **steps})
    assert of.with_("bodies.body.material", constants).scene() == of.scene()
    for key in constants:
        value = 0.25 if key == "poisson" else 0.5 * constants[key]
        changed = of.with_(f"bodies.body.material.{key}", value)
        assert changed.scene() == of.with_("bodies.body.material", {**constants, key: value}).scene()
    if kind != "rod":
        stiffer = of.with_("bodies.body.material.shear_modulus", "90 GPa").document.data["bodies"]["body"]["material"]
        assert stiffer["density"] == 7850.0
        assert "poisson" not in stiffer
    assert of.document.data["bodies"]["body"]["material"] == "steel", "the case itself does not change"


def test_a_constant_of_a_named_material_is_an_axis_and_a_parameter(case):
    steel = case.with_settings({"bodies.rod.material": "steel", "solve.model": {"kind": "continuous"}})
    young = "bodies.rod.material.young"
    block = steel.with_("bodies.rod.material", {"young": 2.1e11, "density": 7850.0})
    found, expected = (il.sweep(of, {young: [1e11, 2e11]}, quantities=["impulse"]) for of in (steel, block))
    assert np.array_equal(found["impulse"], expected["impulse"])
    (one,), (other,) = (il.sensitivities(of, [young], ["impulse"]).rows for of in (steel, block))
    assert one.derivative == other.derivative != 0.0


def test_with_replaces_alternatives(case):
    assert case.with_("solve.step", dt=1e-7).simulation().method.step.dt == 1e-7
    assert case.with_("solve.step.courant", 0.9).simulation().method.step.points_per_period is None
    assert case.with_("solve.duration", "1 ms").scene().duration == 1e-3
    assert case.with_("bodies.rod.ends.right", {"mass": 2.0}).scene().bodies["rod"].right == End("mass", 2.0)


def test_an_end_may_carry_a_force(case):
    for written, end in (
        ({"force": "-1.5 kN"}, End("free", force=-1500.0)),
        ({"mass": 2.0, "force": 3.0}, End("mass", 2.0, 3.0)),
        ({"force": 0.0}, End("free")),
    ):
        changed = case.with_("bodies.rod.ends.right", written)
        assert changed.scene().bodies["rod"].right == end
        resolved = changed.resolved()["bodies"]["rod"]["ends"]["right"]
        assert case.with_("bodies.rod.ends.right", resolved).scene().bodies["rod"].right == end


def test_with_fills_in_defaults_where_the_case_is_silent(case):
    assert case.with_("solve.model.modes", 20).simulation().method.models["rod"].elements == 100
    assert case.with_("solve.integrator.beta", 0.3).simulation().method.integrator.beta == 0.3


def test_with_takes_numpy_numbers_and_refuses_objects(case):
    assert case.with_("bodies.rod.length", np.float64(0.5)).scene().bodies["rod"].length == 0.5
    with pytest.raises(CaseError, match=r"a value of type 'object'\. Allowed: numbers, strings"):
        case.with_("bodies.rod.length", object())
    with pytest.raises(CaseError, match="takes a value or fields, not both"):
        case.with_("solve.step", 1.0, dt=1e-7)


def test_methods_replace_blocks(case):
    assert case.method_names == ("base", "hard", "coarse")
    assert case.method("base") is case
    coarse = case.method("coarse")
    model = coarse.simulation().method.models["rod"]
    assert (model.elements, model.modes) == (None, 5), "the old block is replaced, not merged"
    assert coarse.simulation().method.step.points_per_period == 20.0
    assert coarse.method_name == "coarse"
    assert coarse.name == case.name


def test_method_cannot_change_the_methods(tmp_path):
    case = load_case(written(tmp_path, CASE + "  odd: {methods.hard: {}}\n"))
    with pytest.raises(CaseError, match=r"a method cannot change 'methods\.hard'"):
        case.method("odd")


VARIANTS = """\
variants:
  heavy: {bodies.hammer.mass: 20.0}
  short: {bodies.rod.length: 10 cm}
"""


def test_variants_are_other_scenes_with_the_same_methods(tmp_path):
    case = load_case(written(tmp_path, CASE + VARIANTS))
    assert case.variant_names == ("base", "heavy", "short")
    assert case.variant("base") is case
    heavy = case.variant("heavy")
    assert heavy.scene().bodies["hammer"].mass == 20.0
    assert (heavy.name, heavy.label, case.label) == ("test", "test/heavy", "test")
    method = heavy.method("hard")
    assert method.scene().bodies["hammer"].mass == 20.0
    assert (method.label, method.method_name, method.written) == ("test/heavy", "hard", heavy.simulation().method)
    assert heavy.with_("solve.step.dt", 1e-8).label == "test/heavy"


def test_variants_are_refused_where_they_make_no_sense(tmp_path):
    case = load_case(written(tmp_path, CASE + VARIANTS + "  odd: {methods.hard: {}}\n"))
    with pytest.raises(CaseError, match=r"no variant 'heav'\. Did you mean 'heavy'\?"):
        case.variant("heav")
    with pytest.raises(CaseError, match=r"a variant cannot change 'methods\.hard'"):
        case.variant("odd")
    with pytest.raises(CaseError, match=r"Write case\.variant\('heavy'\)\.method\('hard'\)"):
        case.method("hard").variant("heavy")


def test_locate_gives_the_line_of_a_path_or_of_the_key_above(case):
    assert case.locate("contacts.0.law.stiffness") == 13
    assert case.locate("bodies.rod.material.young") == 9
    assert case.locate("bodies.rod.ends.left.nothing") == 10
    assert case.locate("solve.model") == 14
    assert case.locate("") is None
    assert case.with_("solve.step.dt", 1e-7).locate("solve.step.dt") is None


def test_method_values_keep_their_lines(case):
    assert case.method("hard").locate("contacts.0.law.kind") == 17


def test_resolved_values_are_a_case_again(case, tmp_path):
    resolved = case.resolved()
    assert resolved["bodies"]["rod"]["material"]["young"] == 2.1e11
    assert resolved["contacts"][0]["law"] == {"kind": "penalty", "stiffness": 1e9, "damping": 0.0}
    assert resolved["derived"]["rods"]["rod"]["impedance"][0] == pytest.approx(36657.741, rel=1e-7)
    again = {key: value for key, value in resolved.items() if key not in ("methods", "variants", "derived")}
    copy = load_case(written(tmp_path, json.dumps(again), "copy.json"))
    assert copy.scene().bodies == case.scene().bodies
    assert copy.scene().duration == case.scene().duration


@pytest.mark.parametrize("name", ["two_rods", "smith_pile", "hopkinson_ring_up", "two_link_arm", "sphere_on_beam"])
def test_resolved_values_keep_the_round_trip_and_the_links(name):
    """The body of `round_trips_of` was left out, and a link with the gap of 0 that is shown was refused."""
    case = load_case(name)
    again = {key: value for key, value in case.resolved().items() if key not in ("methods", "variants", "derived")}
    copy = Case.from_dict(again)
    assert copy.scene().round_trip == pytest.approx(case.scene().round_trip, rel=1e-12, nan_ok=True)
    assert copy.scene().contacts == case.scene().contacts


@pytest.mark.parametrize(
    ("section", "factor"), [({"width": 0.01, "height": 0.02}, 5 / 6), ({"diameter": 0.02}, 0.9), (None, 0.4)]
)
def test_resolved_values_of_a_beam_give_the_shear_modulus_of_its_material(section, factor):
    """Factor and modulus were given as 1 and their product, which looks like a wrong modulus."""
    section = section or {"area": 1e-4, "inertia": 1e-9, "shear_factor": factor}
    beam = {"kind": "beam", "theory": "timoshenko", "length": 1.0, "section": section}
    beam["material"] = {"young": 2.1e11, "density": 7900.0, "poisson": 0.3}
    case = Case.from_dict({"schema_version": 1, "bodies": {"beam": beam}, "solve": {"duration": 1e-3}})
    shown = case.resolved()["bodies"]["beam"]
    assert shown["material"]["shear_modulus"] == pytest.approx(2.1e11 / 2.6, rel=1e-15)
    assert shown["section"]["shear_factor"] == pytest.approx(factor, rel=1e-15)
    again = Case.from_dict({"schema_version": 1, "bodies": {"beam": shown}, "solve": {"duration": 1e-3}})
    assert again.scene().bodies == case.scene().bodies  # to the bit
    (segment,) = case.scene().bodies["beam"].segments
    assert not any(math.isnan(value) for value in astuple(segment))  # it would differ from itself


@pytest.mark.parametrize("law", ["penalty", "augmented_lagrangian", "khulief_shabana"])
def test_resolved_values_have_relative_options_in_si(law):
    given = {"kind": law, "stiffness": {"relative": 0.5}} | ({"damping": {"relative": 2.0}} if law == "penalty" else {})
    case = load_case("axial_impact").with_settings({"contacts.0.law": given})
    found = case.resolved()["derived"]["laws"]["hammer|rod.left"]
    assert found["stiffness"] == pytest.approx(0.5 * 2.1e11 * 9e-4 / (0.3 / 100), rel=1e-14)  # EA/h
    assert found.get("damping") == (pytest.approx(2.0 * 36657.741, rel=1e-7) if law == "penalty" else None)  # Z
    plain = case.with_settings({"contacts.0.law": {"kind": law, "stiffness": 1e9}})
    assert "stiffness" not in plain.resolved()["derived"].get("laws", {}).get("hammer|rod.left", {})


@pytest.mark.parametrize("name", ["test.toml", "test.json"])
def test_toml_and_json_give_the_same_case(tmp_path, name):
    data = {
        "schema_version": 1,
        "bodies": {"hammer": {"kind": "mass", "mass": 2.133, "velocity": 1.0}, "wall": {"kind": "wall"}},
        "contacts": [{"between": ["hammer", "wall"], "law": {"kind": "penalty", "stiffness": 1e9}}],
        "solve": {"duration": 1e-3, "step": {"dt": 1e-6}},
    }
    toml = """\
schema_version = 1
[bodies]
hammer = {kind = "mass", mass = 2.133, velocity = 1.0}
wall = {kind = "wall"}
[[contacts]]
between = ["hammer", "wall"]
law = {kind = "penalty", stiffness = 1e9}
[solve]
duration = 1e-3
step.dt = 1e-6
"""
    case = load_case(written(tmp_path, toml if name.endswith("toml") else json.dumps(data, indent=1), name))
    assert case.scene().bodies["hammer"] == Mass("hammer", 2.133, 1.0)
    assert laws_of(*case.simulation())[0].stiffness == 1e9
    with pytest.raises(CaseError, match=rf"{name}:\d+: "):
        load_case(
            written(
                tmp_path, (toml if name.endswith("toml") else json.dumps(data, indent=1)).replace("2.133", "-1"), name
            )
        )


def test_ring_of_bodies_is_refused(tmp_path):
    law = "law: {kind: penalty, stiffness: 1e9}"
    text = f"""\
schema_version: 1
bodies: {{a: {{kind: mass, mass: 1}}, b: {{kind: mass, mass: 1}}, c: {{kind: mass, mass: 1}}}}
contacts:
  - {{between: [a, b], {law}}}
  - {{between: [b, c], {law}}}
  - {{between: [c, a], {law}}}
solve: {{duration: 1, step: {{dt: 1e-3}}}}
"""
    with pytest.raises(
        CaseError, match=r"test\.yaml:6: contacts\.2\.between: this contact places 'c' on the left of 'a'"
    ):
        load_case(written(tmp_path, text))


def test_shipped_cases_load_with_all_their_methods():
    cases = sorted((Path(__file__).parents[2] / "cases").glob("*.yaml"))
    assert {path.stem for path in cases} >= {"axial_impact", "free_rod", "rod_on_wall", "two_rods"}
    for path in cases:
        case = load_case(path)
        assert case.title
        assert case.source
        for variant in case.variant_names:
            for name in case.method_names:
                scene = case.variant(variant).method(name).scene()
                assert any(isinstance(body, ElasticBody) or body.changes for body in scene.bodies.values())


def test_a_case_and_a_case_with_settings_survive_pickle(case):
    """As cases go to the worker processes of a bench."""
    for each in (case, case.with_("bodies.hammer.mass", 3.0)):
        assert pickle.loads(pickle.dumps(each)).scene().bodies["hammer"] == each.scene().bodies["hammer"]


def test_a_case_that_comes_with_the_package_is_loaded_by_its_name():
    assert load_case("two_rods").to_yaml() == load_case(Path(__file__).parents[2] / "cases" / "two_rods.yaml").to_yaml()
    with pytest.raises(CaseError, match="no case of that name comes with impactlab"):
        load_case("two_rodes")


def test_the_folder_of_a_case_of_the_package_may_be_left_out():
    assert load_case("tapered_chain").to_yaml() == load_case("granular/tapered_chain").to_yaml()


def test_a_folder_of_results_does_not_hide_the_case_of_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("two_rods").mkdir()
    assert load_case("two_rods").label == "two_rods"
    Path("results").mkdir()
    with pytest.raises(CaseError, match="is a folder, not a file"):
        load_case("results")
    Path("mine.txt").touch()
    with pytest.raises(CaseError, match=r"does not exist\.\n"):
        load_case("mine.yaml")


def test_a_rod_of_one_segment_keeps_the_keys_that_it_was_given():
    piece = {"length": 0.3, "area": 1e-4, "material": "steel"}
    made = Case.from_dict({
        "bodies": {
            "ball": {"kind": "mass", "mass": 0.3, "velocity": 2.0},
            "rod": {"kind": "rod", "segments": [piece]},
        },
        "contacts": [{"between": ["ball", "rod.left"], "law": {"kind": "addition_deletion"}}],
        "solve": {"duration": 1e-3, "model": {"kind": "continuous"}},
    })  # fmt: skip
    assert made.resolved()["bodies"]["rod"]["segments"][0]["length"] == 0.3
    assert made.unit_of("bodies.rod.segments.0.length") == "m"
    assert made.unit_of("solve.duration") == "s"


def test_a_contact_may_be_named_in_a_path():
    law = {"kind": "penalty", "stiffness": 1e8}
    contacts = [{"between": ["ball", "rod.left"], "name": "cushion", "law": law}]
    case = Case.from_dict({
        "bodies": {
            "ball": {"kind": "mass", "mass": 0.3, "velocity": 2.0},
            "rod": {"kind": "rod", "length": 0.3, "area": 1e-4, "material": "steel", "ends": {"right": "clamped"}},
        },
        "contacts": contacts,
        "solve": {"duration": 1e-4, "model": {"kind": "continuous"}},
    })  # fmt: skip
    changed = case.with_("contacts.cushion.law.stiffness", "2e8 N/m")
    assert changed.document.data == case.with_("contacts.0.law.stiffness", "2e8 N/m").document.data
    assert case.unit_of("contacts.cushion.law.stiffness") == "N/m"
    with pytest.raises(
        CaseError, match=re.escape("Did you mean 'cushion'? Allowed: 0, the only one, or a name: cushion")
    ):
        case.with_("contacts.cushon.gap", 1e-5)
    found = il.sweep(case, {"contacts.cushion.law.stiffness": ["1e8 N/m", 2e8]}, quantities=["impulse"])
    assert found["contacts.cushion.law.stiffness"].to_numpy().tolist() == [1e8, 2e8]
    assert il.sensitivities(case, ["contacts.cushion.gap"], ["impulse"]).rows[0].parameter_unit == "m"
    two = [*contacts, {"between": ["rod.at(0.2)", "wall"], "name": "cushion", "gap": 1e-3, "law": law}]
    both = case.with_("bodies.wall", {"kind": "wall"}).with_("contacts", two)
    with pytest.raises(CaseError, match=re.escape("is the name of 2 contacts")):
        both.with_("contacts.cushion.gap", 1e-5)


@pytest.mark.parametrize("velocity", [1e-300, -1e-291])
def test_a_speed_whose_displacements_underflow_is_refused(velocity: float) -> None:
    """A hammer of 1e-300 m/s ran to its end, with other events than one of 1 m/s."""
    with pytest.raises(CaseError, match="Allowed: 0, or a speed of at least 1e-290 m/s"):
        load_case("axial_impact").with_("bodies.hammer.velocity", velocity)


@pytest.mark.parametrize("velocity", [0.0, 1e-290, -1e-200])
def test_small_speeds_and_rest_are_allowed(velocity: float) -> None:
    assert load_case("axial_impact").with_("bodies.hammer.velocity", velocity).scene()
