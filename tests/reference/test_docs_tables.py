"""Every link of the docs leads to a file."""

from __future__ import annotations

import re

from studies.pages import DOCS


def test_every_link_of_the_docs_leads_somewhere() -> None:
    ours = sorted(page.name for page in DOCS.glob("*.md"))
    pages = [DOCS / name for name in ours] + [DOCS / "paper" / "ledger.md", DOCS / "paper" / "figures" / "README.md"]
    pages.append(DOCS.parent / "CONTRIBUTING.md")
    for page in pages:
        for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            assert (page.parent / link).exists(), f"{page.name}: {link}"
