"""`impactlab choose`, and a tolerance on the command line of `run`, `check` and `compare`."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import impactlab as il
from impactlab import api
from impactlab.refine import choice
from impactlab.refine.convergence import Level, Study
from impactlab.refine.ladder import not_run
from tests.support import CASES, invoke

PAPER = str(CASES / "axial_impact.yaml")
HERTZ = ["--set", "contacts.0.law={kind: hertz, stiffness: 1.0e+11}", "--set", "snapshots=[]", "--set", "probes=[]"]


def test_choose_prints_the_ladder_for_people():
    out = invoke("choose", PAPER, "--tolerance", "1e-2", *HERTZ)
    assert out.exit_code == 0
    assert "tolerance 0.01, measured against a converged solution (known to" in out.output
    assert "stepped delay line" in out.output
    assert "refused: continuous, from event to event" in out.output


def test_choose_prints_one_document():
    out = invoke("choose", PAPER, "--json", *HERTZ)
    document = json.loads(out.stdout)
    assert document["tolerance"] == 1e-3
    assert document["choice"]["met"]
    assert document["measured_error"] <= document["choice"]["expected_error"] <= 1e-3
    assert {rung["verdict"] for rung in document["ladder"]} >= {"kept", "refused"}


def test_choose_takes_the_tolerance_of_the_case(tmp_path):
    case = str(CASES / "hunt_crossley_ball.yaml")
    assert json.loads(invoke("choose", case, "--json").stdout)["tolerance"] == 1e-3
    assert json.loads(invoke("choose", case, "--json", "--tolerance", "0.05").stdout)["tolerance"] == 0.05


@pytest.mark.parametrize("tolerance", ["0.9", "1e-9", "nan"])
def test_choose_refuses_a_tolerance_out_of_range(tolerance):
    out = invoke("choose", PAPER, "--tolerance", tolerance)
    assert out.exit_code == 2
    assert "solve.tolerance" in out.output


def test_run_prints_its_choice():
    out = invoke("run", PAPER, "--set", "solve.tolerance=1e-3")
    assert "choice    tolerance 0.001: continuous, from event to event" in out.output
    assert "not run: lumped mesh" in out.output
    summary = json.loads(invoke("run", PAPER, "--set", "solve.tolerance=1e-3", "--json").stdout)
    assert summary["choice"]["chosen"]["models"]["rod"]["kind"] == "continuous"
    assert summary["method"]["integrator"] is None


def test_check_prints_the_first_candidate():
    out = invoke("check", PAPER, "--method", "base", "--set", "solve.tolerance=1e-3", "--json")
    document = json.loads(out.stdout)
    assert out.exit_code == 0
    assert document["methods"]["base"]["status"] == "accepted"
    assert document["resolved"]["solve"]["tolerance"] == 1e-3
    assert document["methods"]["base"]["dt"] is None
    assert document["methods"]["base"]["steps"] == 0
    assert "a prediction" in document["methods"]["base"]["predicted"]


def test_check_prints_that_the_exact_solution_is_taken_at_once(monkeypatch):
    """It printed the step of the run with steps that was predicted to be a little cheaper, and none is taken."""
    case = il.load_case(PAPER).with_settings({"solve.tolerance": 1e-3}).method("base")
    monkeypatch.setattr(choice, "studies_of", lambda asked: pytest.fail("no study is needed"))
    assert api.prepare(case).dt is None


def test_check_prints_that_a_step_under_a_tolerance_is_a_prediction():
    case = str(CASES / "hunt_crossley_ball.yaml")
    told = invoke("check", case, "--set", "solve.tolerance=0.05").stdout
    assert "predicted: the run chooses its method within the tolerance" in told
    assert "predicted" not in invoke("check", PAPER, "--method", "base").stdout


def test_run_names_the_line_of_a_tolerance_beside_a_step(tmp_path):
    text = Path(PAPER).read_text(encoding="utf-8").replace("solve:\n", "solve:\n  tolerance: 1.0e-3\n", 1)
    case = tmp_path / "both.yaml"
    case.write_text(text, encoding="utf-8")
    out = invoke("run", str(case), "--json")
    error = json.loads(out.stdout)["error"]
    assert out.exit_code == 2
    assert error["kind"] == "CaseError"
    assert error["line"] is not None
    assert error["path"].startswith("solve.")
    assert "automatic choice" in error["text"]


STEPPED = """
schema_version: 1
bodies:
  hammer: {kind: mass, mass: 0.74 kg, velocity: 1 m/s}
  rod:
    kind: rod
    ends: {right: clamped}
    segments:
      - {material: steel, length: 0.2 m, diameter: 25 mm}
      - {material: steel, length: 0.3 m, diameter: 15 mm}
contacts:
  - {between: [hammer, rod.left], law: {kind: hertz, stiffness: 1.0e+10}}
solve: {duration: 0.3 ms, tolerance: 1.0e-2}
"""


def test_the_table_and_the_choice_state_one_error_for_one_run(tmp_path):
    """The table had a third run that the choice had not made, and stated 2.1e-4 where the choice stated 2.9e-4."""
    case = tmp_path / "stepped.yaml"
    case.write_text(STEPPED, encoding="utf-8")
    document = json.loads(invoke("choose", str(case), "--json").stdout)
    chosen = document["choice"]["chosen"]["candidate"]
    rows = {rung["candidate"]: rung["estimated_error"] for rung in document["ladder"]}
    assert rows[chosen] == document["choice"]["expected_error"]
    for rung in document["choice"]["ladder"]:
        if rung["estimated_error"] is not None and rung["candidate"] in rows:
            assert rows[rung["candidate"]] == rung["estimated_error"]


@pytest.mark.parametrize(
    ("chosen_ms", "why"),
    [
        (0.5, ""),
        (1.5, ", less than 2 times as long"),
        (3.0, "; all trials together would take more than 10 times as long"),
    ],
)
def test_a_description_that_was_not_run_states_its_time_within_the_tolerance(chosen_ms: float, why: str) -> None:
    """It stated the time of its first, coarse trial, which may be shorter than that of the chosen run."""
    described: Any = SimpleNamespace(words=str, error=lambda n: 1.0 / n, seconds=lambda n: 1e-4 * n, max_fineness=99)
    study = Study(described, next=2, wanted=10)
    study.levels.append(Level(2, None))  # type: ignore[arg-type]
    found = not_run(study, 1e-3 * chosen_ms)()
    assert (found.candidate, found.verdict) == ("10", "not run")
    assert found.reason == f"predicted to solve for 1 ms, the chosen one for {chosen_ms:g} ms{why}"
