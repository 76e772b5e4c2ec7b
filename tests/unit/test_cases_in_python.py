"""Cases made in Python: the same blocks, defaults, units and errors as in a file."""

from __future__ import annotations

import ast
import copy
import inspect
import math
import pickle
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.casefile.document import parse_yaml
from impactlab.casefile.schema import CaseBlock, ProbeBlock
from impactlab.casefile.values.materials import MATERIALS
from impactlab.report.summary import summarise

CASES = sorted((Path(__file__).parents[2] / "cases").rglob("*.yaml"))
SOLVE = {"model": {"kind": "continuous"}, "duration": {"round_trips": 3}}


def struck(**rod: Any) -> il.Case:
    """Return a hammer on a rod with these keys in place of its own."""
    keys = {"length": "30 cm", "area": "9 cm^2", "material": "steel"} | rod
    return il.Case(
        name="struck",
        bodies={"hammer": il.Mass("1 kg", velocity=1.0), "rod": il.Rod(**{k: v for k, v in keys.items() if v != ""})},
        contacts=[il.Contact("hammer", "rod.left", {"kind": "addition_deletion"})],
        solve=SOLVE,
    )


STRUCK: dict[str, Any] = {
    "bodies": {"hammer": il.Mass("1 kg", velocity=1.0), "rod": il.Rod(length=0.3, area=9e-4, material="steel")},
    "contacts": [il.Contact("hammer", "rod.left", {"kind": "addition_deletion"})],
    "solve": SOLVE,
}
TEXT = """
schema_version: 1
bodies:
  hammer: {kind: mass, mass: 1 kg, velocity: 1.0}
  rod: {kind: rod, length: 30 cm, area: 9 cm^2, material: {young: 210 GPa, density: 7850}}
contacts:
  - {between: [hammer, rod.left], law: {kind: addition_deletion}}
solve: {model: {kind: continuous}, duration: {round_trips: 3}}
"""


def test_every_key_of_a_case_and_of_a_probe_is_an_argument_by_name() -> None:
    """So that `help`, completion and mypy know them, as they know those of bodies and contacts."""
    for kind, block in ((il.Case, CaseBlock), (il.Probe, ProbeBlock)):
        arguments = inspect.signature(kind.__init__).parameters
        assert block.model_fields.keys() - {"schema_version", "repeat"} <= arguments.keys()
        for name in block.model_fields.keys() - {"schema_version", "repeat"}:
            assert re.search(rf"^(\w+, )*{name}\b", inspect.getdoc(kind) or "", re.MULTILINE), name


def test_a_probe_in_python_is_that_of_a_file() -> None:
    keys = {"bandwidth": "200 kHz", "rate": "2 MHz", "noise": "2 um/m", "seed": 1, "bits": 14, "range": "2000 um/m"}
    block = {"body": "rod", "at": "0.15 m", "quantity": "strain", "length": "3 mm", **keys}
    assert il.Probe("rod", "0.15 m", "strain", length="3 mm", **keys) == block
    probed = il.Case(**STRUCK, probes=[il.Probe("rod", 0.15, "strain")], gravity=9.81, title="A hammer")
    assert probed.scene().probes[0].channel == "strain:rod@0.15"
    assert (probed.scene().gravity, probed.title) == (9.81, "A hammer")
    with pytest.raises(il.CaseError, match=r"the key .bit. is not known here\. Did you mean 'bits'"):
        il.Probe("rod", 0.15, "strain", bit=14)
    with pytest.raises(il.CaseError, match=r"'gravitiy' is not known here\. Did you mean 'gravity'"):
        il.Case(**STRUCK, gravitiy=9.81)


def test_python_and_file_give_the_same_bits(tmp_path: Path) -> None:
    file = tmp_path / "struck.yaml"
    file.write_text(TEXT)
    times = np.linspace(0.0, 1e-4, 300)
    for model in ({"kind": "continuous"}, {"kind": "finite_element", "elements": 20}):
        runs = [il.run(case.with_("solve.model", model)) for case in (struck(), il.load_case(file))]
        assert runs[0].events == runs[1].events
        forces = [run.evaluate(times, "force:hammer|rod.left") for run in runs]
        assert forces[0].max() > 0.0
        assert np.array_equal(*forces)


