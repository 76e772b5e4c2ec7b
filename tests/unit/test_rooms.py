"""Laws, schemes and descriptions of rods do not know each other: they meet in records only."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import impactlab
from impactlab.integrators.base import AbstractIntegrator
from impactlab.types import Port

ROOT = Path(impactlab.__file__).parent
PLUGINS = ROOT.parent / "plugins"


@pytest.mark.parametrize("room", ["integrators", "contact", "models", "bases", "simulate/adaptive", "exact"])
def test_rooms_import_no_parts_of_another_kind(room: str) -> None:
    forbidden = {"integrators": "contact", "contact": "integrators|models|bases", "models": "contact|integrators"}
    others = forbidden.get(room, "contact|integrators")
    # The bases, abstract, are where rooms meet.
    pattern = rf"^\s*(?:from|import) impactlab\.(?:{others})\.(?!base\b)\w+"
    for path in sorted((ROOT / room).rglob("*.py")):
        assert re.findall(pattern, path.read_text(encoding="utf-8"), re.MULTILINE) == [], path.name


def test_no_law_reads_where_the_force_of_a_scheme_acts() -> None:
    # A port has the values there; that a scheme's F dt holds a closing jump is all that a law knows of it.
    facts = set(AbstractIntegrator.__annotations__) - {"jump_in_force"}
    assert {"load_point", "velocity_point", "projects_first"} < facts
    assert not facts & {name for name, _ in Port._fields_}
    files = [*(ROOT / "contact").glob("*.py"), *PLUGINS.glob("*/*/law.py")]
    assert len(files) > 15
    for path in files:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        read = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
        assert not read & facts, path.name
