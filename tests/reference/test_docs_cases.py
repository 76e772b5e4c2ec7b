"""The page of the cases names every case and variant, and its numbers are those of the answers."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import pytest

import impactlab as il

DOCS = Path(__file__).resolve().parents[2] / "docs"
CASES = sorted((DOCS.parent / "cases").glob("*.yaml"))


@pytest.fixture(scope="module")
def script() -> Any:
    spec = importlib.util.spec_from_file_location("docs_cases", DOCS / "cases.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("file", CASES, ids=lambda file: file.stem)
def test_the_page_names_every_case_and_variant(file: Path) -> None:
    page = (DOCS / "cases.md").read_text(encoding="utf-8")
    assert f"| [{file.stem}](../cases/{file.name}) |" in page, "run docs/cases.py"
    for variant in il.load_case(file).variant_names[1:]:
        assert f"| {file.stem} `{variant}` |" in page, "run docs/cases.py"


def test_a_line_of_the_page_is_what_the_answer_gives(script: Any) -> None:
    page = script.rounded((DOCS / "cases.md").read_text(encoding="utf-8"))
    for line in script.answered("grazing_pair"):
        assert script.rounded(script.row(line)) in page, "run docs/cases.py"


@pytest.mark.slow
def test_the_committed_page_is_what_the_answers_give(script: Any) -> None:
    lines = {file.stem: list(script.answered(file.stem)) for file in CASES}
    page = (DOCS / "cases.md").read_text(encoding="utf-8")
    assert script.rounded(page) == script.rounded(script.page(lines)), "run docs/cases.py"


def test_the_sheet_of_forces_is_small() -> None:
    assert (DOCS / "figures" / "cases.png").stat().st_size < 200_000
