"""Examples of the docs in two tabs, a file and Python: both forms are one case."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

import impactlab as il

DOCS = Path(__file__).parents[2] / "docs"
REST = {"solve": {"duration": 1e-4, "tolerance": 1e-2}}  # of an example that shows bodies and contacts alone


def pairs() -> list[tuple[str, str, str]]:
    """Return page, file and Python of each set of tabs that shows bodies in both forms."""
    found = []
    for page in sorted(DOCS.rglob("*.md")):
        for tabs in re.findall(r"^::::\{tab-set\}\n(.*?)^::::$", page.read_text(encoding="utf-8"), re.M | re.S):
            blocks = dict(re.findall(r"^```(yaml|python)\n(.*?)^```$", tabs, flags=re.M | re.S))
            if "bodies:" in blocks.get("yaml", "") and "python" in blocks:
                found.append((page.stem, blocks["yaml"], blocks["python"]))
    return found


def as_given(text: str) -> dict[str, Any]:
    return {**REST, **YAML(typ="safe").load(text)}


def test_the_pages_show_both_forms() -> None:
    assert {name for name, _, _ in pairs()} >= {"start", "cases-in-python", "beams"}


@pytest.mark.parametrize(("name", "file", "python"), pairs(), ids=[name for name, _, _ in pairs()])
def test_both_forms_are_one_case(name: str, file: str, python: str) -> None:
    names: dict[str, Any] = {}
    exec(python, names)
    made = names.get("case") or il.Case(bodies=names["bodies"], contacts=names["contacts"], **REST)
    assert made.resolved() == il.Case.from_dict(as_given(file)).resolved()


def test_the_first_page_of_code_runs_as_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = (DOCS / "start.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    for block in re.findall(r"^```python\n(.*?)^```$", page, flags=re.M | re.S):
        exec(block, names)
    first, second = names["history"].contacts
    assert f"leaves after {1e6 * first.end:.0f} µs with a peak force of {first.peak_force / 1e3:.1f} kN" in page
    assert f"at {1e6 * second.start:.0f} µs: a second contact of {1e6 * (second.end - second.start):.0f} µs" in page
    assert names["by_elements"].evaluate(1e-5, "force:hammer|rod.left") == pytest.approx(names["force"][0], rel=0.1)
    assert names["waves"].total == pytest.approx(
        names["history"].evaluate(names["waves"].time, "strain:rod@0.15"), abs=1e-12
    )
    assert names["data"]["stress"].attrs["units"] == "Pa"
    assert names["field"].x.shape == names["field"].values.shape
