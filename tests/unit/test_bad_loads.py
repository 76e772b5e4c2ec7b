"""Forces over time that are refused: one message each, with the line, what was given, what is allowed, what to do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import impactlab as il
from impactlab.casefile.starter import case_named, write_copy
from impactlab.errors import CaseError

CASE = """schema_version: 1
bodies:
  rod:
    kind: rod
    length: 1.0
    area: 1.0e-4
    material: steel
    ends:
      left: {force: FORCE}
solve: {duration: 1.0e-3, model: {kind: finite_element, elements: 10}, step: {dt: 1.0e-6}}
"""
NAMED = "{file: head.csv, t: time, f: force}"
EDITS = [
    (
        "{t: [0, 2.0e-3, 1.0e-3], f: [0, 1, 0]}",
        "time 3 of the table, 0.001 s, is before the one before",
        "rising times",
    ),
    ("{t: [0, 1.0e-3, 1.0e-3], f: [0, 1, 0]}", "time 3 of the table, 0.001 s, repeats the one before", "rising times"),
    ("{t: [0, 1.0e-3], f: [0, 1, 0]}", "2 times t and 3 forces f", "one f for each t"),
    ("{t: [0], f: [0]}", "1 sample;", "at least 2"),
    ("{t: [0, soon], f: [0, 1]}", "t 2 of the table is 'soon'", "a number in s"),
    ("{t: 3, f: [0, 1]}", "t of the table is 3", "list of numbers in s"),
    (
        "{t: [0, 5.0e-4], f: [0, 10]}",
        "the samples end at 0.0005 s, and the run lasts 0.001 s",
        "a first or last sample of 0",
    ),
    ("{t: [1.0e-4, 1.0e-2], f: [1, 10]}", "the samples begin at 0.0001 s", "a first or last sample of 0"),
    ("{t: [0, 1], g: [0, 1]}", "is not a valid force over time", "a formula of t", "{t: [...], f: [...]}"),
    ("1e4/t", "not a finite number at t = 0 s", "Correct the formula"),
    ("1e4*tan(t)", "the formula calls 'tan'", "functions allowed: abs, cos, exp, sin, sqrt"),
    ("1e4*x*t", "the formula names 'x'", "allowed: numbers, t, pi"),
    ("1e4*t*(", "is not a formula", "allowed: numbers, t, pi"),
    ("{file: ../head.csv, t: time, f: force}", "'../head.csv' lies outside the folder of the case", "beside the case"),
    ("{file: /etc/hostname, t: time, f: force}", "lies outside the folder of the case", "beside the case"),
    ("{file: heads.csv, t: time, f: force}", "there is no file 'heads.csv'", "put it there"),
    ("{file: empty.csv, t: time, f: force}", "empty.csv is empty", "names the columns"),
    ("{file: head.csv, t: time, f: forces}", "head.csv has no column 'forces'", "Did you mean 'force'?", "Columns: "),
    ("{file: words.csv, t: time, f: force}", "line 3 of words.csv has 'much' under 'force'", "give a finite number"),
    ("{file: short.csv, t: time, f: force}", "line 3 of short.csv has nothing under 'force'", "leave that line out"),
    ("{file: nan.csv, t: time, f: force}", "line 3 of nan.csv has 'nan' under 'force'", "leave that line out"),
    ("{file: back.csv, t: time, f: force}", "time 3 of back.csv, 0.0005 s, is before the one before", "rising times"),
    ("{file: units.csv, t: time, f: force}", "column 'force [mm]' of units.csv", "a number in N"),
    ("{file: two.csv, t: time, f: force}", "two.csv has 2 columns 'force': force [N], force [kN]", "different names"),
    ("{file: one.csv, t: time, f: force}", "one.csv has 1 sample;", "at least 2"),
]
FILES = {
    "head.csv": "time [ms],force [kN]\n0,0\n0.5,2\n1,1\n",
    "empty.csv": "\n",
    "words.csv": "time,force\n0,0\n1e-3,much\n",
    "short.csv": "time,force\n0,0\n1e-3\n",
    "nan.csv": "time,force\n0,0\n1e-3,nan\n",
    "back.csv": "time,force\n0,0\n1e-3,1\n5e-4,0\n",
    "units.csv": "time,force [mm]\n0,0\n1e-3,1\n",
    "two.csv": "time,force [kN],force [N]\n0,0,0\n1e-3,1,2\n",
    "one.csv": "time,force\n0,0\n",
    "semicolons.csv": "time [ms];force [kN]\n0;0\n0,5;2\n1;1\n",
    "tabs.csv": "time [ms]\tforce [kN]\n0\t0\n\n0.5\t2\n1\t1\n",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def written(folder: Path, force: str) -> Path:
    file = folder / "case.yaml"
    file.write_text(CASE.replace("FORCE", force))
    return file


@pytest.mark.parametrize(
    ("force", "texts"), [(force, texts) for force, *texts in EDITS], ids=[each[0] for each in EDITS]
)
def test_refused_with_the_line(folder: Path, force: str, texts: list[str]) -> None:
    with pytest.raises(CaseError) as caught:
        il.load_case(written(folder, force))
    message = str(caught.value)
    for text in texts:
        assert text in message
    assert "case.yaml:9: bodies.rod.ends.left" in message
    assert message.count("\n") <= 2, "one message"


@pytest.mark.parametrize("name", ["head.csv", "semicolons.csv", "tabs.csv"])
def test_a_file_beside_the_case_in_its_own_units(folder: Path, name: str) -> None:
    """Units in brackets are those of the column; the force is that of the same table in SI."""
    read = il.load_case(written(folder, NAMED.replace("head.csv", name)))
    load = read.scene().bodies["rod"].loads[0][1]
    assert load.at(np.array([0.0, 0.25e-3, 1e-3])) == pytest.approx([0.0, 1000.0, 1000.0])
    assert read.resolved()["bodies"]["rod"]["ends"]["left"]["force"]["f"] == pytest.approx([0.0, 2000.0, 1000.0])


@pytest.mark.parametrize(("column", "second"), [("force", 5.0), ("force [kN]", 2000.0)])
def test_the_full_heading_of_a_column_comes_before_its_name_alone(folder: Path, column: str, second: float) -> None:
    (folder / "both.csv").write_text("time,force [kN],force\n0,0,0\n1e-3,2,5\n")
    load = (
        il.load_case(written(folder, f"{{file: both.csv, t: time, f: '{column}'}}")).scene().bodies["rod"].loads[0][1]
    )
    assert load.at(np.array([1e-3])) == pytest.approx([second])


def test_a_link_out_of_the_folder_is_refused(folder: Path) -> None:
    inner = folder / "inner"
    inner.mkdir()
    (inner / "head.csv").symlink_to(folder / "head.csv")
    with pytest.raises(CaseError, match="lies outside the folder"):
        il.load_case(written(inner, NAMED))


def test_a_case_without_a_file_has_no_folder() -> None:
    ends = {"left": {"force": {"file": "head.csv", "t": "time", "f": "force"}}}
    rod = il.Rod(length=1.0, area=1e-4, material="steel", ends=ends)
    with pytest.raises(CaseError, match="made without a file"):
        il.Case(bodies={"rod": rod}, solve={"duration": 1e-3})


def test_arrays_stand_in_a_case_and_in_its_text(folder: Path) -> None:
    """Arrays are one value of the case, and come back from its text."""
    force = {"t": np.linspace(0.0, 1e-3, 5), "f": np.arange(5.0)}
    case = il.load_case(written(folder, "1")).with_("bodies.rod.ends.left", {"force": force})
    again = folder / "again.yaml"
    again.write_text(case.to_yaml())
    assert il.load_case(again).scene().bodies["rod"].loads == case.scene().bodies["rod"].loads


def test_a_copy_of_a_case_has_its_table(tmp_path: Path) -> None:
    copied = write_copy(case_named("measured_head"), "mine", tmp_path)
    assert il.load_case(copied).scene().bodies["pile"].loads
    with pytest.raises(CaseError, match=r"measured_head\.csv' is already there"):
        write_copy(case_named("measured_head"), "other", tmp_path)
    assert not (tmp_path / "other.yaml").exists()


def test_the_text_of_a_case_stands_alone(folder: Path) -> None:
    """The case beside the page of a run, and in files of histories, holds the table itself, in SI."""
    case = il.load_case(written(folder, NAMED))
    alone = folder / "out"
    alone.mkdir()
    (alone / "case.yaml").write_text(case.to_yaml())
    assert il.load_case(alone / "case.yaml").scene().bodies["rod"].loads == case.scene().bodies["rod"].loads


@pytest.mark.parametrize("model", ["finite_element", "continuous"])
def test_half_a_sine_that_ends_in_the_rounding_of_zero_stays_zero_after_its_end(model):
    """A free rod has the impulse of the straight lines, whatever the last bits of sin(pi)."""
    time = np.linspace(0.0, 2e-4, 101)
    force = 1e4 * np.sin(np.pi * time / 2e-4)
    assert force[-1] != 0.0
    case = il.Case(
        bodies={
            "rod": il.Rod(length=1.0, area=1e-4, material="steel", ends={"left": {"force": {"t": time, "f": force}}})
        },
        solve={"duration": 1e-3, "model": {"kind": model, "elements": 20}, "step": {"dt": 1e-6}},
    )
    history = il.run(case)
    impulse = float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(time)))
    assert history.evaluate(np.array([1e-3]), "momentum:rod")[0] == pytest.approx(impulse, rel=1e-9)


def test_a_table_in_place_of_the_columns_of_a_file_replaces_them() -> None:
    case = il.load_case("measured_head").with_("bodies.pile.ends.left.force", {"t": [0.0, 0.1], "f": [0.0, "3 kN"]})
    assert case.resolved()["bodies"]["pile"]["ends"]["left"]["force"] == {"t": [0.0, 0.1], "f": [0.0, 3000.0]}
