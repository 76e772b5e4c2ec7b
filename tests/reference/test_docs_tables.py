"""Links and figures of the docs; that pages are what their studies give is compared by `python -m studies --check`."""

from __future__ import annotations

import re

import pytest

from studies.bench import STUDY
from studies.pages import DOCS, filled

MAX_BYTES = 150_000  # bytes of a figure


def test_every_link_of_the_docs_leads_somewhere() -> None:
    ours = sorted(page.name for page in DOCS.glob("*.md"))
    pages = [DOCS / name for name in ours] + [DOCS / "paper" / "ledger.md", DOCS / "paper" / "figures" / "README.md"]
    pages.append(DOCS.parent / "CONTRIBUTING.md")
    for page in pages:
        for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            assert (page.parent / link).exists(), f"{page.name}: {link}"


def test_every_figure_of_the_benches_is_there_and_small() -> None:
    pages = [(DOCS / name).read_text(encoding="utf-8") for name in STUDY.texts]
    assert {name for page in pages for name in re.findall(r"\]\((figures/\w+\.png)\)", page)} == set(STUDY.figures)
    for name in STUDY.figures:
        assert (DOCS / name).stat().st_size < MAX_BYTES
    assert (DOCS / "figures" / "cases.png").stat().st_size < 200_000


def test_a_page_without_a_place_for_a_part_is_refused() -> None:
    with pytest.raises(SystemExit, match="no place for 'findings'"):
        filled({"findings": str})("# A page\n")
