"""Faults of values given with ``--set``: the key that is wrong is named, and no line of the file is blamed."""

from __future__ import annotations

import itertools
import json
import math
from pathlib import Path

import pytest

import impactlab as il
from impactlab.casefile.edit import in_order, read_setting
from impactlab.casefile.settings import load_with_settings
from impactlab.errors import CaseError, ImpactlabError
from tests.support import PAPER, invoke

SEVERAL = """\
schema_version: 1
bodies:
  hammer: {kind: mass, mass: 2.133, velocity: 1.0, wight: 3}
  rod: {kind: rod, lenght: 3, area: 1 cm^2, material: {young: -1, density: 3}}
solve: {duration: 3}
"""
SEVERAL_PARTS = """\
schema_version: 1
bodies:
  hammer: {kind: mass, mass: 1, velocity: 1}
  rod: {kind: rod, length: 1, area: 1, material: {young: 1, density: 1}}
contacts:
  - {between: [hammer, rod.lft], law: {kind: penalti}}
solve: {duration: 3, integrator: {kind: newmark, beta: -1}}
"""


def refusal(setting: str) -> ImpactlabError:
    """Return the error of the paper's case with one setting of the command line."""
    with pytest.raises(ImpactlabError) as caught:
        il.load_case(PAPER).with_settings([read_setting(setting)], by="--set")
    return caught.value


@pytest.mark.parametrize(
    ("setting", "path", "text"),
    [
        ("bodies.hammer.wight=3", "bodies.hammer.wight", "the key 'wight' is not known here."),
        ("bodies.hammer.velocity=1.0 kg", "bodies.hammer.velocity", "'1.0 kg' has a unit of another dimension"),
        ("bodies.hammer.mass=0", "bodies.hammer.mass", "0 kg is out of range"),
        ("bodies.mass={kind: mass, mass: 1, mas: 2}", "bodies.mass.mas", "Did you mean 'mass'?"),
        ("bodies.mass={kind: mass, mass: 0}", "bodies.mass.mass", "0 kg is out of range"),
        ("bodies.rod.rod=1", "bodies.rod.rod", "the key 'rod' is not known here."),
        ("bodies.beam={kind: beam, beam: 1}", "bodies.beam.beam", "the key 'beam' is not known here."),
        ("bodies.wall={kind: wall, mass: 1}", "bodies.wall.mass", "the key 'mass' is not known here."),
        ("bodies.rod.material.mass=1", "bodies.rod.material.mass", "the key 'mass' is not known here."),
        ("bodies.rod.ends.left={spring: 1 kg}", "bodies.rod.ends.left", "'1 kg' has a unit of another dimension"),
        ("bodies.hammer.kind=mas", "bodies.hammer.kind", "'mas' is not a kind of body. Did you mean 'mass'?"),
        ("contact.0.gap=1", "contact", "Did you mean 'contacts'?"),
        ("contacts.7.gap=0", "contacts.7.gap", "'7' is not an entry of this list."),
        ("contacts.0.law={kind: penalty, stifness: 1}", "contacts.0.law.stifness", "Did you mean 'stiffness'?"),
    ],
)
def test_the_wrong_key_is_named_and_no_line_of_the_file(setting: str, path: str, text: str) -> None:
    error = refusal(setting)
    assert (error.path, error.line, error.given_by) == (path, None, "--set")
    assert text in error.text
    assert str(error).startswith(f"{PAPER}, given by --set: {path}: ")


def test_a_missing_mass_is_named_once(tmp_path: Path) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text("schema_version: 1\nbodies:\n  mass: {kind: mass}\nsolve: {duration: 1}\n", encoding="utf-8")
    with pytest.raises(CaseError, match="this key is missing") as caught:
        il.load_case(file)
    assert caught.value.path == "bodies.mass.mass"


def test_a_value_of_the_file_keeps_its_line_beside_a_setting() -> None:
    case = il.load_case(PAPER).with_settings([read_setting("gravity=0.0")], by="--set")
    error = case.place(CaseError("wrong", path="bodies.hammer.mass"))
    assert error.line is not None
    assert error.given_by == ""


@pytest.mark.parametrize(
    ("text", "paths"),
    [
        (SEVERAL, ("bodies.hammer.wight", "bodies.rod.lenght", "bodies.rod.material.young")),
        (SEVERAL_PARTS, ("contacts.0.between.1", "contacts.0.law.kind", "solve.integrator.beta")),
    ],
)
def test_check_lists_all_faults_of_a_file_at_once(tmp_path: Path, text: str, paths: tuple[str, ...]) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text(text, encoding="utf-8")
    answered = invoke("check", str(file))
    assert answered.exit_code == 2
    for path in paths:
        assert f"{path}: " in answered.stderr
    assert "Also " not in answered.stderr


