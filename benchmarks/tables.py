"""Markdown tables of the measured pages, and pages with them."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path

HERE = Path(__file__).resolve().parent


def table(heads: Sequence[str], rows: Iterable[Sequence[object]], text: Collection[str] = ()) -> str:
    """Return a Markdown table.

    Columns of numbers are aligned to the right, those named in ``text`` to the left.
    """
    rule = "|".join("---" if head in text else "---:" for head in heads)
    first, *others = ["|".join(f" {cell} " if cell != "" else " " for cell in line) for line in (heads, *rows)]
    return "\n".join(f"|{line}|" for line in (first, rule, *others))


def figure(value: float, digits: int = 2) -> str:
    """Return a number of a table; "-" where a run did not end."""
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"


def page(head: str, parts: Mapping[str, str]) -> str:
    """Return the text of ``head`` with each part in place of its comment.

    ``head`` is a file beside this one.
    """
    text = (HERE / head).read_text(encoding="utf-8")
    for name, part in parts.items():
        text = text.replace(f"<!-- {name} -->", part)
    return text
