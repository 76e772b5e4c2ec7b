"""Markdown tables of the measured pages."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence


def table(heads: Sequence[str], rows: Iterable[Sequence[object]], text: Collection[str] = ()) -> str:
    """Return a Markdown table; columns of numbers stand to the right, those named in ``text`` to the left."""
    rule = "|".join("---" if head in text else "---:" for head in heads)
    first, *others = ["|".join(f" {cell} " if cell != "" else " " for cell in line) for line in (heads, *rows)]
    return "\n".join(f"|{line}|" for line in (first, rule, *others))
