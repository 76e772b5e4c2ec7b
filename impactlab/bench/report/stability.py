"""The stability report: every method on every hard case, from the table alone."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from impactlab.bench.report import sheets
from impactlab.bench.report.read import read_table
from impactlab.bench.report.sheets import Sheet, headings
from impactlab.bench.report.verdicts import ERROR_WARN, BenchVerdict, faults, result_warnings, verdict, worst_error
from impactlab.bench.report.write import STABILITY, replaced
from impactlab.bench.schema import Row
from impactlab.report.page import rendered

LONG = "long_runs"  # the case whose methods differ by their number of steps
STEPS = re.compile(r"_1e(\d+)$")

Block = tuple[str, str | Sheet]
"""A heading (or nothing) and a paragraph or a table."""


def write_stability(out_dir: Path, table_path: Path) -> int:
    """Write ``stability.md`` and ``stability.html`` into a folder; return the number of violations in the table.

    Parameters
    ----------
    out_dir : Path
        An existing folder.
    table_path : Path
        Table of `impactlab bench --suite hard`.

    Raises
    ------
    CaseError
        If the file is not the table of a bench, or the folder holds pages of these names that no report wrote.
    """
    rows = read_table(table_path)
    blocks = report(rows)
    with replaced(out_dir, STABILITY) as draft:
        text = "# Stability on hard cases\n\n" + markdown(blocks)
        (draft / "stability.md").write_text(text, encoding="utf-8")
        page = rendered("impactlab.bench.report", "stability.html.j2", blocks=blocks)
        (draft / "stability.html").write_text(page, encoding="utf-8")
    return len(faults(rows))


def report(rows: Sequence[Row]) -> list[Block]:
    """Return the blocks of the report: counts, violations, matrices by case, reasons, energy over long runs."""
    codes = Codes(rows)
    counts = Counter(verdict(row) for row in rows)
    summary = (
        f"{len(rows)} rows: {counts[BenchVerdict.RIGHT]} right to {100 * ERROR_WARN:.0f} % (✓), "
        f"{counts[BenchVerdict.WARNED]} wrong by more with a warning (w), {counts[BenchVerdict.UNKNOWN]} without a "
        f"reference (?), {counts[BenchVerdict.REFUSED]} refused (r), {counts[BenchVerdict.FAILED]} failed (F), "
        f"{counts[BenchVerdict.VIOLATION]} "
        "violations (!). A percentage is the larger error of displacement and impulse; codes such as r1 and F1 stand "
        "for the reasons listed at the end; the word behind w is the warning."
    )
    found = [[row.scene, row.method, fault] for row, fault in faults(rows)]
    blocks: list[Block] = [
        ("", summary),
        ("Violations", table(["case", "method", "violation"], found) if found else "None."),
    ]
    cases = list(dict.fromkeys(row.case for row in rows))
    blocks += [(case, matrix([row for row in rows if row.case == case], codes)) for case in cases if case != LONG]
    if LONG in cases:
        blocks.append((f"Energy over {LONG}", drift([row for row in rows if row.case == LONG])))
    return [*blocks, ("Why methods were refused", codes.legend("r")), ("Why runs failed", codes.legend("F"))]


def table(heads: Sequence[str], lines: Iterable[Sequence[str]]) -> Sheet:
    """Return a table of words."""
    return Sheet("", "", "", headings(*heads, text=heads), tuple(tuple(line) for line in lines))


class Codes:
    """Codes of reasons in the order of the table.

    Reasons that differ by numbers and names alone share one.
    """

    def __init__(self, rows: Iterable[Row]) -> None:
        self._known: dict[tuple[str, str], str] = {}  # letter and reason: code
        self._counts: Counter[str] = Counter()
        for row in rows:
            if row.status in ("refused", "failed"):
                letter, reason = _key(row)
                number = 1 + sum(known == letter for known, _ in self._known)
                self._counts[self._known.setdefault((letter, reason), f"{letter}{number}")] += 1

    def of(self, row: Row) -> str:
        """Return the code of a row that was refused or failed."""
        return self._known[_key(row)]

    def legend(self, letter: str) -> str | Sheet:
        """Return the reasons of one letter, with how often each was given."""
        known = [(code, reason) for (each, reason), code in self._known.items() if each == letter]
        lines = [[code, str(self._counts[code]), reason] for code, reason in known]
        return table(["code", "rows", "reason (# for a number, '…' for a name)"], lines) if lines else "None."


def _key(row: Row) -> tuple[str, str]:
    return "r" if row.status == "refused" else "F", alike(row.reason)


def alike(reason: str) -> str:
    """Return a reason without its numbers and names, which differ from row to row."""
    text = re.sub(r" \(t = .*?\)$", "", reason)
    text = re.sub(r"'[^']*'", "'…'", text)
    text = re.sub(r"\bcontact \S+:|\b\S+\|\S+", "the contact", text)
    return re.sub(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w])", "#", text)


def matrix(rows: Sequence[Row], codes: Codes) -> Sheet:
    """Return methods by variants of one case."""
    variants = list(dict.fromkeys(row.variant for row in rows))
    known = {(row.method, row.variant): cell(row, codes) for row in rows}
    methods = dict.fromkeys(row.method for row in rows)
    lines = [[method, *(known.get((method, variant), "") for variant in variants)] for method in methods]
    return table(["method", *variants], lines)


def cell(row: Row, codes: Codes) -> str:
    """Return a cell of a matrix: mark, and error, warning or code of the reason."""
    mark = verdict(row)
    if row.status in ("refused", "failed"):
        return codes.of(row) + (" !" if mark is BenchVerdict.VIOLATION else "")
    error = worst_error(row)
    share = "" if error is None else f" {percent(error)}"
    word = f" {result_warnings(row)[0]}" if mark is BenchVerdict.WARNED else ""
    return f"{mark.value}{share}{word}"


def percent(share: float) -> str:
    """Return a share in percent, two digits; rounding is named as such."""
    return "<1e-4 %" if share < 1e-6 else f"{float(f'{100.0 * share:.2g}'):g} %"


def drift(rows: Sequence[Row]) -> Sheet:
    """Return gains and losses of energy by number of steps.

    The table has one line per method of the case of long runs.
    """
    known: dict[str, dict[int, Row]] = {}
    for row in rows:
        if (steps := STEPS.search(row.method)) and row.variant in ("", "base"):
            known.setdefault(STEPS.sub("", row.method), {})[int(steps.group(1))] = row
    sizes = sorted({size for found in known.values() for size in found})
    lines = []
    for method, found in known.items():
        last = found[max(found)]
        contacts = "" if last.contacts is None else str(last.contacts)
        changes = [_changes(found.get(size)) for size in sizes]
        lines.append([method, *changes, contacts, last.warnings.replace(";", ", ")])
    columns = [f"1e{size} steps, gain and loss" for size in sizes]
    return table(["method", *columns, "contacts in the longest", "warnings"], lines)


def _changes(row: Row | None) -> str:
    """Return a run's largest gain and loss over its reference energy, or its status."""
    if row is None or not row.completed:
        return "" if row is None else row.status
    return f"{row.energy_gain or 0.0:.1e}, {row.energy_loss or 0.0:.1e}"


def markdown(blocks: Iterable[Block]) -> str:
    """Return blocks as Markdown."""
    parts = [
        (f"## {heading}\n\n" if heading else "") + (body if isinstance(body, str) else sheets.markdown(body).rstrip())
        for heading, body in blocks
    ]
    return "\n\n".join(parts) + "\n"
