"""The tables of how-to-choose.md are what the runs give, times left out, and say what the text around them says."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from typing import Any

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.fixture(scope="module")
def tables() -> Any:
    spec = importlib.util.spec_from_file_location("docs_tables", DOCS / "tables.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_committed_tables_are_what_the_runs_give(tables: Any) -> None:
    page = (DOCS / "how-to-choose.md").read_text(encoding="utf-8")
    assert tables.without_times(tables.filled(page)) == tables.without_times(page), "run docs/tables.py again"


def test_every_link_of_the_docs_leads_somewhere() -> None:
    ours = sorted(page.name for page in DOCS.glob("*.md") if not page.name.endswith(".head.md"))
    pages = [DOCS / name for name in ours] + [DOCS / "paper" / "ledger.md", DOCS / "paper" / "figures" / "README.md"]
    pages.append(DOCS.parent / "CONTRIBUTING.md")
    for page in pages:
        for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            assert (page.parent / link).exists(), f"{page.name}: {link}"
