"""The sentences at the top of the page of one run."""

from pathlib import Path

import impactlab as il
from impactlab import api
from impactlab.report.run_report import findings

CASE = Path(__file__).parents[2] / "cases" / "axial_impact.yaml"


def said(method: str) -> str:
    """Return the sentences of a run by a method of the paper's case."""
    case = il.load_case(CASE).method(method)
    return " ".join(findings(api.summarised(case, il.run(case))[0]))


def test_an_exact_run_does_not_differ_from_itself() -> None:
    """It said that its displacement differs from st_venant by 0 %."""
    assert "largest force" in said("continuous")
    assert "differs from" not in said("continuous")
    assert "The displacement of the mass differs from st_venant by" in said("modal_10")
