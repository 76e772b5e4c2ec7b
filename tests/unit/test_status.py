"""The status of a run, its exit code and its warnings: an answer in doubt never looks like one that is right."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import pytest

import impactlab as il
from impactlab import api
from impactlab.bench.references import References
from impactlab.bench.report.verdicts import BenchVerdict, verdict
from impactlab.bench.rows import row_of
from impactlab.bench.schema import Row
from impactlab.cli import app
from impactlab.errors import RunWarning, StepError
from impactlab.history import AbstractHistory, Warned
from impactlab.history.advice import ADVICE
from impactlab.history.choice import Choice
from impactlab.report import console
from impactlab.report.comparison import table
from impactlab.report.summary import summarise
from impactlab.simulate import driver
from tests.support import CASES

CASE = """
schema_version: 1
bodies:
  ball: {kind: mass, mass: 1.0, velocity: 1.0}
  wall: {kind: wall}
contacts: [{between: [ball, wall], law: {kind: hertz, stiffness: 1.0e9}}]
solve: {duration: 2.0e-3, tolerance: 1.0e-3}
methods:
  by_steps: {solve.tolerance: null, solve.step: {dt: 1.0e-6}}
"""

GROWING = """
schema_version: 1
bodies:
  one: {kind: rod, length: 0.3, area: 9.0e-4, material: {young: 2.1e11, density: 7850}, velocity: 1.0}
  two: {kind: rod, length: 0.45, area: 9.0e-4, material: {young: 2.1e11, density: 7850}}
contacts: [{between: [one.right, two.left], law: {kind: energy_conserving}}]
solve:
  duration: 3.0e-4
  model: {kind: finite_element, elements: 40, mass: lumped}
  integrator: {kind: generalised_alpha}
  step: {dt: 7.27e-7}
