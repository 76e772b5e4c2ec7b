"""The stability report: every method on every hard case, from the table alone."""

from __future__ import annotations

import html
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from impactlab.bench.report.read import read_table
from impactlab.bench.report.verdicts import WRONG, Verdict, faults, told, verdict, worst_error
from impactlab.bench.report.write import STABILITY, write_pages
from impactlab.bench.schema import Row

LONG = "long_runs"  # the case whose methods differ by their number of steps
STEPS = re.compile(r"_1e(\d+)$")


def write_stability(out_dir: Path, table_path: Path) -> int:
    """Write ``stability.md`` and ``stability.html`` into a folder; return how many violations the table holds.

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
    text = "# Stability on hard cases\n\n" + markdown(blocks)
    write_pages(out_dir, dict(zip(STABILITY, (text, webpage(blocks)), strict=True)))
    return len(faults(rows))


Table = list[list[str]]
Block = tuple[str, str | Table]
"""A heading (or nothing) and a paragraph or a table whose first line is its head."""


def report(rows: Sequence[Row]) -> list[Block]:
    """Return the blocks of the report: counts, violations, one matrix per case, reasons, energy over long runs."""
    codes = Codes(rows)
    counts = Counter(verdict(row) for row in rows)
    blocks: list[Block] = [
        (
            "",
            f"{len(rows)} rows: {counts[Verdict.RIGHT]} right to {100 * WRONG:.0f} % (✓), {counts[Verdict.TOLD]} wrong "
            f"by more and said so (w), {counts[Verdict.UNKNOWN]} with nothing to measure them by (?), "
            f"{counts[Verdict.REFUSED]} refused (r), {counts[Verdict.FAILED]} failed (F), "
            f"{counts[Verdict.VIOLATION]} violations (!). A percentage is the larger error of displacement and "
            "impulse; codes such as r1 and F1 are told below; the word behind w is what warned.",
        )
    ]
    found = faults(rows)
    blocks.append(("Violations", "None." if not found else ""))
    if found:
        blocks.append(("", [["case", "method", "what"], *([row.scene, row.method, fault] for row, fault in found)]))
    for case in dict.fromkeys(row.case for row in rows):
        if case != LONG:
            blocks += [(case, matrix([row for row in rows if row.case == case], codes))]
    if any(row.case == LONG for row in rows):
        blocks.append((f"Energy over {LONG}", drift([row for row in rows if row.case == LONG])))
    for title, letter in (("Why methods were refused", "r"), ("Why runs failed", "F")):
        blocks.append((title, codes.legend(letter)))
    return blocks


class Codes:
    """Codes of reasons in the order of the table: those that differ by numbers and names alone share one."""

    def __init__(self, rows: Iterable[Row]) -> None:
        self._known: dict[str, str] = {}
        self._counts: Counter[str] = Counter()
        for row in rows:
            if row.status in ("refused", "failed"):
                letter = "r" if row.status == "refused" else "F"
                number = 1 + sum(code[0] == letter for code in self._known.values())
                code = self._known.setdefault(letter + alike(row.reason), f"{letter}{number}")
                self._counts[code] += 1

    def of(self, row: Row) -> str:
        """Return the code of a row that was refused or failed."""
        return self._known[("r" if row.status == "refused" else "F") + alike(row.reason)]

    def legend(self, letter: str) -> str | Table:
        """Return the reasons of one letter, with how often each was given."""
        lines = [[code, str(self._counts[code]), text[1:]] for text, code in self._known.items() if text[0] == letter]
        return [["code", "rows", "reason (# for a number, '…' for a name)"], *lines] if lines else "None."


def alike(reason: str) -> str:
    """Return a reason without its numbers and names, which differ from row to row."""
    text = re.sub(r" \(t = .*?\)$", "", reason)
    text = re.sub(r"'[^']*'", "'…'", text)
    text = re.sub(r"\bcontact \S+:|\b\S+\|\S+", "the contact", text)
    return re.sub(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w])", "#", text)


def matrix(rows: Sequence[Row], codes: Codes) -> Table:
    """Return methods by variants of one case."""
    variants = list(dict.fromkeys(row.variant for row in rows))
    methods = dict.fromkeys(row.method for row in rows)
    known = {(row.method, row.variant): row for row in rows}
    lines = [["method", *variants]]
    for method in methods:
        cells = [known.get((method, variant)) for variant in variants]
        lines.append([method, *("" if row is None else cell(row, codes) for row in cells)])
    return lines


def cell(row: Row, codes: Codes) -> str:
    """Return a cell of a matrix: the mark, and the error, the warning or the code of the reason."""
    mark = verdict(row)
    if row.status in ("refused", "failed"):
        return codes.of(row) + (" !" if mark is Verdict.VIOLATION else "")
    error = worst_error(row)
    share = "" if error is None else f" {percent(error)}"
    word = f" {told(row)[0]}" if mark is Verdict.TOLD else ""
    return f"{mark.value}{share}{word}"


def percent(share: float) -> str:
    """Return a share in percent, two digits; rounding is named as such."""
    return "<1e-4 %" if share < 1e-6 else f"{float(f'{100.0 * share:.2g}'):g} %"


def drift(rows: Sequence[Row]) -> Table:
    """Return gains and losses of energy by number of steps, one line per method of the case of long runs."""
    lines: dict[str, dict[int, Row]] = {}
    for row in rows:
        if (steps := STEPS.search(row.method)) and row.variant in ("", "base"):
            lines.setdefault(STEPS.sub("", row.method), {})[int(steps.group(1))] = row
    sizes = sorted({size for found in lines.values() for size in found})
    head = ["method", *(f"1e{size} steps: gain, loss" for size in sizes), "contacts in the longest", "warnings"]
    return [
        head,
        *([method, *(ledger(found.get(size)) for size in sizes), *last(found)] for method, found in lines.items()),
    ]


def ledger(row: Row | None) -> str:
    """Return the largest gain and loss of a run over its initial energy, or the end of the run."""
    if row is None:
        return ""
    if not row.completed:
        return row.status
    return f"{row.energy_gain or 0.0:.1e}, {row.energy_loss or 0.0:.1e}"


def last(found: dict[int, Row]) -> list[str]:
    """Return contacts and warnings of the run with the most steps."""
    row = found[max(found)]
    return ["" if row.contacts is None else str(row.contacts), row.warnings.replace(";", ", ")]


def markdown(blocks: Iterable[Block]) -> str:
    """Return blocks as Markdown."""
    parts = []
    for heading, body in blocks:
        if heading:
            parts.append(f"## {heading}\n")
        if isinstance(body, str):
            parts.append(f"{body}\n" if body else "")
        else:
            head, *lines = [[text.replace("|", "\\|") for text in line] for line in body]
            rule = "|---" * len(head) + "|"
            parts.append(
                "\n".join(["| " + " | ".join(head) + " |", rule, *("| " + " | ".join(x) + " |" for x in lines)])
            )
            parts.append("")
    return "\n".join(parts)


STYLE = (
    "body{font:15px/1.45 system-ui,sans-serif;margin:2em;max-width:110em}table{border-collapse:collapse;font-size:13px}"
    "th,td{border:1px solid #ccc;padding:2px 6px;text-align:left;vertical-align:top}th{background:#eee}"
)


def webpage(blocks: Iterable[Block]) -> str:
    """Return blocks as one HTML page that needs nothing else."""
    parts = []
    for heading, body in blocks:
        if heading:
            parts.append(f"<h2>{html.escape(heading)}</h2>")
        if isinstance(body, str):
            parts.append(f"<p>{html.escape(body)}</p>" if body else "")
        else:
            head, *lines = body
            parts.append("<table><tr>" + "".join(f"<th>{html.escape(text)}</th>" for text in head) + "</tr>")
            parts += ["<tr>" + "".join(f"<td>{html.escape(text)}</td>" for text in line) + "</tr>" for line in lines]
            parts.append("</table>")
    title = "Stability on hard cases"
    head_text = f"<!doctype html><html lang='en'><meta charset='utf-8'><title>{title}</title><style>{STYLE}</style>"
    return head_text + f"<h1>{title}</h1>" + "\n".join(parts) + "</html>\n"
