"""The README, which is the first page of the site: its code runs, and the numbers it states are those of a run."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import impactlab as il
from tests.support import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_lines_of_python_run_and_give_the_numbers_below_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    [block] = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    exec(block, names)
    first, second = names["history"].contacts
    assert f"leaves after {first.end * 1e6:.0f} µs with a peak of {first.peak_force / 1e3:.1f} kN" in README
    assert f"catches up with it at {second.start * 1e6:.0f} µs" in README
    assert (tmp_path / "waves.png").stat().st_size > 10_000


def test_the_comparison_is_the_one_that_was_measured() -> None:
    measured = (ROOT / "docs" / "peers.md").read_text(encoding="utf-8")
    table = measured.partition("### paper, 0.005\n")[2].partition("###")[0]
    ratio = {
        row[0]: (row[1], float(row[2])) for row in re.findall(r"^\| (.+?) \| (\S+)[^|]*\| (\S+) \|", table, re.M)[1:]
    }
    exact = float(ratio["impactlab, exact"][0])
    quickest = min(times for name, (_, times) in ratio.items() if name.startswith(("Exudyn", "MuJoCo", "OpenSees")))
    [(told, times)] = re.findall(r"takes (\S+) ms to solve, exactly; .+ takes (\d+) times as long", README)
    assert exact == pytest.approx(float(told), rel=0.05)
    assert quickest == pytest.approx(float(times), rel=0.05)


def test_the_picture_is_small_and_the_citation_has_the_version() -> None:
    assert (ROOT / "docs" / "figures" / "impact.gif").stat().st_size < 400_000
    assert f"\nversion: {il.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_links_of_the_readme_lead_somewhere() -> None:
    for link in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (ROOT / link).exists(), link