"""


@pytest.fixture
def missed(monkeypatch: pytest.MonkeyPatch) -> None:
    """No choice meets its tolerance."""
    monkeypatch.setattr(Choice, "met", property(lambda _: False))


def written(tmp_path: Path, text: str = CASE) -> Path:
    file = tmp_path / "case.yaml"
    file.write_text(text, encoding="utf-8")
    return file


def code_of(*arguments: str) -> int:
    with pytest.raises(SystemExit) as left:
        app(list(arguments))
    return int(left.value.code or 0)


def test_a_tolerance_that_is_met_completes(tmp_path: Path) -> None:
    case = il.load_case(written(tmp_path))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        history = il.run(case)
    assert api.summarised(case, history)[0]["status"] == "completed"


@pytest.mark.usefixtures("missed")
def test_a_tolerance_that_is_not_met_is_a_status_shown_first_with_exit_code_1(tmp_path: Path, capsys: Any) -> None:
    file = written(tmp_path)
    assert code_of("run", str(file)) == 1
    first, second, *_ = capsys.readouterr().out.splitlines()
    assert first == "case: tolerance_not_met"
    assert second.startswith("  warning   tolerance_not_met: no description that a choice may try keeps 0.001")
    assert code_of("run", str(file), "--json") == 1
    summary = json.loads(capsys.readouterr().out)
    assert summary["status"] == "tolerance_not_met"
    assert summary["final"]["bodies"]["ball"]["velocity"] == pytest.approx(-1.0, abs=1e-2)
    error = summary["error"]
    assert (error["kind"], error["file"], error["path"]) == ("ToleranceNotMet", str(file), "solve.tolerance")
    assert error["line"] == 1 + CASE[: CASE.index("tolerance:")].count("\n")
    assert error["text"].startswith("no description that a choice may try keeps 0.001")
    assert error["remedy"].startswith("Do not use the result at this tolerance")
    assert code_of("compare", str(file), "--json", "--methods", "base") == 1
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert row["summary"]["error"] == error


@pytest.mark.usefixtures("missed")
def test_python_returns_the_history_and_warns_once(tmp_path: Path) -> None:
    case = il.load_case(written(tmp_path))
    with pytest.warns(RunWarning, match="tolerance_not_met: no description") as seen:
        history = il.run(case)
    assert len(seen) == 1
    assert seen[0].filename == __file__
    assert history.choice is not None
    assert not history.choice.met
    assert api.summarised(case, history)[0]["status"] == "tolerance_not_met"


@pytest.mark.usefixtures("missed")
def test_rows_of_a_comparison_and_of_a_bench_keep_status_and_numbers(tmp_path: Path, capsys: Any) -> None:
    file = written(tmp_path)
    assert code_of("compare", str(file), "--methods", "base") == 1
    shown = capsys.readouterr()
    assert "base tolerance_not_met: no description" in shown.err
    compared = api.compare(il.load_case(file), ["base", "by_steps"])
    statuses = [row.summary["status"] for row in compared.rows]
    assert statuses == ["tolerance_not_met", "completed"]
    assert set(compared.histories) == {"base", "by_steps"}
    assert "tolerance_not_met" in table(compared.document)
    record = row_of(il.load_case(file), "base", {}, References(None))
    assert record["summary"]["status"] == "tolerance_not_met"
    assert record["summary"]["cost"]["steps"] > 0
    row = Row(
        case="case", method="base", status="tolerance_not_met", displacement=0.5, energy_gain=0.0, energy_loss=0.0
    )
    assert row.completed
    assert verdict(row._replace(warnings="tolerance_not_met")) is BenchVerdict.WARNED


def test_a_run_that_more_than_doubles_its_energy_fails_with_the_history_so_far(tmp_path: Path, capsys: Any) -> None:
    file = written(tmp_path, GROWING)
    with pytest.raises(StepError, match="no run may more than double it") as failed:
        il.run(il.load_case(file))
    assert failed.value.history is not None
    assert failed.value.history.energy.largest_gain > 1.0
    assert code_of("run", str(file), "--json") == 1
    assert json.loads(capsys.readouterr().out)["status"] == "failed"


def test_long_lists_are_shortened_on_the_screen_and_complete_in_json(tmp_path: Path) -> None:
    case = il.load_case(written(tmp_path)).method("by_steps")
    history = il.run(case)
    summary = summarise("x", history)
    span = summary["contacts"][0]
    long = summary | {"contacts": [span | {"impulse": 1.0 + n} for n in range(237)]}
    lines = [line for line in console.summary_text(long).splitlines() if "contact" in line]
    shown = [line for line in lines if line.startswith("  contact ")]
    assert [line.split("impulse ")[1].split(" ")[0] for line in shown] == ["1", "2", "3", "4", "5", "236", "237"]
    assert any("... 230 more contacts, impulses 6 to 235 N s (all of them: --json)" in line for line in lines)
    few = summary | {"contacts": [span] * 12}
    assert sum(line.startswith("  contact ") for line in console.summary_text(few).splitlines()) == 12


def test_a_gain_of_energy_is_shown_first_and_warned_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = il.load_case(written(tmp_path)).method("by_steps")
    history = il.run(case)
    history.warnings += [Warned("near_grazing", "later"), Warned("energy_gain", "energy grew by 30 %")]
    text = console.summary_text(summarise("x", history)).splitlines()
    assert text[1] == f"  warning   energy_gain: energy grew by 30 %. {ADVICE['energy_gain']}"
    assert sum("energy_gain" in line for line in text) == 1
    monkeypatch.setattr(driver, "run", lambda *_, **__: history)
    with pytest.warns(RunWarning, match="energy_gain: energy grew by 30 %"):
        il.run(case)


@pytest.mark.parametrize("integrator", ["moreau_jean", "central_difference"])
def test_augmentations_that_leave_an_overlap_on_a_beam_name_a_remedy_that_helps(integrator: str) -> None:
    case = il.load_case(CASES / "sphere_on_beam.yaml").with_("solve.integrator", {"kind": integrator})
    case = case.with_("solve.step", {"points_per_period": 10.0})
    augmented = {"kind": "augmented_lagrangian", "stiffness": 1.6e7}
    with pytest.raises(StepError, match="energy grew by") as failed:
        il.run(case.with_("contacts.0.law", augmented))
    assert "a hundred times the stiffness and 100 augmentations" in failed.value.remedy
    assert "law addition_deletion" in failed.value.remedy
    for remedy in (augmented | {"stiffness": 1.6e9, "augmentations": 100}, {"kind": "addition_deletion"}):
        assert il.run(case.with_("contacts.0.law", remedy)).energy.largest_gain < 1e-3


def test_faces_that_never_meet_are_named_by_exact_runs_as_by_stepped_ones():
    case = il.load_case("axial_impact").with_("bodies.hammer.velocity", -1.0).with_("contacts.0.gap", 1e-4)
    for method in ("continuous", "finite_element"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RunWarning)
            texts = [each.text for each in il.run(case.method(method)).warnings if each.code == "no_contact"]
        (text,) = texts
        assert "the faces never met; the smallest gap was 0.0001 m, at the start" in text, method
        assert "the bodies move apart" in text
        assert "swap the two, or change the sign of a velocity or of gravity" in text


def test_faces_that_stay_where_they_are_do_not_move_apart():
    case = il.load_case("axial_impact").with_("bodies.hammer.velocity", 0.0).with_("contacts.0.gap", 1e-4)
    for method in ("continuous", "finite_element"):
        texts = [each.text for each in il.run(case.method(method)).warnings if each.code == "no_contact"]
        assert texts == ["hammer|rod.left: the faces never met; the smallest gap was 0.0001 m"], method


def test_a_summary_has_units_and_no_digits_of_rounding():
    text = console.summary_text(summarise("axial", _exact_run()))
    assert "dt" not in text
    assert "intervals between events" in text
    assert "m/s" in text
    assert "e-1" not in text.split("energy    ")[1].split("\n")[0]


def _exact_run() -> AbstractHistory:
    case = il.load_case("axial_impact").method("continuous")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RunWarning)
        return il.run(case)


def test_an_exact_run_of_very_many_intervals_names_the_step_that_is_quicker() -> None:
    summary = summarise("axial", _exact_run())
    assert "solve.step.dt" not in console.summary_text(summary)
    summary["cost"]["steps"] = 363_281
    lines = console.summary_text(summary).splitlines()
    advice = lines[next(number for number, line in enumerate(lines) if line.startswith("  cost")) + 1]
    assert "solve.step.dt" in advice
    assert "wave_identification" in advice
