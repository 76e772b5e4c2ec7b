"""How a reference and its uncertainty reach the summary of a run and of a comparison."""

from __future__ import annotations

import json

import pytest

import impactlab as il
from impactlab import api
from impactlab.metrics import force_graphs, norms
from impactlab.refine.references import outlook, reference, reference_record
from impactlab.report import console, run_report, summary
from tests.support import CASES, invoke

HERTZ = ("contacts.0.law", {"kind": "hertz", "stiffness": 1e11})
DAMPED = ("bodies.rod.damping", {"mass": 3000.0})


def paper(*settings):
    return il.load_case(CASES / "axial_impact.yaml").with_settings([("snapshots", []), *settings])


def test_errors_against_an_exact_solution_have_no_uncertainty():
    case = paper()
    found, judge = api.summarised(case, il.run(case))
    assert judge.name == found["errors"]["reference"] == "st_venant"
    assert found["errors"]["reference_uncertainty"] == 0.0


@pytest.mark.parametrize("case", ["axial_impact", "several_masses"])  # with forces, with kicks
def test_an_exact_run_is_compared_with_itself_without_a_graph_of_its_forces(case, monkeypatch):
    """Three quarters of the time of a summary of 250 bars went into numbers that are zero."""
    case = il.load_case(CASES / f"{case}.yaml").method("continuous")
    history, again = il.run(case), il.run(case)
    measured = norms.errors(history, "st_venant", again, history.scene)
    monkeypatch.setattr(force_graphs, "graph", None)
    found, judge = api.summarised(case, history)
    assert judge.history is not history
    for name, value in measured.items():
        assert found["errors"][name] == value
    assert found["errors"]["impulse"] == 0.0


def test_a_law_of_impulses_has_no_error_of_a_force():
    """The error of its peak force was 1."""
    case = paper(("contacts.0.law", {"kind": "impulse_momentum"}))
    errors = api.summarised(case, il.run(case))[0]["errors"]
    assert [errors[name] for name in ("force", "force_graph", "peak_force")] == [None, None, None]
    assert errors["impulse"] < 0.02


@pytest.mark.parametrize("setting", [HERTZ, DAMPED], ids=["hertz", "damped"])
def test_a_run_without_an_exact_solution_has_errors_with_their_uncertainty(setting):
    case = paper(setting)
    errors = api.summarised(case, il.run(case), 0.25)[0]["errors"]
    assert errors["reference"] == "converged"
    assert 0.0 < errors["reference_uncertainty"] < 1e-5
    assert 10.0 * errors["reference_uncertainty"] < errors["mass_displacement"] < 0.02
    json.dumps(errors, allow_nan=False)


@pytest.mark.parametrize("setting", [HERTZ, DAMPED], ids=["hertz", "damped"])
def test_a_reference_that_costs_more_than_ten_times_the_run_is_not_computed_unasked(setting, monkeypatch):
    case = paper(setting)
    history = il.run(case)
    monkeypatch.setattr(outlook, "find", None)  # nothing is sought
    found, judge = api.summarised(case, history)
    about_s = found["reference"].pop("about_s")
    assert about_s > 10.0 * outlook.run_s(history)
    text = f"not computed; --reference computes it, about {about_s:.1g} s"
    assert found["reference"] == {"status": "not_computed", "text": text}
    assert judge is found["errors"] is None
    assert text in console.summary_text(found)
    assert f"Errors: {text}." in run_report.findings(found)


def test_a_reference_of_many_seconds_is_not_computed_unasked_however_long_the_run_takes(monkeypatch):
    case = il.load_case(CASES / "granular" / "solitary_wave.yaml")
    history, about_s = il.run(case), outlook.reference_s(*api.physics_of(case)).about_s
    monkeypatch.setattr(outlook, "MAX_PLAIN_S", 0.9 * about_s)
    monkeypatch.setattr(outlook, "run_s", lambda _: 1e6)
    monkeypatch.setattr(outlook, "find", None)  # nothing is sought
    found, told = outlook.of_plain_run(*api.physics_of(case), history)
    assert found is None
    assert (told.status, told.about_s) == ("not_computed", about_s)


def test_a_long_run_has_a_converged_reference_unasked():
    case = paper(HERTZ, ("solve.step", {"points_per_period": 20_000}))
    history = il.run(case)
    found, judge = api.summarised(case, history)
    assert outlook.reference_s(*api.physics_of(case)).about_s < 10.0 * outlook.run_s(history)
    assert judge.name == found["errors"]["reference"] == found["reference"]["status"] == "converged"
    assert found["reference"]["text"] is found["reference"]["about_s"] is None