@pytest.mark.parametrize("file", CASES, ids=lambda file: file.stem)
def test_a_case_written_as_yaml_is_read_again(file: Path, tmp_path: Path) -> None:
    case = il.load_case(file)
    written = parse_yaml(case.to_yaml()).data
    beside = "file:" in file.read_text(encoding="utf-8")  # a table in a file beside the case stands in its text
    assert (written == case.document.data) != beside
    again = il.Case.from_dict(written, case.name)
    assert repr(again.built) == repr(case.built)  # as a text, in which a number that is not known equals itself
    assert again.method_names == case.method_names


def test_texts_that_look_like_numbers_stay_texts() -> None:
    titled = struck().with_("title", "1e5")
    assert parse_yaml(titled.to_yaml()).data["title"] == "1e5"
    assert max(map(len, titled.to_yaml().splitlines())) <= 110


@pytest.mark.parametrize(
    ("keys", "path", "words"),
    [
        ({"lenght": 1.0}, "Rod.lenght", "Did you mean 'length'"),
        ({"length": "3 kg"}, "bodies.rod.length", "another dimension"),
        ({"area": -1.0}, "bodies.rod.area", "out of range"),
        ({"material": "stel"}, "bodies.rod.material", "Did you mean 'steel'"),
        ({"material": {"young": 2e11}}, "bodies.rod.material.density", "missing"),
        ({"diameter": 0.02}, "bodies.rod.diameter", "area, diameter given"),
        ({"area": "", "width": 0.02}, "bodies.rod.width", "width given"),
        ({"area": ""}, "bodies.rod.area", "missing"),
        ({"area": object()}, "bodies.rod.area", "type 'object'"),
    ],
)
def test_errors_are_those_of_a_file(keys: dict[str, Any], path: str, words: str) -> None:
    with pytest.raises(il.CaseError) as caught:
        struck(**keys)
    assert caught.value.path == path
    assert words in str(caught.value)


def test_a_section_may_be_given_by_its_sizes() -> None:
    round_one = struck(area="", diameter="20 mm").scene().elastic["rod"].segments[0]
    assert round_one.area == pytest.approx(math.pi * 1e-4, rel=1e-15)
    rectangle = struck(area="", width="2 cm", height="3 cm").scene().elastic["rod"].segments[0]
    assert rectangle.area == pytest.approx(6e-4, rel=1e-15)
    pieces = [
        {"length": 0.1, "diameter": 0.02, "material": "steel"},
        {"length": 0.1, "area": 1e-4, "material": "brass"},
    ]
    rod = struck(length="", area="", material="", segments=pieces).scene().elastic["rod"]
    assert [piece.area for piece in rod.segments] == pytest.approx([math.pi * 1e-4, 1e-4])
    assert rod.segments[1].young == MATERIALS["brass"].young
    with pytest.raises(il.CaseError, match=r"segments\.0\.area: this key is missing"):
        struck(length="", area="", material="", segments=[{"length": 0.1, "material": "steel"}])


@pytest.mark.parametrize("name", MATERIALS)
def test_materials_are_solids_with_a_source(name: str) -> None:
    constants = MATERIALS[name]
    assert 1500.0 < math.sqrt(constants.young / constants.density) < 6000.0  # speed of bar waves in solids [m/s]
    assert 0.15 < constants.poisson < 0.4
    assert len(constants.source) > 10


