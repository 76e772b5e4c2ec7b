"""The tables of how-to-choose.md are what the runs give, times left out, and say what the text around them says."""

from __future__ import annotations

import re

import pytest

from studies import how_to_choose as tables
from studies.pages import DOCS


@pytest.mark.slow
def test_committed_tables_are_what_the_runs_give() -> None:
    page = (DOCS / "how-to-choose.md").read_text(encoding="utf-8")
    assert tables.without_times(tables.filled(page)) == tables.without_times(page), "run studies.how_to_choose"


def test_every_link_of_the_docs_leads_somewhere() -> None:
    ours = sorted(page.name for page in DOCS.glob("*.md"))
    pages = [DOCS / name for name in ours] + [DOCS / "paper" / "ledger.md", DOCS / "paper" / "figures" / "README.md"]
    pages.append(DOCS.parent / "CONTRIBUTING.md")
    for page in pages:
        for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            assert (page.parent / link).exists(), f"{page.name}: {link}"
