"""The table of a comparison as Markdown, as CSV, and as cells for the page."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from typing import Any, NamedTuple

from impactlab.report.comparison import COLUMNS, TEXT, cells, headings, table_rows, units_of

JUDGED = ("mass", "face", "impulse")
"""The columns in which the smallest value is the best."""
FIRST = ("method", "mass", "face", "impulse", "first opening", "contacts", "gain", "loss", "solve", "steps", "dt")
"""The columns of the page, errors first: a narrow screen shows the first few."""
UNDER = ("model", "law", "integrator")
"""Columns in small type under the name of a method on the page, as are the codes of its warnings."""


class Cell(NamedTuple):
    """One cell of the page's table."""

    text: str
    best: bool
    numeric: bool
    value: float | None = None  # to sort by; None of a text


def page_headings(comparison: Mapping[str, Any]) -> list[tuple[str, str, bool]]:
    """Return the headings of the page's table: name, unit, and whether numbers stand below."""
    units = units_of(comparison)
    return [(name, units[name], name not in TEXT) for name in FIRST]


def page_rows(comparison: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the rows of the page's table.

    A row has name and failure, or name, under, warnings, and cells (of `Cell`).
    """
    rows = table_rows(comparison)
    stepped = [row for row in rows if row["dt"] is not None]  # the exact solution would only win against itself
    best = {name: min((row[name] for row in stepped if row[name] is not None), default=None) for name in JUDGED}
    page: list[dict[str, Any]] = []
    for row in rows:
        if "failure" in row:
            page.append({"name": row["method"], "failure": row["failure"]})
            continue
        texts = dict(zip(COLUMNS, cells(row), strict=True))
        marked = {
            name
            for name in JUDGED
            if len(stepped) > 1 and row in stepped and row[name] is not None and row[name] == best[name]
        }
        page.append(
            {
                "name": row["method"],
                "under": " · ".join(row[name] for name in UNDER if row[name]),
                "warnings": row["warnings"],
                "cells": [
                    Cell(texts[name], name in marked, name not in TEXT, _number(row[name])) for name in FIRST[1:]
                ],
            }
        )
    return page


def _number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) else None


def markdown(comparison: Mapping[str, Any]) -> str:
    """Return the table in Markdown; numbers stand at the right."""
    lines = [headings(comparison), ["---" if name in TEXT else "---:" for name in COLUMNS]]
    for row in table_rows(comparison):
        failed = [row["method"], row.get("failure", ""), *[""] * (len(COLUMNS) - 2)]
        lines.append(failed if "failure" in row else cells(row))
    safe = ([text.replace("|", "\\|").replace("\n", " ") for text in line] for line in lines)
    return "".join(f"| {' | '.join(line)} |\n" for line in safe)


def comma_separated(comparison: Mapping[str, Any]) -> str:
    """Return the table as CSV with full digits, missing values empty, failures last."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([*headings(comparison), "failure"])
    for row in table_rows(comparison):
        values = ["" if row[name] is None else row[name] for name in COLUMNS]
        writer.writerow([*values, row.get("failure", "")])
    return buffer.getvalue()