def test_a_refusal_shows_three_more_faults_in_a_line_each(tmp_path: Path) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text(SEVERAL.replace("solve:", "gravty: 1\nmetrix: []\nsolve:"), encoding="utf-8")
    with pytest.raises(CaseError) as caught:
        il.load_case(file)
    also = [line for line in str(caught.value).splitlines() if line.startswith("Also ")]
    assert len(also) == 3
    assert all(f"Also {file}:" in line for line in also)
    assert not any("?." in line for line in also)
    hidden = len(caught.value.others) - 3
    assert hidden > 0
    assert f"... and {hidden} more fault" in str(caught.value)
    assert "`impactlab check FILE` lists all" in str(caught.value)


def test_check_lists_each_of_several_wrong_probes_once(tmp_path: Path) -> None:
    """The second probe was listed with the first, and again."""
    file = tmp_path / "bad.yaml"
    file.write_text(
        "schema_version: 1\n"
        "bodies: {ball: {kind: mass, mass: 1}, wall: {kind: wall}}\n"
        "contacts: [{between: [ball, wall], gap: -1e-3, law: {kind: hertz, stiffness: 1e9}}]\n"
        "probes: [{body: ball, at: 2, quantity: velocity}, {body: ball, quantity: strain}]\n"
        "solve: {duration: 1e-3}\n",
        encoding="utf-8",
    )
    answered = invoke("check", str(file))
    lines = [line for line in answered.stderr.splitlines() if f"{file}:" in line]
    assert len(lines) == 3, lines  # the gap and two probes
    assert "Also " not in answered.stderr


def test_a_lone_surrogate_is_refused_with_its_place(tmp_path: Path) -> None:
    file = tmp_path / "bad.json"
    file.write_text(
        '{"schema_version": 1, "title": "\\ud800", "bodies": {}, "solve": {"duration": 1}}', encoding="utf-8"
    )
    answered = invoke("check", str(file))
    assert answered.exit_code == 2
    assert "title: '\\ud800' contains an incomplete Unicode character (lone surrogate)" in answered.stderr


def test_a_formula_in_braces_without_quotes_is_pointed_to_them() -> None:
    """The message was: expected '<document start>', but found ('<scalar>',)."""
    with pytest.raises(ImpactlabError) as refused:
        read_setting("contacts.0.gap={i} um")
    assert refused.value.remedy == "Quote a formula in braces: --set 'contacts.0.gap=\"{1e-6*i} m\"'."


SETTINGS = [
    (
        ("contacts.0.law.stiffness=1e9", "contacts.0.law.kind=penalty", "contacts.0.law.damping=3"),
        '"stiffness": 1000000000.0',
    ),
    (("solve.model.elements=50", "solve.model.kind=finite_element", "solve.model={mass: lumped}"), '"elements": 50'),
    (("solve.integrator.beta=0.3", "solve.integrator=newmark"), '"beta": 0.3'),
]


@pytest.mark.parametrize(("settings", "shown"), SETTINGS, ids=["law", "model", "integrator"])
def test_the_order_of_settings_has_no_effect(settings: tuple[str, ...], shown: str) -> None:
    """A kind after its neighbours dropped them without a word."""
    found = []
    for order in itertools.permutations(settings):
        given = [part for setting in order for part in ("--set", setting)]
        done = invoke("check", str(PAPER), "--json", *given)
        assert done.exit_code == 0, done.output
        found.append(json.loads(done.stdout))
    assert all(each == found[0] for each in found)
    resolved = found[0]["resolved"]
    block = resolved["contacts"][0]["law"] if settings[0].startswith("contacts") else resolved["solve"]
    assert shown in json.dumps(block)


def test_settings_that_replace_each_other_keep_their_order() -> None:
    given = [("solve.step.dt", 1e-7), ("solve.tolerance", 1e-3), ("contacts.0.law.kind", "penalty"), ("gravity", 0.0)]
    again = [*given, ("contacts.0.law.kind", "hertz"), ("solve.step", {"dt": 2e-7})]
    assert in_order(given, {}) == given
    assert [again.index(each) for each in in_order(again, {})] == [5, 0, 1, 2, 3, 4]


def test_a_new_kind_without_its_keys_is_refused_as_it_takes_none_of_the_old_ones(tmp_path: Path) -> None:
    """The message named the line of the key that the new kind had dropped."""
    case = il.load_case("rounded_ends").with_("contacts.0.law", {"kind": "penalty", "stiffness": 2e8})
    with pytest.raises(CaseError, match="this key is missing") as raised:
        case.with_("contacts.0.law.kind", "hertz")
    assert (raised.value.path, raised.value.line) == ("contacts.0.law.stiffness", None)
    assert raised.value.remedy.endswith(
        "without the keys of the old kind: give the kind and its keys together, as one block."
    )
    assert "given by with_()" in str(raised.value)


