"""The pages docs/theory/*.md: every block of Python beside a formula runs, and its assertions hold."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
PAGES = {page.stem: page.read_text(encoding="utf-8") for page in sorted((ROOT / "docs" / "theory").glob("*.md"))}
WITH_CHECKS = sorted(name for name, text in PAGES.items() if "```python" in text)


def test_each_page_with_formulas_has_a_check() -> None:
    assert {name for name, text in PAGES.items() if "$$" in text} == set(WITH_CHECKS)


@pytest.mark.parametrize("name", WITH_CHECKS)
def test_formulas_hold(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", PAGES[name], flags=re.DOTALL)
    assert sum(block.count("assert ") for block in blocks) > 0
    names: dict[str, Any] = {}
    for block in blocks:
        exec(compile(block, name, "exec"), names)