def test_a_name_gives_each_kind_of_body_its_own_constants() -> None:
    bodies = {
        "ball": il.Mass(0.1, velocity=1.0),
        "beam": il.Beam(length=1.0, section={"diameter": 0.01}, material="brass", theory="timoshenko"),
    }
    law = {"kind": "penalty", "stiffness": 1e6}
    case = il.Case(bodies=bodies, contacts=[il.Contact("ball", "beam.at(0.5)", law)], solve={"duration": 1e-4})
    beam = case.scene().elastic["beam"].segments[0]
    shear = MATERIALS["brass"].young / (2.0 * (1.0 + MATERIALS["brass"].poisson))
    assert beam.shear_stiffness == pytest.approx(0.9 * shear * beam.area)
    shaft = il.Shaft(length=1.0, section={"diameter": 0.01}, material="brass")
    turned = il.Case(
        bodies={"ball": bodies["ball"], "shaft": shaft},
        contacts=[il.Contact("ball", "shaft.left", {"kind": "addition_deletion"}, lever_arm=0.1)],
        solve=SOLVE,
    )
    speed = math.sqrt(shear / MATERIALS["brass"].density)
    assert turned.scene().elastic["shaft"].segments[0].wave_speed == pytest.approx(speed)


@pytest.mark.parametrize(
    "solve",
    [
        {"model": {"kind": "continuous"}},
        {"model": {"kind": "finite_element", "elements": 20}},
        {"model": {"kind": "modal", "elements": 20, "modes": 8}, "integrator": {"kind": "adaptive"}},
    ],
    ids=lambda solve: solve["model"]["kind"],
)
def test_histories_are_copied_and_pickled(solve: dict[str, Any]) -> None:
    case = struck().with_("solve", solve).with_("snapshots", [2e-5, 9e-5])
    case = case.with_("contacts.0.law", {"kind": "penalty", "stiffness": 1e9}).with_("bodies.wall", {"kind": "wall"})
    soft = {"kind": "penalty", "stiffness": 1e8}  # an adaptive scheme serves no law with a memory
    yields = {"kind": "elastic_plastic", "stiffness": 1e8, "yield_force": 1e3}
    bolt = {"between": ["rod.right", "wall"], "law": soft if "integrator" in solve else yields}
    case = case.with_("bodies.rod.ends.right", "free").with_("contacts", [*case.document.data["contacts"], bolt])
    history = il.run(case)
    for other in (pickle.loads(pickle.dumps(history)), copy.deepcopy(history), copy.copy(history)):
        assert other.events == history.events
        times = np.linspace(0.0, history.duration, 100)
        for channel in history.channels():
            assert np.array_equal(other.evaluate(times, channel), history.evaluate(times, channel), equal_nan=True)
        for quantity in ("stress", "velocity"):
            fields = [each.field("rod", 9e-5, quantity).values for each in (other, history)]
            assert np.abs(fields[1]).max() > 0.0
            assert np.array_equal(*fields)
        assert other.energy.final_error == history.energy.final_error
        assert other.links == history.links
        assert history.impulse_of("rod.right|wall") != 0.0
        assert [other.impulse_of(name) for name in history.method.laws] == [
            history.impulse_of(name) for name in history.method.laws
        ]
        assert summarise(case.label, other, None) == summarise(case.label, history, None)


PAGE = (Path(__file__).parents[2] / "docs" / "cases-in-python.md").read_text(encoding="utf-8")


def test_the_page_runs_as_printed(tmp_path: Path) -> None:
    names: dict[str, Any] = {}
    [first, second] = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    exec(first, names)
    steel = MATERIALS["steel"]
    speed = math.sqrt(steel.young / steel.density)
    assert 80e-6 < 0.5 / speed < 120e-6 < 0.5 / speed + 0.3 / speed < 160e-6
    assert names["strain"] == pytest.approx([0.0, 5.0 / (2.0 * speed), 0.0, 0.0], rel=1e-12, abs=1e-18)
    runs = [pickle.loads(pickle.dumps(il.run(names["case"].with_("bodies.striker.velocity", v)))) for v in (2.0, 4.0)]
    peaks = [max(span.peak_force for span in run.contacts) for run in runs]
    assert peaks[1] == pytest.approx(2.0 * peaks[0], rel=1e-12)
    script = tmp_path / "page.py"
    script.write_text(f"{first}\n{second}    print(peaks)\n", encoding="utf-8")
    printed = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True).stdout
    assert ast.literal_eval(printed) == pytest.approx(peaks, rel=1e-12)


