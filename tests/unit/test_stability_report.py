"""Verdicts on rows of hard cases, and the pages made of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from impactlab import CaseError
from impactlab.bench.report.stability import Codes, alike, drift, matrix, write_stability
from impactlab.bench.report.verdicts import BenchVerdict, verdict, violations
from impactlab.bench.report.write import write_bench
from impactlab.bench.schema import Row

GOOD = Row(case="case", method="method", status="completed", energy_gain=0.0, energy_loss=0.0, momentum_error=1e-12)


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        (GOOD, BenchVerdict.UNKNOWN),
        (GOOD._replace(displacement=0.1, impulse=0.19), BenchVerdict.RIGHT),
        (GOOD._replace(displacement=0.1, impulse=0.21), BenchVerdict.VIOLATION),
        (GOOD._replace(displacement=0.1, impulse=0.21, reference_uncertainty=0.02), BenchVerdict.RIGHT),
        (GOOD._replace(displacement=3.0, warnings="integrator_unused;coarse_contact"), BenchVerdict.WARNED),
        (GOOD._replace(displacement=3.0, warnings="integrator_unused"), BenchVerdict.VIOLATION),
        (GOOD._replace(energy_gain=0.06), BenchVerdict.VIOLATION),
        (GOOD._replace(energy_gain=0.06, warnings="energy_gain"), BenchVerdict.UNKNOWN),
        (GOOD._replace(energy_gain=None), BenchVerdict.VIOLATION),
        (GOOD._replace(momentum_error=0.03), BenchVerdict.VIOLATION),
        (Row(case="c", method="m", status="refused", reason="too soft", remedy="Give more."), BenchVerdict.REFUSED),
        (Row(case="c", method="m", status="refused", reason="too soft"), BenchVerdict.VIOLATION),
        (Row(case="c", method="m", status="failed", reason="diverged", reached_time=1e-3), BenchVerdict.FAILED),
        (Row(case="c", method="m", status="failed", reason="diverged"), BenchVerdict.VIOLATION),
        (Row(case="c", method="m", status="hung", reason="no answer after 60 s"), BenchVerdict.VIOLATION),
        (Row(case="c", method="m", status="crashed", reason="ValueError"), BenchVerdict.VIOLATION),
    ],
)
def test_a_verdict_follows_from_the_row_alone(row: Row, expected: BenchVerdict) -> None:
    assert verdict(row) is expected
    assert any(violations(row)) == (expected is BenchVerdict.VIOLATION)


def test_reasons_that_differ_by_numbers_and_names_share_a_code() -> None:
    one = Row(
        case="c", method="a", status="refused", reason="a step of 1.5e-7 s is beyond the limit of 'newmark'", remedy="x"
    )
    other = one._replace(method="b", reason="a step of 3 s is beyond the limit of 'bathe'")
    third = one._replace(method="d", reason="no mesh")
    codes = Codes([one, other, third])
    assert [codes.of(row) for row in (one, other, third)] == ["r1", "r1", "r2"]
    assert alike(one.reason) == "a step of # s is beyond the limit of '…'"
    assert matrix([one, third], codes).rows == (("a", "r1"), ("d", "r2"))


def test_long_runs_stand_side_by_side_by_their_steps() -> None:
    short = GOOD._replace(method="own.spring_1e5", energy_gain=1e-14, contacts=3)
    long = short._replace(method="own.spring_1e7", energy_gain=2e-12, contacts=300, warnings="energy_loss")
    sheet = drift([short, long])
    assert [head.name for head in sheet.headings[1:3]] == ["1e5 steps, gain and loss", "1e7 steps, gain and loss"]
    assert sheet.rows == (("own.spring", "1.0e-14, 0.0e+00", "2.0e-12, 0.0e+00", "300", "energy_loss"),)


def test_the_report_counts_violations_and_escapes_its_texts(tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    head = (
        "case,variant,method,status,displacement,impulse,solve_s,setup_s,steps,unknowns,energy_gain,energy_loss,reason"
    )
    lines = [head, "a,base,one,completed,0.01,0.02,,,10,4,0,0,", "a,b,one,crashed,,,,,,,,,<b>|x"]
    table.write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert write_stability(tmp_path, table) == 1
    text = (tmp_path / "stability.md").read_text(encoding="utf-8")
    assert "| one | ✓ 2 % | ! |" in text
    assert "crashed: <b>\\|x" in text
    assert "&lt;b&gt;|x" in (tmp_path / "stability.html").read_text(encoding="utf-8")


def test_a_page_that_no_report_wrote_is_not_replaced(tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    head = (
        "case,variant,method,status,displacement,impulse,solve_s,setup_s,steps,unknowns,energy_gain,energy_loss,reason"
    )
    table.write_text(f"{head}\na,base,one,completed,0.01,0.02,,,10,4,0,0,\n", encoding="utf-8")
    mine, report = tmp_path / "mine", tmp_path / "report"
    for folder in (mine, report):
        folder.mkdir()
    (mine / "stability.md").write_text("mine")
    with pytest.raises(CaseError, match=r"would replace 'stability\.md'"):
        write_stability(mine, table)
    assert (mine / "stability.md").read_text() == "mine"
    assert not (mine / "stability.html").exists()
    for _ in range(2):  # its own it replaces
        write_stability(report, table)
    write_bench(report, table)  # the other report of the same folder leaves it its pages
    write_stability(report, table)
    assert (report / "index.html").is_file()
