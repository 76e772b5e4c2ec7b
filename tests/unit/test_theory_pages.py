"""The pages docs/theory/*.md: their blocks of Python run, and their constants are those of the code."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from tests.support import ROOT

PACKAGE, REFINE = ROOT / "impactlab", Path("refine")
PAGES = {page.stem: page.read_text(encoding="utf-8") for page in sorted((ROOT / "docs" / "theory").glob("*.md"))}
WITH_CHECKS = sorted(name for name, text in PAGES.items() if "```python" in text)


def test_each_page_with_formulas_has_a_check() -> None:
    assert {name for name, text in PAGES.items() if "$$" in text} == set(WITH_CHECKS)


@pytest.mark.parametrize("name", WITH_CHECKS)
def test_formulas_hold(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", PAGES[name], flags=re.DOTALL)
    assert sum(block.count("assert ") for block in blocks) > 0
    names: dict[str, Any] = {}
    for block in blocks:
        exec(compile(block, name, "exec"), names)


def value_of(text: str) -> float:
    """Return a constant of the table in SI: ``0.54 ms``, ``1/30 s``, ``200 000``."""
    number, _, unit = text.partition(" ") if not text.replace(" ", "").isdecimal() else (text.replace(" ", ""), "", "")
    over, _, under = number.partition("/")
    return float(over) / float(under or 1.0) * {"": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6}[unit]


TABLE_ROW = r"^\| (`[A-Z_`, ]+`) \| ([^|]+) \|[^|]+\| ([^|]+) \|$"
CONSTANTS = re.findall(TABLE_ROW, PAGES["error-estimates"], flags=re.MULTILINE)


def test_the_table_lists_constants() -> None:
    assert len(CONSTANTS) > 40


@pytest.mark.parametrize(("names", "values", "files"), CONSTANTS, ids=[each[0] for each in CONSTANTS])
def test_constants_have_the_values_of_the_table(names: str, values: str, files: str) -> None:
    given = [Path(each) for each in re.findall(r"`([^`]+)`", files)]
    named = [REFINE / each if (PACKAGE / REFINE / each).exists() else each for each in given]
    modules = [import_module(".".join(("impactlab", *each.with_suffix("").parts))) for each in named]
    for name, value in zip(re.findall(r"\w+", names), values.split(", "), strict=True):
        found = [getattr(module, name) for module in modules if hasattr(module, name)]
        assert found, f"{name} is not in {files}"
        assert found[0] == pytest.approx(value_of(value.strip()), rel=1e-3)


AUTOLOADED = r"\\(boldsymbol|bm|pmb|cancel|bcancel|xcancel|color|textcolor|colorbox|unicode|mathtip|toggle|braket|ce)\b"


def test_no_page_takes_a_macro_that_the_local_mathjax_cannot_load() -> None:
    """One such macro leaves all formulas of its page as text, and the build of the site says nothing."""
    pages = sorted((ROOT / "docs").rglob("*.md"))
    assert len(pages) > 60
    assert not {page.name: found for page in pages if (found := re.findall(AUTOLOADED, page.read_text("utf-8")))}