def test_the_page_lists_every_material() -> None:
    rows = [[cell.strip(" `") for cell in row.split("|")[1:-1]] for row in PAGE.splitlines() if row.startswith("| `")]
    found = {name: (float(young) * 1e9, float(poisson), float(density), source)
             for name, young, poisson, density, source in rows}  # fmt: skip
    assert found.keys() == MATERIALS.keys()
    for name, constants in MATERIALS.items():
        assert found[name][:3] == pytest.approx(constants[:3], rel=1e-9)
        assert found[name][3] == constants.source


@pytest.mark.parametrize(
    "call",
    [
        lambda path: il.run(path),
        lambda path: il.compare(path),
        lambda path: il.sweep(path, {"bodies.hammer.mass": [1.0]}),
        lambda path: il.sensitivities(path, ["bodies.hammer.mass"]),
        lambda path: il.uncertainty(path, {"bodies.hammer.mass": "uniform(1, 2)"}),
        lambda path: il.fit(path, [], {"bodies.hammer.mass": (1.0, 2.0)}),
    ],
)
def test_a_path_in_place_of_a_case_is_refused_with_the_call_that_reads_it(call):
    with pytest.raises(il.CaseError, match="takes a Case, not") as refused:
        call("my_case.yaml")
    assert "il.load_case('my_case.yaml')" in refused.value.remedy


def test_a_dictionary_in_place_of_a_case_is_refused_with_the_call_that_makes_it():
    with pytest.raises(il.CaseError, match="takes a Case, not a dict") as refused:
        il.run({"bodies": {}})
    assert "il.Case.from_dict(" in refused.value.remedy


def test_one_name_stands_for_a_list_of_one():
    case = il.load_case("axial_impact").method("continuous")
    one = il.sweep(case, {"bodies.hammer.mass": 2.0}, quantities="impulse")
    assert one.impulse.shape == (1, 1)
    assert il.sensitivities(case, "bodies.hammer.mass", "impulse").find("impulse", "bodies.hammer.mass").value > 0.0
    assert [row.name for row in il.compare(case, "continuous").rows] == ["continuous"]
    with pytest.raises(il.CaseError, match="methods: None is a NoneType, not a text"):
        il.compare(case, [None])


def test_settings_and_dictionaries_of_another_kind_are_refused():
    case = il.load_case("axial_impact")
    for wrong in (
        lambda: case.with_(5, 1),
        lambda: case.with_settings("solve.duration=1"),
        lambda: case.with_settings([("a",)]),
    ):
        with pytest.raises(il.CaseError, match="the settings are not paths with values"):
            wrong()
    with pytest.raises(il.CaseError, match="takes the keys of a case as a dictionary, not 'bodies: "):
        il.Case.from_dict("bodies: {}")


def test_times_and_channel_in_the_wrong_order_are_refused_as_such():
    case = il.load_case("axial_impact")
    for method in ("continuous", "finite_element"):
        history = il.run(case.method(method))
        with pytest.raises(il.ImpactlabError, match="not a time"):
            history.evaluate("force:hammer|rod.left", [1e-5])
    with pytest.raises(il.CaseError, match="takes the path of a file, not a dict"):
        il.load_case({"bodies": {}})


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: il.Mass(mass=1, speed=1), "Mass.speed: the key 'speed' is not known here. Did you mean 'velocity'?"),
        (lambda: il.Rod(length=1, rho=7800), "In a case it is 'density'. It stands inside 'material'"),
        (lambda: il.Contact("a", "b", stifness=2), "Contact.stifness: the key 'stifness' is not known here."),
        (lambda: il.Link(length=1, mass=1, colour="red"), "Link.colour: the key 'colour' is not known here."),
    ],
)
def test_unknown_keys_are_refused_where_they_are_written(made, said):
    """They were accepted until the case was built."""
    with pytest.raises(il.CaseError) as refused:
        made()
    assert said in str(refused.value)
    assert "Allowed: " in refused.value.remedy
    assert repr(refused.value) == f"CaseError({str(refused.value).splitlines()[0]!r})"


