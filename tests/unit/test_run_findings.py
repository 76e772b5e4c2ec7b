"""The sentences at the top of the page of one run."""

import impactlab as il
from impactlab import api
from impactlab.report.console import summary_text
from impactlab.report.facts import table_caption
from impactlab.report.run_report import findings
from tests.support import PAPER


def said(method: str) -> str:
    """Return the sentences of a run by a method of the paper's case."""
    case = il.load_case(PAPER).method(method)
    return " ".join(findings(api.summarised(case, il.run(case))[0]))


def test_an_exact_run_does_not_differ_from_itself() -> None:
    """It said that its displacement differs from st_venant by 0 %."""
    assert "largest force" in said("continuous")
    assert "differs from" not in said("continuous")
    assert "The displacement of the mass differs from that of the exact solution by" in said("modal_10")


def test_the_page_and_the_summary_state_the_range_of_a_probe() -> None:
    """They stood in summary.json alone. A bar of speed v on an equal one: stress rho c v/2."""
    bars = {"a": il.Rod(length=1.0, diameter=0.02, material={"young": 1.6e11, "density": 1e4}, velocity=2.0)}
    bars["b"] = il.Rod(**{**bars["a"], "velocity": 0.0, "ends": {"right": "infinite"}})
    solve = {"duration": 3e-4, "tolerance": 1e-3}
    probes = [il.Probe("b", 0.5, "stress")]
    case = il.Case(bodies=bars, contacts=[il.Contact("a.right", "b.left")], probes=probes, solve=solve)
    summary, *_ = api.summarised(case, il.run(case))
    assert "Stress of b at 500 mm: from 0 to 40 MPa." in [each.replace("\xa0", " ") for each in findings(summary)]
    assert "  probe     stress:b@0.5: 0 to 4e+07 Pa" in summary_text(summary).splitlines()


def test_the_caption_of_a_table_names_its_reference() -> None:
    """Errors against a converged solution stood there as errors against the exact answer."""
    assert "errors against the converged solution" in table_caption("converged")
    assert "errors against the exact solution" in table_caption("exact")
    assert table_caption("").startswith("Gain and loss")
