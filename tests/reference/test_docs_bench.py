"""The pages of benchmarks are what their stored tables give, to the letter: they are made from them alone."""

from __future__ import annotations

import re

import pytest

from studies import bench as script
from studies.pages import DOCS

MOST = 150_000  # bytes of a figure


@pytest.mark.parametrize("name", ["rods", "beams"])
def test_the_page_is_what_the_table_gives(name: str) -> None:
    page = script.PAGES[name]
    text = page.path.read_text(encoding="utf-8")
    assert script.filled(text, script.Bench(page.table), page.parts) == text, "run studies.bench again"


@pytest.mark.parametrize("name", ["rods", "beams"])
def test_every_figure_of_the_page_is_there_and_small(name: str) -> None:
    page = script.PAGES[name]
    shown = set(re.findall(r"\]\(figures/(\w+)\.png\)", page.path.read_text(encoding="utf-8")))
    assert shown == set(page.figures)
    for figure in shown:
        assert (DOCS / "figures" / f"{figure}.png").stat().st_size < MOST


def test_a_page_without_a_place_for_a_part_is_refused() -> None:
    with pytest.raises(SystemExit, match="no place for 'findings'"):
        script.filled("# A page\n", None, ["findings"])
