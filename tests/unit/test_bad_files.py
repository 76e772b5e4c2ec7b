"""Bad files through the command line: each leaves with code 2 and one message, without a traceback, in little time."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support import CASES, invoke
from tests.unit.case_texts import PAPER as GOOD

BEAM = (
    "kind: beam\n    length: 1\n    section: {width: 1e-2, height: 1e-2}\n    material: {young: 2e11, density: 7900}\n"
)
ROD = GOOD[GOOD.index("kind: rod") : GOOD.index("contacts:")]
METHOD = GOOD[GOOD.index("    law:") :]
ADAPTIVE = """\
    law: {kind: penalty, stiffness: 1e9}
solve: {duration: 1e-4, model: {kind: finite_element, elements: 20000}, integrator: {kind: adaptive}}
"""
DELAYED = """\
    law: {kind: hertz, stiffness: 1e9}
solve: {duration: 1e-12, model: {kind: continuous}, step: {dt: 1e-14}}
"""
TAKEN = f"""\
    law: {{kind: addition_deletion}}
solve: {{duration: 1e-6, model: {{kind: finite_element, elements: 20000}}, step: {{dt: 1e-8}}}}
snapshots: [{", ".join(["1e-8"] * 10_000)}]
"""
HUGE, TINY = "1.0e300", "1.0e-300"

# Text replaced, its replacement, words of the message: numbers beyond the limits of computation.
SCALES = [
    ("length: 0.3", f"length: {HUGE}", "bodies.rod.length: 1e+300 m is beyond the numbers a case may hold. Allowed: "),
    ("length: 0.3", f"length: {TINY}", "bodies.rod.length: 1e-300 m is beyond"),
    ("length: 0.3", "length: 5e-324", "bodies.rod.length: 4.94066e-324 m is beyond"),
    ("area: 9.0e-4", f"area: {HUGE}", "bodies.rod.area: 1e+300 m2 is beyond"),
    ("young: 2.1e11", f"young: {TINY}", "bodies.rod.material.young: 1e-300 Pa is beyond"),
    ("young: 2.1e11", "young: 1e300 GPa", "bodies.rod.material.young"),
    ("density: 7900", f"density: {HUGE}", "bodies.rod.material.density: 1e+300 kg/m3 is beyond"),
    ("density: 7900", f"density: 7900, viscosity: {HUGE}", "bodies.rod.material.viscosity: 1e+300 Pa s is beyond"),
    ("mass: 2.133", f"mass: {HUGE}", "bodies.hammer.mass: 1e+300 kg is beyond"),
    ("velocity: 1.0", f"velocity: -{HUGE}", "bodies.hammer.velocity: -1e+300 m/s is beyond"),
    ("gap: 0.0", f"gap: {HUGE}", "contacts.0.gap: 1e+300 m is beyond the numbers a case may hold. Allowed: sizes up"),
    ("title: a test", f"gravity: {HUGE}", "gravity: 1e+300 m/s2 is beyond"),
    ("left: free", f"left: {{spring: {HUGE}}}", "bodies.rod.ends.left: 1e+300 N/m is beyond"),
    ("left: free", f"left: {{mass: {TINY}}}", "bodies.rod.ends.left: 1e-300 kg is beyond"),
    ("left: free", f"left: {{force: {HUGE}}}", "bodies.rod.ends.left: 1e+300 N is beyond"),
    ("area: 9.0e-4", f"area: 9.0e-4\n    damping: {{stiffness: {HUGE}}}", "bodies.rod.damping.stiffness: 1e+300 s"),
    ("area: 9.0e-4", "area: 9.0e-4\n    displacement: 1e200*x", "is not a number up to 1e+12 m everywhere on the rod"),
    ("{round_trips: 1}", HUGE, "solve.duration: 1e+300 s is beyond"),
    ("{round_trips: 1}", f"{{round_trips: {HUGE}}}", "solve.duration: 1e+300 is beyond"),
    ("points_per_period: 10", "dt: 1.0e-300", "solve.step.dt: 1e-300 s is beyond"),
    ("points_per_period: 10", "dt: 5.0e-324", "solve.step.dt: 4.94066e-324 s is beyond"),
    ("points_per_period: 10", "dt: 1.0e-20", "solve.step: 1.16e+16 steps of 1e-20 s are too many"),
    ("points_per_period: 10", f"points_per_period: {HUGE}", "solve.step.points_per_period: 1e+300 is beyond"),
    ("points_per_period: 10", f"courant: {TINY}", "solve.step.courant: 1e-300 is beyond"),
    ("{kind: addition_deletion}", f"{{kind: penalty, stiffness: {HUGE}}}", "contacts.0.law.stiffness: 1e+300 N/m is"),
    ("{kind: addition_deletion}", f"{{kind: hertz, stiffness: {HUGE}}}", "contacts.0.law.stiffness: 1e+300 "),
    ("young: 2.1e11", "young: 1e-9", "bodies.rod.material: the wave speed sqrt(E/rho) is 3.55784e-07 m/s. Allowed: "),
    ("length: 0.3\n    area: 9.0e-4", "length: 1e12\n    area: 1e18", "bodies.rod: the mass rho A L is 7.9e+33 kg. "),
    (ROD, BEAM.replace("2e11", TINY), "bodies.rod.material.young"),
    (ROD, BEAM + f"    tension: {HUGE}\n", "bodies.rod.tension: 1e+300 N is beyond"),
]

# The same for sizes: what takes more memory than is allowed, or more steps.
SIZES = [
    ("elements: 20", "elements: 10000000", "solve.model.elements: 10000000 elements of 'rod' take about"),
    ("elements: 20", "elements: 1000000, order: 12", "1000000 elements of order 12 of 'rod' take about"),
    ("elements: 20", "elements: 1" + "0" * 30, "solve.model.elements"),
    (METHOD, ADAPTIVE, "20000 elements under an adaptive integrator, whose matrices are full, of 'rod' take about"),
    (METHOD, TAKEN, "snapshots: 10000 snapshots of 40003 numbers take about 6.4 GB. Allowed: 1.8 GB"),
    (METHOD, DELAYED, "steps in the transit of 'rod' take about"),
]

# Whole files: text, ending of the name, words of the message.
FILES = [
    ("a number", "3", ".yaml", "a case has keys"),
    ("a list", "[]", ".yaml", "a case has keys"),
    ("a surrogate as a key", '{"\\ud800": 1}', ".json", "is not a plain word"),
    ("control characters", "a: \x01", ".yaml", "not YAML"),
    ("lists without end", "schema_version: 1\nx: [" + "1," * 30_000 + "1]", ".yaml", "more than 25000 values"),
    ("JSON without end", '{"x": [' + "1," * 30_000 + "1]}", ".json", "more than 25000 values"),
    ("TOML without end", "x = [" + "1," * 30_000 + "1]", ".toml", "more than 25000 values"),
    ("lines without end", "#\n" * 60_000, ".yaml", "the file has 60000 lines; at most 50000 are allowed"),
    ("a binary file", "\x00\x01\x02", ".yaml", "not YAML"),
    ("another ending", GOOD, ".txt", "is not a case file by its ending. Allowed: .yaml, .yml, .toml, .json"),
]


def refused(arguments: list[str], words: str) -> None:
    """Check that a command line is refused with code 2, by a message that holds some words, and no traceback."""
    answered = invoke(*arguments)
    message = answered.stderr.replace("\n", " ")
    assert answered.exit_code == 2, (answered.exit_code, message)
    assert words in message, message
    assert "Traceback" not in message
    assert "report it" not in message
    assert len(max(message.split(), key=len)) < 200  # no number of 300 digits


@pytest.mark.parametrize(("old", "new", "words"), [*SCALES, *SIZES], ids=lambda text: text[:40].replace("\n", " "))
def test_numbers_and_sizes_beyond_the_limits_are_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in GOOD
    file = tmp_path / "bad.yaml"
    file.write_text(GOOD.replace(old, new, 1), encoding="utf-8")
    refused(["check", str(file)], words)
    refused(["run", str(file)], words)


@pytest.mark.parametrize(("name", "text", "ending", "words"), FILES, ids=[each[0] for each in FILES])
def test_files_that_hold_no_case_are_refused(tmp_path: Path, name: str, text: str, ending: str, words: str) -> None:
    file = tmp_path / f"bad{ending}"
    file.write_text(text, encoding="utf-8")
    refused(["check", str(file)], words)


def test_the_good_file_is_accepted(tmp_path: Path) -> None:
    file = tmp_path / "good.yaml"
    file.write_text(GOOD, encoding="utf-8")
    answered = invoke("check", str(file), "--json")
    assert answered.exit_code == 0
    assert json.loads(answered.stdout)["methods"]["base"]["status"] == "accepted"


@pytest.mark.parametrize("path", ["/dev/zero", "/dev/null", ".", "no/such/file.yaml"])
def test_folders_and_devices_are_refused(path: str) -> None:
    refused(["check", path], "case file")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--time-limit", "inf"], "--time-limit"),
        (["--time-limit", "nan"], "--time-limit"),
        (["--time-limit", "1e300"], "--time-limit"),
        (["--repeats", "100000000"], "--repeats"),
        (["--repeats", "1" + "0" * 30], "--repeats"),
        (["--jobs", "1000000"], "--jobs"),
        (["--from", "/dev/zero"], "'/dev/zero' is not a regular file"),
        (["--from", "."], "is a folder"),
        (["--grid", "/dev/zero"], "/dev/zero"),
    ],
)
def test_a_bench_with_endless_options_is_refused(tmp_path: Path, arguments: list[str], words: str) -> None:
    refused(["bench", str(CASES / "axial_impact.yaml"), "--out", str(tmp_path / "out"), *arguments], words)


@pytest.mark.parametrize("text", [b"\x1f\x8b\x08\x00garbage that is no deflate stream", b"a,b\n\x00\n", b"\xff\xfe"])
def test_a_table_of_garbage_is_refused(tmp_path: Path, text: bytes) -> None:
    table = tmp_path / "table.csv"
    table.write_bytes(text)
    refused(["bench", "--from", str(table), "--out", str(tmp_path / "out")], "table")


def test_the_limit_of_memory_can_be_raised(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "large.yaml"
    file.write_text(GOOD.replace("elements: 20", "elements: 40000"), encoding="utf-8")
    monkeypatch.setenv("IMPACTLAB_MEMORY", "1e8")
    refused(["check", str(file)], "take about 22.4 MB. Allowed: 10 MB")
    monkeypatch.setenv("IMPACTLAB_MEMORY", "a lot")
    refused(["check", str(file)], "IMPACTLAB_MEMORY='a lot' is not a valid memory limit")
    file.write_text(GOOD.replace("points_per_period: 10}", "dt: 1.0e-12}\n  records: 10000000"), encoding="utf-8")
    monkeypatch.setenv("IMPACTLAB_MEMORY", "1e9")
    refused(["check", str(file)], "solve.records: 1e+07 records of 9 numbers take about 1.44 GB. Allowed: 900 MB")
    monkeypatch.delenv("IMPACTLAB_MEMORY")
    assert invoke("check", str(file)).exit_code == 0


@pytest.mark.parametrize("name", ["a" * 3000, "a" * 3000 + ".yaml"])
@pytest.mark.parametrize("command", [["run"], ["check"], ["run", "--set", "gravity=1"]])
def test_names_that_are_too_long_for_a_file(name: str, command: list[str]) -> None:
    """They were answered with an OSError and exit code 1."""
    refused([*command, name], "cannot be a path")