def test_links_are_counted_in_the_cost_of_a_reference():
    """Of a pile with 18 links it takes a hundred times the run: steps, comparisons of levels, contact by contact."""
    case = il.load_case(CASES / "smith_pile.yaml")
    found = outlook.reference_s(*api.physics_of(case))
    one = outlook.reference_s(*api.physics_of(paper(HERTZ)))
    assert found.status == one.status == "converged"
    assert found.about_s > 2.0  # it takes about 4 s of a processor
    assert 0.05 < one.about_s < 0.5  # 0.2 s


def test_predictions_are_the_same_however_busy_the_machine_is(monkeypatch):
    case = paper(HERTZ)
    first = api.summarised(case, il.run(case))[0]["reference"]
    slow = il.run(case)
    slow.cost.setup_s = slow.cost.solve_s = 100.0
    assert api.summarised(case, slow)[0]["reference"] == first


def test_no_reference_differs_from_one_that_is_not_computed():
    case = il.load_case(CASES / "axial_impact.yaml").method("impulse_momentum")
    two = il.load_case(CASES / "two_link_arm.yaml").with_settings(
        {"contacts.0.law": {"kind": "velocity_complementarity"}}
    )
    assert outlook.reference_s(*api.physics_of(case)).status == "exact"
    nothing = outlook.reference_s(*api.physics_of(two))
    assert nothing.document["status"] == "none"
    assert nothing.text == "not measured: no exact solution, and no reference that converges within 7 s"


def test_methods_of_a_comparison_share_a_converged_reference(tmp_path):
    case = paper(HERTZ, ("methods", {"fine": {"solve.step": {"points_per_period": 40}}}))
    comparison = il.compare(case, ["base", "fine"])
    first, second = comparison.rows
    assert first.reference.history is second.reference.history
    assert str(comparison).startswith("axial_impact: 2 methods against a converged solution")


def test_errors_below_the_uncertainty_of_the_reference_are_not_reported():
    case = paper()
    history = il.run(case)
    exact = reference.find(*case.simulation())
    vague = exact._replace(uncertainty=1e-4, uncertainties={"force": 0.5, "event_times": float("inf")})
    errors = summary.errors(history, vague)
    assert [errors[key] for key in ("force", "event_times", "events_missed", "events_extra")] == [None] * 4
    assert errors["force_away_from_jumps"] is not None
    assert errors["reference_uncertainty"] == 1e-4


def test_a_summary_still_takes_a_name_and_a_history():
    case = paper()
    history = il.run(case)
    exact = reference.find(*case.simulation())
    whole = summary.summarise("x", history, exact)["errors"]
    assert summary.summarise("x", history, ("st_venant", exact.history))["errors"] == whole


def test_the_command_line_names_the_reference_of_the_errors(tmp_path):
    text = (CASES / "axial_impact.yaml").read_text(encoding="utf-8")
    case = tmp_path / "damped.yaml"
    case.write_text(text, encoding="utf-8")
    settings = ["--set", "bodies.rod.damping.stiffness=1e-5", "--set", "snapshots=[]"]
    plain = invoke("run", str(case), *settings)
    assert plain.exit_code == 0
    assert "errors    not computed; --reference computes it, about " in plain.output
    asked = invoke("run", str(case), *settings, "--reference")
    assert asked.exit_code == 0
    assert "against a converged solution (known to " in asked.output


def test_the_content_of_a_scene_names_its_physics_only():
    scene = paper(HERTZ).simulation()
    other = paper(HERTZ, ("solve.model", {"kind": "modal", "modes": 5}), ("solve.step", {"dt": 1e-7})).simulation()
    assert reference_record.physics_key(*scene) == reference_record.physics_key(*other)
    assert reference_record.physics_key(*scene) != reference_record.physics_key(*scene.but(duration=1e-5))


@pytest.mark.slow
def test_a_report_is_drawn_against_a_converged_reference(tmp_path):
    """With snapshots, too: a converged answer has no fields at any place, so these stand without it."""
    case = ["--set", "contacts.0.law={kind: hertz, stiffness: 1.0e+11}"]
    left = invoke("run", str(CASES / "axial_impact.yaml"), *case, "--reference", "--out", str(tmp_path / "out"))
    assert left.exit_code == 0
    assert "the converged solution" in (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
