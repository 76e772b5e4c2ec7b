"""The pages of benchmarks are what their stored tables give, to the letter: they are made from them alone."""

from __future__ import annotations

import re

import pytest

from studies.bench import STUDY
from studies.pages import DOCS, filled

MAX_BYTES = 150_000  # bytes of a figure


def test_the_pages_are_what_the_tables_give() -> None:
    for name, text in STUDY.texts.items():
        page = (DOCS / name).read_text(encoding="utf-8")
        assert text(page) == page, "run: python -m studies bench"


def test_every_figure_of_the_pages_is_there_and_small() -> None:
    pages = [(DOCS / name).read_text(encoding="utf-8") for name in STUDY.texts]
    assert {name for page in pages for name in re.findall(r"\]\((figures/\w+\.png)\)", page)} == set(STUDY.figures)
    for name in STUDY.figures:
        assert (DOCS / name).stat().st_size < MAX_BYTES


def test_a_page_without_a_place_for_a_part_is_refused() -> None:
    with pytest.raises(SystemExit, match="no place for 'findings'"):
        filled({"findings": str})("# A page\n")
