"""Bad input is refused with one clear message: file, line, what was given, what is allowed, what to do.

Every refusal leaves with code 2, shows no traceback and writes nothing.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from impactlab.errors import closest
from tests.support import invoke
from tests.unit.case_texts import PAPER

MODES = PAPER.replace("finite_element, elements: 20", "modal, elements: 20, modes: 20")
PROBES = "probes:\n  - {body: rod, at: 0.0, quantity: displacement}\n"
GOOD = MODES.replace("addition_deletion", "wave_identification") + PROBES

ALIAS_BOMB = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{this}: &{this} [{','.join(['*' + before] * 9)}]\n" for before, this in zip("abcdefg", "bcdefgh", strict=True)
)

# what is replaced, by what, line of the message, texts of the message; arrangements are in test_casefile_check,
# ranges of the options of parts in test_bad_input_parts
EDITS = [
    (
        "wave_identification",
        "penalti",
        14,
        "contacts.0.law.kind: 'penalti' is not a contact law.",
        "Did you mean 'penalty'?",
        "Installed: addition_deletion, ",
        ", penalty, ",
    ),
    (
        "kind: rod",
        "kind: rodd",
        6,
        "'rodd' is not a kind of body. Did you mean 'rod'? Allowed: beam, link, mass, rod, shaft, wall",
    ),
    (
        "kind: rod",
        "kind: beam",
        8,
        "the key 'area' is not known here",
        "Allowed: damping, displacement, ends, kind, length, material, repeat, rotation, section",
    ),
    (
        "length: 0.3",
        "lenght: 0.3",
        7,
        "bodies.rod.lenght: the key 'lenght' is not known here.",
        "Did you mean 'length'?",
        "Allowed: area, bore, damping, diameter, displacement, ends, height, kind, length, material, repeat, rotation, "
        "segments, velocity, width.",
    ),
    ("contacts:", "contact:", 11, "contact: the key 'contact' is not known here. Did you mean 'contacts'?"),
    ("  step:", "  stepp:", 19, "solve.stepp: the key 'stepp' is not known", "Did you mean 'step'?"),
    ("length: 0.3", "length: -0.3", 7, "bodies.rod.length: -0.3 m is out of range. Allowed: a number in m above 0"),
    ("mass: 2.133", "mass: 0", 4, "bodies.hammer.mass: 0 kg is out of range."),
    ("gap: 0.0", "gap: .nan", 13, ".nan is not a finite number"),
    ("gap: 0.0", "gap: -.inf", 13, "-.inf is not a finite number"),
    ("gap: 0.0", "gap: 1e999", 13, "'1e999' is beyond any number"),
    ("gap: 0.0", "gap: 1" + "0" * 350, 13, "contacts.0.gap: a whole number of 351 digits is not a finite number"),
    ("gap: 0.0", "gap: wide", 13, "contacts.0.gap: 'wide' is not a number with a unit"),
    ("gap: 0.0", "gap: true", 13, "contacts.0.gap: true is not allowed here. Allowed: a number in m"),
    ("gap: 0.0", "gap: [0.0]", 13, "contacts.0.gap: a list of 1 is not allowed here."),
    (
        "    area: 9.0e-4",
        "    area: 9.0e-4\n    length: 0.4",
        9,
        "bodies.rod.length: the key 'length' is given twice (first in line 7)",
        "Keep one of the two.",
    ),
    (
        "area: 9.0e-4",
        "diameter: 20",
        8,
        "bodies.rod.diameter: 20 m across a rod of 0.3 m",
        "Check the units, as in '20 mm'. If the body is meant to be so short, give its area.",
    ),
    ("area: 9.0e-4", "width: 10 mm\n    height: 1.51", 9, "bodies.rod.height: 1.51 m"),
    ("    area: 9.0e-4\n", "", 5, "bodies.rod.area: this key is missing"),
    ("  duration: {round_trips: 1}\n", "", 15, "solve.duration: this key is missing"),
    (
        "{round_trips: 1}",
        "{round_trips: 1, round_trips_of: rod}",
        16,
        "round_trips_of stands beside duration, in solve",
    ),
    (
        "length: 0.3",
        "length: '0,3 m'",
        7,
        "'0,3 m' is not a number with a unit; write the decimal point as '.'",
        "such as '30 cm'",
    ),
    ("length: 0.3", "length: 9**9**9 m", 7, "'9**9**9 m' is not a number with a unit"),
    ("length: 0.3", "length: 9**9**9", 7, "'9**9**9' is not a number with a unit"),
    ("length: 0.3", "length: 3 kg", 7, "'3 kg' has a unit of another dimension; allowed: a number in m"),
    ("2.1e11", "210 gpa", 9, "'210 gpa' has a unit that is not known (letters matter: 'GPa', not 'gpa')"),
    (
        "points_per_period: 10",
        "points_per_period: 10 m",
        19,
        "solve.step.points_per_period: '10 m' is not a number. Allowed: a plain number",
    ),
    (
        "[hammer, rod.left]",
        "[hamer, rod.left]",
        12,
        "there is no body 'hamer'. Did you mean 'hammer'?",
        "Bodies of this case: hammer, rod.",
    ),
    ("[hammer, rod.left]", "[hammer, rod]", 12, "'rod' is a rod, so the face must be named."),
    (
        "[hammer, rod.left]",
        "[rod.left, hammer]",
        12,
        "'rod.left' faces away from 'hammer'",
        "a is on the left of b",
        "Swap the two, [hammer, rod.left]",
    ),
    ("[hammer, rod.left]", "[hammer, \"rod.at(__import__('os'))\"]", 12, "does not name a face"),
    (
        "right: clamped}",
        "right: {clamped: 1, force: 3}}",
        10,
        "'clamped' is not a valid support for an end of a rod.",
        "Allowed: free, clamped, infinite, {spring: N/m}",
        "or one of the three blocks with a force in it",
    ),
    ("right: clamped}", "right: {force: much}}", 10, "'much' is not a number with a unit"),
    ("right: clamped}", "right: {force: .inf}}", 10, "is not a finite number"),
    ("right: clamped}", "right: {force: 3 kg}}", 10, "'3 kg'", "N"),
    ("right: clamped}", "right: {mass: 1, spring: 2}}", 10, "mass and spring are given for one end.", "{mass: kg}"),
    ("gap: 0.0", "gap: -1e-3", 13, "the gap is -0.001 m: the faces overlap before the run.", "overlap: allowed"),
    (
        "hammer: {kind: mass, mass: 2.133, velocity: 1.0}",
        "hammer: {kind: wall, velocity: 1.0}",
        4,
        "bodies.hammer.velocity: the key 'velocity' is not known here.",
        "Allowed: kind, repeat.",
    ),
    ("right: clamped", "right: clampd", 10, "'clampd' is not an end of a rod. Did you mean 'clamped'?"),
    ("right: clamped", "right: {spring: -1}", 10, "-1 N/m is out of range. Allowed: a number in N/m above 0"),
    (
        "{points_per_period: 10}",
        "{points_per_period: 10, dt: 1e-7}",
        19,
        "solve.step: dt, points_per_period given together",
        "Give exactly one",
    ),
    ("{points_per_period: 10}", "{dt: 0}", 19, "solve.step.dt: 0 s is out of range."),
    ("at: 0.0", "at: 0.4", 21, "probes.0.at: x = 0.4 m lies outside the body 'rod'"),
    (
        "quantity: displacement",
        "quantity: temperature",
        21,
        "probes.0.quantity: 'temperature' is not allowed here.",
        "Allowed: displacement, velocity, strain, stress, force",
    ),
    ("probes:", "snapshots: [1.0]\nprobes:", 20, "snapshots.0: 1 s lies after the end of the run."),
    ("[hammer, rod.left]", "[hammer]", 12, "contacts.0.between.1: this key is missing"),
    ("[hammer, rod.left]", "[hammer, rod.left, rod.right]", 12, "a contact is between two faces"),
    ("[hammer, rod.left]", "hammer", 12, "'hammer' is given where a list is needed"),
    (
        "{left: free, right: clamped}",
        "free",
        10,
        "'free' is given where a block of keys is needed",
        "its keys: left, right",
    ),
    ("title: a test", 'title: "\\e[31m"', 2, "title: '\\x1b[31m' holds characters that are not text"),
    ("title: a test", '"\\e[31m": 1', 2, "the key '\\x1b[31m' is not a plain word"),
    ("title: a test", "k" * 500 + ": 1", 2, "kkk... is not a plain word of at most 120 characters"),
    ("{round_trips: 1}", "{round_trip: 1}", 16, "Allowed: a number in s, or {round_trips: number}"),
    ("schema_version: 1", "schema_version: 2", 1, "schema_version: 2 is not allowed here. Allowed: 1"),
    ("schema_version: 1", "schema_version: true", 1, "schema_version: true is not allowed here. Allowed: 1"),
    ("law: {kind: wave_identification}", "law: penalty", 14, "Write {kind: penalty}"),
    ("law: {kind: wave_identification}", "law: {stiffness: 1e9}", 14, "has no kind."),
    (
        "  step:",
        "  models: {hammer: {kind: modal}}\n  step:",
        19,
        "'hammer' is a mass; only rods, beams and shafts have a model",
    ),
    ("  hammer: {", "  3hammer: {", 4, "'3hammer' is not a name. Allowed: letters, digits, _ and -"),
    ("area: 9.0e-4", "area: 9.0e-4\n    displacement: __import__('os').getcwd()", 9, "the formula calls"),
    ("area: 9.0e-4", "area: 9.0e-4\n    displacement: x.__class__", 9, "the formula holds 'x.__class__'"),
    (
        "area: 9.0e-4",
        "area: 9.0e-4\n    displacement: 9**999999999",
        9,
        "the exponent 999999999 is too large; at most 20 is allowed",
    ),
    ("area: 9.0e-4", "area: 9.0e-4\n    displacement: 9**9**9", 9, "exponents are plain numbers"),
    ("area: 9.0e-4", "area: 9.0e-4\n    displacement: 1/x", 9, "is not a finite number everywhere on the rod"),
    ("area: 9.0e-4", "area: 9.0e-4\n    displacement: 1e-6*x", 9, "a clamped end stays at 0"),
    ("title: a test", "title: !!python/object/apply:os.system [id]", 2, "the tag", "Remove it."),
    ("title: a test", "title: &a test", 2, "the anchor &a"),
    ("title: a test", "title: *a", 2, "the alias *a"),
    ("title: a test", ALIAS_BOMB, 2, "the anchor &a"),
    ("title: a test", "title: " + "[" * 5000 + "]" * 5000, 2, "nested deeper than 24 levels"),
    ("title: a test", "title: [1, 2", 3, "not YAML"),
    ("title: a test", "title: part 1: a test", 2, "Put the text in quotes: title: 'part 1: a test'."),
    ("probes:", "---\nprobes:", 20, "a second document begins here"),
]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(arguments: list[str], folder: Path) -> str:
    """Run a command that must be refused and return its message."""
    before = sorted(path.name for path in folder.rglob("*"))
    result = invoke(*([*arguments, "--out", "results"] if arguments[0] != "check" else arguments))
    assert result.exit_code == 2, result.output
    assert "Traceback" not in result.output
    assert result.stdout == ""
    assert sorted(path.name for path in folder.rglob("*")) == before
    return result.stderr


@pytest.mark.parametrize("edit", EDITS, ids=lambda edit: edit[1][:30])
def test_refused_with_file_line_and_remedy(folder, edit):
    old, new, line, *texts = edit
    assert old in GOOD
    (folder / "bad.yaml").write_text(GOOD.replace(old, new, 1))
    message = refused(["run", "bad.yaml"], folder)
    assert message.startswith(f"bad.yaml:{line}: "), message
    for text in texts:
        assert text in message, message
    assert len(message) < 900, "a message must stay short"


def test_a_pair_that_cannot_work_is_refused_before_the_first_step(folder):
    """`test_simulate` has the pairs, and what is said of each."""
    (folder / "bad.yaml").write_text(GOOD)
    message = refused(["run", "bad.yaml", "--set", "solve.events=located"], folder)
    assert message.startswith("bad.yaml")
    assert "solve.events" in message
    assert "newmark" in message


def test_missing_file_names_a_neighbour(folder):
    (folder / "impact.yaml").write_text(GOOD)
    message = refused(["run", "imapct.yaml"], folder)
    assert "imapct.yaml: the case file does not exist. Did you mean 'impact.yaml'?" in message


def test_folder_in_place_of_file(folder):
    (folder / "case.yaml").mkdir()
    assert "is a folder, not a file" in refused(["run", "case.yaml"], folder)


def test_empty_file(folder):
    (folder / "case.yaml").write_text("")
    assert "case.yaml:1: the file holds nothing" in refused(["run", "case.yaml"], folder)


def test_larger_than_a_megabyte(folder):
    (folder / "case.yaml").write_text(GOOD + "#" * 1_000_001)
    assert "larger than 1000000 bytes" in refused(["run", "case.yaml"], folder)


def test_not_text(folder):
    (folder / "case.yaml").write_bytes(b"\xff\xfe\x00schema")
    assert "is not UTF-8" in refused(["run", "case.yaml"], folder)
    (folder / "case.yaml").write_bytes(b"title: \x00\x01")
    assert "not YAML" in refused(["run", "case.yaml"], folder)


def test_a_missing_file_names_no_unlike_neighbour(folder):
    """Endings alone made names alike: 'neg.yaml' for 'missing.yaml'."""
    (folder / "neg.yaml").write_text(GOOD)
    (folder / "a.yaml").write_text(GOOD)
    for name in ("missing.yaml", "b.yaml"):
        assert "Did you mean" not in refused(["check", name], folder)


def test_a_tab_that_indents_is_named(folder):
    (folder / "case.yaml").write_text("schema_version: 1\nbodies:\n\thammer: {kind: mass}\n")
    message = refused(["run", "case.yaml"], folder)
    assert "case.yaml:3: not YAML" in message
    assert "Indent with spaces, not tabs." in message


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ("solve.duration=2e400", "good.yaml, given by --set: solve.duration: '2e400' is beyond any number"),
        ("contacts.0.law={kind: penalty", "contacts.0.law: not YAML: a bracket is not closed: } is missing"),
        ("contacts.0.law={1e-6*i} m", "contacts.0.law: not YAML"),
        ("bodies.hammer.force=3", "bodies.hammer.force: a force over time acts on an end of a rod"),
        ("contacts.0.between=[hammer, rod@0.1]", "Did you mean 'rod.at(0.1)'?"),
        ("contacts={between: [hammer, rod.left]}", "Write it as one entry of a list"),
    ],
)
def test_a_value_of_set_is_refused_with_the_file_and_the_option(folder, setting, says):
    (folder / "good.yaml").write_text(GOOD)
    message = refused(["run", "good.yaml", "--set", setting], folder)
    assert message.startswith("good.yaml, given by --set: ")
    assert says in message


def test_a_key_without_a_space_after_its_colon(folder):
    """One message: the key is not missing as well."""
    (folder / "bad.yaml").write_text(GOOD.replace("velocity: ", "velocity:", 1))
    message = refused(["check", "bad.yaml"], folder)
    assert "has no space after its colon. Did you mean 'velocity'?" in message
    (folder / "bad.yaml").write_text(GOOD.replace("mass: ", "mass:", 1))
    message = refused(["check", "bad.yaml"], folder)
    assert "has no space after its colon. Did you mean 'mass'?" in message
    assert "missing" not in message


def test_a_method_of_a_contact_that_is_missing(folder):
    """It was said that `contacts: {0: ...}` is not a list, which stands nowhere in the file."""
    text = "schema_version: 1\nbodies: {a: {kind: mass, mass: 1}}\nsolve: {duration: 1}\n"
    (folder / "bad.yaml").write_text(text + "methods:\n  soft: {contacts.0.gap: 1}\n")
    assert "contacts.0.gap: the case has no contacts" in refused(["check", "bad.yaml", "--method", "soft"], folder)


def test_a_folder_is_no_case_file(folder):
    assert "is a folder, not a file" in refused(["run", "."], folder)


def test_long_values_are_cut(folder):
    (folder / "case.yaml").write_text(GOOD.replace("gap: 0.0", "gap: " + "z" * 100_000))
    message = refused(["run", "case.yaml"], folder)
    assert "zzz..." in message
    assert len(message) < 400


def test_settings_are_refused_alike(folder):
    (folder / "case.yaml").write_text(GOOD)
    for setting, text in [
        ("solve.step.dt", "is not PATH=VALUE"),
        ("solve.stepp.dt=1e-7", "Did you mean 'step'?"),
        ("contacts.3.law.kind=penalty", "'3' is not an entry of this list. Allowed: 0, the only one"),
        ("solve..dt=1", "is not a path"),
        ("bodies.rod.length=.nan", "not a finite number"),
        ("bodies.rod.length=&a 3", "the anchor &a"),
        ("title.x=1", "title"),
    ]:
        message = refused(["run", "case.yaml", "--set", setting], folder)
        assert text in message, message


def test_unknown_method_names_those_there_are(folder):
    (folder / "case.yaml").write_text(GOOD + "methods:\n  fine: {solve.model.modes: 10}\n")
    message = refused(["run", "case.yaml", "--method", "fin"], folder)
    assert "the case has no method 'fin'. Did you mean 'fine'?" in message
    assert "Methods of this case: base, fine." in message
    assert "has no method 'fin'" in refused(["compare", "case.yaml", "--methods", "base,fin"], folder)


@pytest.mark.parametrize(
    ("name", "names", "meant"),
    [
        ("Bar", ["rod", "bar"], "bar"),
        ("bar", ["mass", "rod"], "rod"),
        ("fixed", ["free", "clamped"], "clamped"),
        ("spring", ["hertz", "penalty"], "penalty"),
        ("force:b|a", ["force:b|c", "force:a|b"], "force:a|b"),
        ("strain", ["stress:rod@0.5", "strain:rod@0.5"], "strain:rod@0.5"),
        ("peak", ["impulse", "peak_force"], "peak_force"),
        ("acceleration", ["rotation", "velocity"], None),
    ],
)
def test_the_name_that_is_meant(name, names, meant):
    assert closest(name, names) == (f" Did you mean {meant!r}?" if meant else "")


def test_fault_in_a_method_names_the_line_of_the_method(folder):
    (folder / "case.yaml").write_text(GOOD + "methods:\n  soft:\n    contacts.0.law: {kind: penalty, stifness: 1e9}\n")
    message = refused(["run", "case.yaml", "--method", "soft"], folder)
    assert message.startswith("case.yaml:24: contacts.0.law.stifness: the key 'stifness' is not known")
    assert "Did you mean 'stiffness'?" in message


def test_failure_as_json_is_one_document(folder):
    (folder / "case.yaml").write_text(GOOD.replace("length: 0.3", "length: -0.3"))
    result = invoke("run", "case.yaml", "--json", "--out", "results")
    assert result.exit_code == 2
    document = json.loads(result.stdout)
    assert document["schema_version"] == 1
    assert document["case"] == "case"
    assert document["status"] == "refused"
    error = document["error"]
    assert (error["kind"], error["file"], error["line"], error["path"]) == (
        "CaseError",
        "case.yaml",
        7,
        "bodies.rod.length",
    )
    assert "-0.3 m is out of range" in error["text"]
    assert error["remedy"]
    assert not (folder / "results").exists()
