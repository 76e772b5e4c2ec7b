"""The page docs/messages.md lists every code of a warning, and no other; every refusal on it says what to do."""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path

import pytest

import impactlab

PACKAGE = Path(impactlab.__file__).parent
PAGE = (Path(__file__).parents[2] / "docs" / "messages.md").read_text(encoding="utf-8")


def codes_in_the_code() -> set[str]:
    """Return the first argument of each `Warned`, and the code of each `Noted`, that is written out."""
    found = set()
    sources = (path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py"))
    for source in (each for each in sources if "Warned(" in each or "Noted(" in each):
        for node in ast.walk(ast.parse(source)):
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name):
                continue
            given = {"Warned": node.args[:1], "Noted": [key.value for key in node.keywords if key.arg == "code"]}
            found |= {each.value for each in given.get(node.func.id, []) if isinstance(each, ast.Constant)}
    return found


def test_the_page_lists_every_code_of_a_warning() -> None:
    listed = set(re.findall(r"^\| `(\w+)` \|", PAGE.partition("## Warnings")[2], flags=re.MULTILINE))
    assert listed == codes_in_the_code()
    assert len(listed) > 15


def test_every_refusal_has_a_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "docs" / "_ext"))
    found = importlib.import_module("refusals").refusals()
    assert len(found) > 250
    assert [each.text for each in found if not each.remedy] == []