WITH_TOLERANCE = """\
schema_version: 1
bodies:
  hammer: {kind: mass, mass: 2 kg, velocity: 1 m/s}
  rod: {kind: rod, length: 0.3 m, diameter: 2 cm, material: steel, ends: {right: clamped}}
contacts:
  - {between: [hammer, rod.left], law: {kind: penalty, stiffness: 1e9}}
solve: {duration: 0.1 ms, tolerance: 1e-3}
"""


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        (["solve.integrator.kind=newmark"], "solve.integrator.kind"),
        (["bodies.hammer.mass=1", "solve.step.dt=1e-6", "solve.model.kind=modal"], "solve.step.dt"),
        (["solve={integrator: {kind: newmark}}"], "solve"),
        (["bodies.hammer.mass=1"], ""),
        (["solve.duration=1e-4"], ""),
        (["solve.step.dt=1e-6", "solve.tolerance=1e-2"], ""),
    ],
)
def test_a_setting_that_takes_the_place_of_a_tolerance_is_named(settings, named, tmp_path):
    """The error is not bounded any more: the user of the file may not know."""
    (tmp_path / "case.yaml").write_text(WITH_TOLERANCE, encoding="utf-8")
    result = invoke("check", str(tmp_path / "case.yaml"), *(w for s in settings for w in ("--set", s)))
    assert result.exit_code == 0
    notes = [line for line in result.stderr.splitlines() if line.startswith("note: ")]
    expected = [f"note: --set {named} takes the place of solve.tolerance 0.001: "] if named else []
    assert [note[: len(start)] for note, start in zip(notes, expected, strict=True)] == expected


@pytest.mark.parametrize(
    ("words", "option"),
    [
        (["sensitivities", "axial_impact", "--parameters", "bodies.hammer.velocty"], "--parameters"),
        (["choose", "axial_impact", "--tolerance", "1e-9"], "--tolerance"),
        (["uncertainty", "axial_impact", "--vary", "bodies.hammer.mass=uniform(-1 kg, 1 kg)"], "--vary"),
    ],
)
def test_a_value_of_an_option_is_not_attributed_to_a_function_of_python(words: list[str], option: str) -> None:
    result = invoke(*words)
    assert result.exit_code == 2
    assert f"given by {option}: " in result.output
    assert "with_()" not in result.output
    assert "the sweep" not in result.output


@pytest.mark.parametrize(
    "words",
    [
        ["sensitivities", "axial_impact", "--parameters", "bodies.hamer.mass"],
        ["sweep", "axial_impact", "--over", "bodies.hamer.mass=1,2"],
        ["uncertainty", "axial_impact", "--vary", "bodies.hamer.mass=normal(1 kg, 1 %)"],
    ],
)
def test_a_number_of_an_unknown_body_is_refused_by_the_name_of_the_body(words: list[str]) -> None:
    result = invoke(*words)
    assert result.exit_code == 2
    assert "bodies.hamer.mass: the case has no body 'hamer'. Did you mean 'hammer'?" in result.output
    assert "Bodies of this case: hammer, rod." in result.output


REPLACED = """\
schema_version: 1
bodies:
  hammer: {kind: mass, mass: -2.133, velocity: 1.0}
  rod: {kind: rod, length: 0.3, area: 9.0e-4, material: steel}
contacts:
  - {between: [hammer, rod.left], law: {kind: penalti, stiffness: 1.0e9}}
solve: {duration: 1.0e-4, tolerance: 3}
methods: {soft: {contacts.0.law: {kind: penalty, stiffness: 1.0e8}, solve.tolerance: null}}
variants: {fast: {bodies.hammer.velocity: 2.0}}
"""
MASS, LAW = ("--set", "bodies.hammer.mass=2"), ("--set", "contacts.0.law.kind=addition_deletion")


@pytest.fixture
def replaced(tmp_path: Path) -> str:
    """Return a case file with three faults, in values that the tests replace."""
    file = tmp_path / "replaced.yaml"
    file.write_text(REPLACED, encoding="utf-8")
    return str(file)


@pytest.mark.parametrize(
    "options",
    [
        (*MASS, *LAW, "--set", "solve.tolerance=1e-3"),
        (*MASS, *LAW, "--set", "solve.tolerance=1e-3", "--variant", "fast"),
        (*MASS, "--method", "soft"),
        (*MASS, "--method", "soft", "--set", "contacts.0.law.stiffness=2e8", "--variant", "fast"),
    ],
    ids=["base", "variant", "method", "method and variant"],
)
def test_faults_of_values_that_are_replaced_are_no_faults(replaced: str, options: tuple[str, ...]) -> None:
    """The file was refused before any value was put in place."""
    answered = invoke("check", replaced, "--json", *options)
    assert answered.exit_code == 0, answered.output
    hammer = json.loads(answered.stdout)["resolved"]["bodies"]["hammer"]
    assert hammer == {"kind": "mass", "mass": 2.0, "velocity": 2.0 if "fast" in options else 1.0}


