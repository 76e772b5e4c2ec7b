"""The sentences at the top of the page of one run."""

from pathlib import Path

import impactlab as il
from impactlab import api
from impactlab.report.facts import table_caption
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
    assert "The displacement of the mass differs from that of the exact solution by" in said("modal_10")


def test_the_caption_of_a_table_names_its_reference() -> None:
    """Errors against a converged solution stood there as errors against the exact answer."""
    assert "errors against the converged solution" in table_caption("converged")
    assert "errors against the exact solution" in table_caption("exact")
    assert table_caption("").startswith("Gain and loss")
