"""The stated error of a chosen run beside the errors of its summary, and choices that run out of their budget."""

from __future__ import annotations

import dataclasses
import json
import re

import pytest

from impactlab import load_case, run
from impactlab.errors import CaseError
from impactlab.refine import search
from impactlab.refine.descriptions.cost import RIGID
from impactlab.refine.references.reference import find
from impactlab.refine.references.reference_record import Reference
from impactlab.refine.references.stated_error import measured_error, set_measured_error
from impactlab.report import summary
from impactlab.scene.method import COUNTED
from impactlab.simulate import driver

BALL = {
    "schema_version": 1,
    "bodies": {"ball": {"kind": "mass", "mass": 1.0, "velocity": 1.0}, "wall": {"kind": "wall"}},
    "contacts": [
        {"between": ["ball", "wall"], "gap": 7.767e-5, "law": {"kind": "penalty", "stiffness": 1e6, "damping": 1200.0}}
    ],
    "solve": {"duration": 5e-3, "tolerance": 1e-4},
}


def case(tmp_path, **solve):
    (tmp_path / "ball.json").write_text(json.dumps(BALL | {"solve": BALL["solve"] | solve}))
    return load_case(tmp_path / "ball.json")


@pytest.mark.parametrize("gap", [0.0, 7.767e-5, 1.3e-4, 2.91e-4])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
def test_a_dashpot_touched_inside_a_step_keeps_the_tolerance(tmp_path, gap, tolerance):
    """Closed form of a ball on a spring and dashpot that never pull, zeta 0.6: e = exp(-zeta w0 t), 0.2488406."""
    data = json.loads(json.dumps(BALL))
    data["contacts"][0]["gap"], data["solve"]["tolerance"] = gap, tolerance
    (tmp_path / "ball.json").write_text(json.dumps(data))
    history = run(load_case(tmp_path / "ball.json"))
    assert history.choice.met
    impulse = sum(span.impulse for span in history.contacts)
    assert impulse == pytest.approx(1.2488406, rel=min(tolerance, history.choice.expected_error + 1e-7))


def test_errors_beyond_the_stated_one_are_shown_first_and_the_tolerance_is_not_met(tmp_path):
    """A run that was chosen is held against the reference of a ball with another speed."""
    scene = case(tmp_path).simulation()
    history = run(scene)
    ball = dataclasses.replace(scene.scene.bodies["ball"], velocity=1.01)
    other = find(*scene.but(tolerance=None, bodies=dict(scene.scene.bodies) | {"ball": ball}))
    document = summary.summarise("ball", history, other)
    assert document["status"] == "tolerance_not_met"
    assert document["choice"]["met"] is False
    assert document["choice"]["measured_error"] == pytest.approx(0.01, rel=0.2)
    assert document["warnings"][0]["code"] == "tolerance_not_met"
    again = summary.summarise("ball", history, other)
    assert [warned["code"] for warned in again["warnings"]].count("tolerance_not_met") == 1


def test_an_estimate_that_was_too_small_is_warned_of_although_the_tolerance_holds(tmp_path):
    history = run(case(tmp_path))
    history.choice = dataclasses.replace(history.choice, expected_error=1e-6)
    set_measured_error(history, 5e-5)
    assert history.choice.met
    assert history.warnings[0].code == "stated_error"


def test_a_tolerance_may_be_on_some_quantities_alone(tmp_path):
    scene = case(tmp_path, tolerance_on=["impulses"]).simulation()
    assert scene.method.tolerance.on == ("impulses",)
    found = {"mass_displacement": 0.5, "face_displacement": None, "impulse": 2e-3, "peak_force": 0.7}
    against = Reference("st_venant", run(scene))
    assert measured_error(found, against, scene.method.tolerance.on) == pytest.approx(2e-3)
    assert measured_error(found, against, COUNTED) == pytest.approx(0.7)


def test_tolerance_on_without_a_tolerance_is_refused(tmp_path):
    data = json.loads(json.dumps(BALL))
    data["solve"] = {"duration": 5e-3, "step": {"dt": 1e-6}, "tolerance_on": ["impulses"]}
    (tmp_path / "ball.json").write_text(json.dumps(data))
    with pytest.raises(CaseError, match="given without tolerance"):
        load_case(tmp_path / "ball.json")


def test_a_tolerance_out_of_reach_is_refused_with_the_best_that_could_be_reached(tmp_path, monkeypatch):
    """All runs take less than half of the budget, and the tolerance that the error names is kept."""
    monkeypatch.setattr(search, "BUDGET_S", 2e-3)
    monkeypatch.setattr(search, "PROBE_S", 4e-4)
    runs = []
    ran = driver.run
    monkeypatch.setattr(driver, "run", lambda *given, **named: runs.append(ran(*given, **named)) or runs[-1])
    with pytest.raises(CaseError, match=r"no description keeps 1e-08 within 0\.002 s of solving: the best") as caught:
        run(case(tmp_path, tolerance=1e-8))
    assert caught.value.path == "solve.tolerance"
    assert "by rigid bodies, " in caught.value.text
    assert len(runs) <= 3
    assert sum(run.cost.steps for run in runs) * RIGID.step_s + len(runs) * RIGID.fixed_s <= 1e-3
    offered = float(re.search(r"Give a tolerance of (\S+) or more", caught.value.remedy)[1])
    assert 1e-8 < offered < 1e-4
    assert run(case(tmp_path, tolerance=offered)).choice.met


def test_a_budget_below_that_of_all_descriptions_is_a_matter_of_cost(tmp_path, monkeypatch):
    """The error does not blame the physics."""
    monkeypatch.setattr(search, "BUDGET_S", 1e-6)
    with pytest.raises(CaseError, match="no description can be tried: rigid bodies: would take"):
        run(case(tmp_path))
