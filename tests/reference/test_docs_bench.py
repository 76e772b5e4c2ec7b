"""The pages of benchmarks are what their stored tables give, to the letter: they are made from them alone."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from typing import Any

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"
MOST = 150_000  # bytes of a figure


@pytest.fixture(scope="module")
def script() -> Any:
    spec = importlib.util.spec_from_file_location("docs_bench", DOCS / "bench.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", ["rods", "beams"])
def test_the_page_is_what_the_table_gives(script: Any, name: str) -> None:
    page = script.PAGES[name]
    text = page.path.read_text(encoding="utf-8")
    assert script.filled(text, script.Bench(page.table), page.parts) == text, "run docs/bench.py again"


@pytest.mark.parametrize("name", ["rods", "beams"])
def test_every_figure_of_the_page_is_there_and_small(script: Any, name: str) -> None:
    page = script.PAGES[name]
    shown = set(re.findall(r"\]\(figures/(\w+)\.png\)", page.path.read_text(encoding="utf-8")))
    assert shown == set(page.figures)
    for figure in shown:
        assert (DOCS / "figures" / f"{figure}.png").stat().st_size < MOST


def test_a_page_without_a_place_for_a_part_is_refused(script: Any) -> None:
    with pytest.raises(SystemExit, match="no place for 'findings'"):
        script.filled("# A page\n", None, ["findings"])