@pytest.mark.parametrize(
    ("where", "given", "said"),
    [
        ("solve", "end_time", "Did you mean 'duration'?"),
        ("solve", "time", "Did you mean 'duration'?"),
        ("solve", "T_end", "Did you mean 'duration'?"),
        ("solve", "timestep", "In a case it is 'dt'. It stands inside 'step': write step: {dt: ..., ...}."),
        ("solve", "dx", "In a case it is 'elements' (their number). It stands elsewhere: write solve: {model: "),
        ("rod", "time_step", "In a case it is 'dt'. It stands elsewhere: write solve: {step: {dt: ...}}."),
        ("solve", "gravity", "It stands beside 'solve', not inside it."),
        ("solve", "snapshots", "It stands beside 'solve', not inside it."),
        ("", "t_end", "It stands inside 'solve': write solve: {duration: ..., ...}."),
        ("rod", "E", "In a case it is 'young'. It stands inside 'material': write material: {young: ..., ...}."),
        ("rod", "youngs_modulus", "write material: {young: ..., ...}."),
        ("rod", "density", "It stands inside 'material': write material: {density: ..., ...}."),
        ("rod", "radius", "Did you mean 'diameter' (twice the radius)?"),
        ("rod", "v0", "Did you mean 'velocity'?"),
        ("probe", "x", "Did you mean 'at'?"),
    ],
)
def test_keys_as_other_programs_call_them_name_those_of_a_case(where, given, said):
    rod = {"kind": "rod", "length": 1, "diameter": 0.02, "material": "steel"}
    probe = {"body": "rod", "at": 0.5, "quantity": "stress"}
    blocks = {"bodies": {"rod": rod}, "solve": {"duration": 1e-3, "tolerance": 1e-3}, "probes": [probe]}
    {"": blocks, "solve": blocks["solve"], "rod": rod, "probe": probe}[where][given] = 1
    with pytest.raises(il.CaseError) as refused:
        il.Case.from_dict(blocks)
    assert said in refused.value.text


def test_a_path_that_begins_with_the_name_of_a_body_or_a_contact_names_its_whole():
    bodies = {"ball": il.Mass(1.0, velocity=1.0), "wall": il.Wall()}
    pad = il.Contact("ball", "wall", {"kind": "hertz", "stiffness": 1e9}, name="pad")
    case = il.Case(bodies=bodies, contacts=[pad], solve={"duration": 1e-3, "tolerance": 1e-3})
    for path, said in (("ball.mass", "write bodies.ball."), ("pad.law.stiffness", "write contacts.pad.")):
        with pytest.raises(il.CaseError) as refused:
            case.with_(path, 2.0)
        assert said in refused.value.text
    assert case.with_("contacts.pad.law.stiffness", 2.0).resolved()["contacts"][0]["law"]["stiffness"] == 2.0


@pytest.mark.parametrize("given", ["x", "g", "radius", "rho"])
def test_an_unknown_key_of_a_law_is_not_taken_for_a_key_of_another_block(given):
    """`x` was answered with "In a case it is 'at'", the place of a probe."""
    bodies = {"ball": il.Mass(1.0, velocity=1.0), "wall": il.Wall()}
    law = {"kind": "hertz", "stiffness": 1e9, given: 1.0}
    solve = {"duration": 1e-3, "integrator": {"kind": "midpoint"}, "step": {"dt": 1e-6}}
    with pytest.raises(il.CaseError) as refused:
        il.Case(bodies=bodies, contacts=[il.Contact("ball", "wall", law)], solve=solve).simulation()
    assert f"the key '{given}' is not known here" in refused.value.text
    assert "In a case" not in refused.value.text
    assert "stiffness" in refused.value.remedy
