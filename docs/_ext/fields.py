"""Fields of classes in the reference of Python: their types, and the comments behind them, which have the units."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from itertools import takewhile
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx

SECTION = re.compile(r"^(Parameters|Attributes)$")
BEFORE_NAPOLEON = 400  # which turns sections of docstrings into reStructuredText


def fields_of(source: str) -> list[tuple[str, str, str]]:
    """Return name, type and comment of each public field in the source of a class, its class variables included."""
    lines = source.splitlines()
    found = []
    for node in ast.parse(source).body[0].body:  # type: ignore[attr-defined]  # of a class
        if not isinstance(node, ast.AnnAssign) or not isinstance(node.target, ast.Name):
            continue
        behind = lines[(node.end_lineno or 1) - 1].encode()[node.end_col_offset :].decode()
        further = takewhile(lambda line: line.lstrip().startswith("#"), lines[node.end_lineno :])
        comment = " ".join(line.partition("#")[2].strip() for line in (behind, *further))
        if not node.target.id.startswith("_"):
            kind = re.sub(r"^ClassVar\[(.*)\]$", r"\1", ast.unparse(node.annotation))
            found.append((node.target.id, kind, comment.strip()))
    return found


def add(_app: Sphinx, what: str, _name: str, documented: Any, _options: Any, lines: list[str]) -> None:
    """Add the fields of a record to its docstring, unless this describes them or none has a comment."""
    if what != "class" or not inspect.isclass(documented) or any(map(SECTION.match, lines)):
        return
    fields = fields_of(textwrap.dedent(inspect.getsource(documented)))
    if any(comment for *_, comment in fields):
        lines += ["", "Attributes", "----------"]
        for name, kind, comment in fields:
            lines += [f"{name} : {kind}", f"    {comment}"]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("autodoc-process-docstring", add, priority=BEFORE_NAPOLEON)
    return {"parallel_read_safe": True}