@pytest.mark.parametrize("command", ["check", "run"])
@pytest.mark.parametrize("options", [("--method", "soft"), ("--method", "soft", "--variant", "fast")])
def test_faults_of_values_that_a_method_replaces_are_no_faults(
    tmp_path: Path, command: str, options: tuple[str, ...]
) -> None:
    """Without ``--set`` the case as written was checked, and refused."""
    file = tmp_path / "replaced.yaml"
    file.write_text(REPLACED.replace("mass: -2.133", "mass: 2.133"), encoding="utf-8")
    assert invoke(command, str(file)).exit_code == 2
    answered = invoke(command, str(file), "--json", *options)
    assert answered.exit_code == 0, answered.output


def test_faults_beside_replaced_values_are_refused_with_their_lines(replaced: str) -> None:
    answered = invoke("check", replaced, *MASS)
    assert answered.exit_code == 2
    assert "replaced.yaml:6: contacts.0.law.kind: 'penalti' is not a contact law" in answered.stderr
    assert "replaced.yaml:7: solve.tolerance: 3 is out of range" in answered.stderr
    assert "bodies.hammer.mass" not in answered.stderr


def test_a_method_of_a_faulty_block_of_methods_is_refused_by_the_fault(tmp_path: Path) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text(REPLACED.replace("soft: {contacts.0.law:", "soft: 3, hard: {contacts.0.law:"), encoding="utf-8")
    answered = invoke("check", str(file), *MASS, "--method", "soft")
    assert answered.exit_code == 2
    assert "bad.yaml:8: methods.soft: " in answered.stderr


def test_a_method_with_settings_is_measured_against_the_laws_as_written() -> None:
    """Its own penalty must not be the reference of a method, where the law as written is a hard contact."""
    case, _ = load_with_settings(PAPER, [("bodies.hammer.mass", 2.0)], method="penalty")
    assert case.written is not None
    assert {type(law).__name__ for law in case.written.laws.values()} == {"WaveIdentification"}


def test_values_inside_a_method_and_a_variant_are_set_before_they_are_chosen(tmp_path: Path) -> None:
    """They had no effect on the run with that method, and `compare` refused the method: its duration was missing."""
    text = PAPER.read_text(encoding="utf-8") + "variants:\n  heavy: {bodies.hammer.mass: 4.0}\n"
    file = tmp_path / "case.yaml"
    file.write_text(text, encoding="utf-8")
    settings = [
        read_setting(text)
        for text in (
            "methods.penalty_fe.solve.step.courant=0.25",
            "methods.penalty_fe.contacts.0.law={stiffness: 2e9}",
            "variants.heavy.bodies.hammer.mass=8",
        )
    ]
    step = 0.25 * (0.3 / 100) / math.sqrt(2.1e11 / 7900)  # of courant h/c
    chosen, _ = load_with_settings(file, settings, variant="heavy", method="penalty_fe")
    later = load_with_settings(file, settings)[0].variant("heavy").method("penalty_fe")
    in_python = il.load_case(file).with_settings(settings).variant("heavy").method("penalty_fe")
    for case in (chosen, later, in_python):
        assert case.resolved()["bodies"]["hammer"]["mass"] == 8.0
        assert case.resolved()["contacts"][0]["law"] == {"kind": "penalty", "stiffness": 2e9, "damping": 0.0}
        assert il.run(case).dt == pytest.approx(step, rel=1e-12)
    whole, _ = load_with_settings(file, [("methods.penalty_fe.solve.step", {"dt": 1e-7})], method="penalty_fe")
    assert whole.resolved()["solve"]["step"] == {"dt": 1e-7}  # one of several forms, which do not merge
    with pytest.raises(CaseError, match="is not a path"):
        load_with_settings(file, [("methods.penalty_fe..step", 1.0)], method="penalty_fe")


def test_a_value_of_a_body_that_is_not_there_names_the_nearest_one() -> None:
    """``bodies.hamer.mass=1`` was asked for a kind."""
    case = il.load_case(PAPER)
    for change in (
        lambda: load_with_settings(PAPER, [("bodies.hamer.mass", 1.0)]),
        lambda: case.with_("bodies.hamer.mass", 1.0),
    ):
        with pytest.raises(CaseError, match=r"no body 'hamer'\. Did you mean 'hammer'\?"):
            change()
    other = [("bodies.other.mass", 1.0), ("bodies.other.kind", "mass")]
    for made in (
        load_with_settings(PAPER, other)[0],
        case.with_settings(other[::-1]),
        case.with_("bodies.other", kind="mass", mass=1.0),
    ):
        assert made.resolved()["bodies"]["other"]["mass"] == 1.0
