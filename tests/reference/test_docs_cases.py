"""The page of the cases names every case and variant, and its numbers are those of the answers."""

from __future__ import annotations

from pathlib import Path

import pytest

import impactlab as il
from studies import cases as script
from studies.pages import DOCS

CASES = sorted((DOCS.parent / "cases").glob("*.yaml"))


@pytest.mark.parametrize("file", CASES, ids=lambda file: file.stem)
def test_the_page_names_every_case_and_variant(file: Path) -> None:
    page = (DOCS / "cases.md").read_text(encoding="utf-8")
    assert f"| [{file.stem}](../cases/{file.name}) |" in page, "run studies.cases"
    for variant in il.load_case(file).variant_names[1:]:
        assert f"| {file.stem} `{variant}` |" in page, "run studies.cases"


def test_a_line_of_the_page_is_what_the_answer_gives() -> None:
    page = script.rounded((DOCS / "cases.md").read_text(encoding="utf-8"))
    for line in script.answered("grazing_pair"):
        assert script.rounded(script.row(line)) in page, "run studies.cases"


@pytest.mark.slow
def test_the_committed_page_is_what_the_answers_give() -> None:
    lines = {file.stem: list(script.answered(file.stem)) for file in CASES}
    page = (DOCS / "cases.md").read_text(encoding="utf-8")
    assert script.rounded(page) == script.rounded(script.page(lines)), "run studies.cases"


def test_the_sheet_of_forces_is_small() -> None:
    assert (DOCS / "figures" / "cases.png").stat().st_size < 200_000
