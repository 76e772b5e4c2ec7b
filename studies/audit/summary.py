"""The rows of the study as a table by family, and as a page."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

Row = dict[str, Any]

HEADS = (
    "family", "runs", "not known", "refused or failed", "beyond, silent", "beyond, warned", "not met, kept",
    "true/tolerance, median", "stated/true: least", "1 %", "median", "median cost [ms]",
)  # fmt: skip
WARNINGS = ("tolerance_not_met",)


def number(row: Row, name: str) -> float:
    """Return a cell as a number, NaN where it is empty."""
    return float(row[name]) if row[name] not in ("", None) else float("nan")


def load(path: Path) -> list[Row]:
    """Return the rows of a file."""
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


KEPT = (
    *("family", "number", "tolerance", "status", "met"),
    *("stated", "true", "displacement", "impulse", "peak", "uncertainty", "known", "solve_s"),
)


def keep(rows: list[Row], path: Path) -> None:
    """Write the cells of rows that the tables need, in three digits."""
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(KEPT)
        for row in rows:
            cells = [row[name] for name in KEPT]
            writer.writerow([f"{float(c):.3g}" if n > 4 and c not in ("", None) else c for n, c in enumerate(cells)])


def is_beyond(row: Row) -> bool:
    """Return whether a finished run is beyond its tolerance.

    The truth must be known.
    """
    return not number(row, "true") <= number(row, "tolerance")


def is_warned(row: Row) -> bool:
    """Return whether a run states itself that its tolerance is not met."""
    return str(row["met"]) != "1" or any(code in str(row["warned"]).split() for code in WARNINGS)


def line(name: str, rows: list[Row]) -> list[str]:
    """Return the cells of a family."""
    ran = [row for row in rows if row["status"] == "ran"]
    known = [row for row in ran if str(row["known"]) == "1"]
    beyond = [row for row in known if is_beyond(row)]
    silent = [row for row in beyond if not is_warned(row)]
    shares = [number(row, "true") / number(row, "tolerance") for row in known]
    # A true error that the truth itself does not resolve gives no ratio.
    stated = [
        number(row, "stated") / number(row, "true")
        for row in known
        if number(row, "true") > 3.0 * number(row, "uncertainty") and number(row, "true") > 1e-9
    ]
    cost = [1e3 * number(row, "solve_s") for row in ran]
    return [
        name,
        str(len(rows)),
        str(len(ran) - len(known)),
        str(len(rows) - len(ran)),
        str(len(silent)),
        str(len(beyond) - len(silent)),
        str(sum(is_warned(row) and not is_beyond(row) for row in known)),
        f"{np.median(shares):.2g}" if shares else "",
        f"{min(stated):.2g}" if stated else "",
        f"{np.quantile(stated, 0.01):.2g}" if stated else "",
        f"{np.median(stated):.2g}" if stated else "",
        f"{np.median(cost):.2f}" if cost else "",
    ]


def markdown(heads: Sequence[str], line: Callable[[str, list[Row]], list[str]], rows: Iterable[Row]) -> str:
    """Return a table with one line a family, and one for all."""
    rows = list(rows)
    families = list(dict.fromkeys(row["family"] for row in rows))
    lines = [line(name, [row for row in rows if row["family"] == name]) for name in families]
    if len(families) > 1:
        lines.append(line("all", rows))
    return "\n".join(f"| {' | '.join(row)} |" for row in [list(heads), ["---"] * len(heads), *lines])


def table(rows: Iterable[Row]) -> str:
    """Return the table by family as Markdown."""
    return markdown(HEADS, line, rows)


def cost(rows: list[Row], before: list[Row]) -> str:
    """Return the table of median costs beside another version's.

    Both are on the same cases.
    """
    known = {(row["family"], str(row["number"])): row for row in before}

    def beside(name: str, some: list[Row]) -> list[str]:
        pairs = [(row, known.get((row["family"], str(row["number"])))) for row in some]
        both = [(a, b) for a, b in pairs if b is not None and a["status"] == b["status"] == "ran"]
        cells = [name, str(len(both))]
        for key in ("solve_s", "wall_s"):
            new, old = ([1e3 * number(pair[i], key) for pair in both] for i in (0, 1))
            ratio = np.median([x / y for x, y in zip(new, old, strict=True)])
            cells += [f"{np.median(old):.2f}", f"{np.median(new):.2f}", f"{np.median(new) / np.median(old):.2f}"]
            cells.append(f"{ratio:.2f}")
        return cells

    rows = [row for row in rows if (row["family"], str(row["number"])) in known]
    heads = ["family", "runs"]
    for what in ("solving", "choosing and solving"):
        heads += [f"{what}: median before [ms]", "now [ms]", "ratio", "median of ratios"]
    return markdown(heads, beside, rows)


def worst(rows: Iterable[Row], count: int = 15) -> list[str]:
    """Return the runs that are most beyond their tolerance, silent ones first."""
    known = [row for row in rows if row["status"] == "ran" and str(row["known"]) == "1" and is_beyond(row)]
    known.sort(key=lambda row: (is_warned(row), -number(row, "true") / number(row, "tolerance")))
    said = []
    for row in known[:count]:
        parts = ", ".join(f"{name} {number(row, name):.2g}" for name in ("displacement", "impulse", "peak"))
        said.append(
            f"{row['family']} {row['number']}: tolerance {number(row, 'tolerance'):g}, stated "
            f"{number(row, 'stated'):.2g}, true {number(row, 'true'):.2g} ({parts}), {row['chosen']}"
            f"{', warned' if is_warned(row) else ''}"
        )
    return said


def fill(page: Path, name: str, text: str) -> None:
    """Put a table between its marks in a page."""
    marks = re.compile(rf"(<!-- table: {re.escape(name)} -->\n).*?(<!-- end of table -->)", re.DOTALL)
    before = page.read_text(encoding="utf-8")
    if not marks.search(before):
        raise ValueError(f"{page} has no table {name!r}")
    page.write_text(marks.sub(lambda found: f"{found.group(1)}{text}\n{found.group(2)}", before), encoding="utf-8")
