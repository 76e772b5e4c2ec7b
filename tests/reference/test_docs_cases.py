"""The page of the cases names every case and variant, and its numbers are those of the answers."""

from __future__ import annotations

from pathlib import Path

import pytest

import impactlab as il
from studies import cases as script
from studies.pages import DOCS, same_to_printed_digits

CASES = sorted((DOCS.parent / "cases").glob("*.yaml"))


@pytest.mark.parametrize("file", CASES, ids=lambda file: file.stem)
def test_the_page_names_every_case_and_variant(file: Path) -> None:
    page = (DOCS / "cases.md").read_text(encoding="utf-8")
    assert f"| [{file.stem}](../cases/{file.name}) |" in page, "run: python -m studies cases"
    for variant in il.load_case(file).variant_names[1:]:
        assert f"| {file.stem} `{variant}` |" in page, "run: python -m studies cases"


def test_a_line_of_the_page_is_what_the_answer_gives() -> None:
    lines = (DOCS / "cases.md").read_text(encoding="utf-8").splitlines()
    for line in script.answered("grazing_pair"):
        assert any(same_to_printed_digits(f"| {script.row(line)} |", kept) for kept in lines), script.row(line)


def test_the_sheet_of_forces_is_small() -> None:
    assert (DOCS / "figures" / "cases.png").stat().st_size < 200_000
