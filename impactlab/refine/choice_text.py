"""The choice and its ladder as text for people."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

HEADINGS = ("candidate", "predicted", "estimated", "measured", "predicted ms", "solved ms", "verdict", "reason")


def choice_lines(choice: Mapping[str, Any]) -> list[str]:
    """Return what a summary says of its choice, for people."""
    lines = [
        f"  choice    tolerance {choice['tolerance']:g}: {choice['chosen']['candidate']}",
        f"            expected error {_number(choice['expected_error'])}: {choice['estimate']}",
    ]
    for rung in choice["ladder"]:
        if rung["verdict"] in ("rejected", "refused", "not run"):
            lines.append(f"            {rung['verdict']}: {rung['candidate']}: {rung['reason']}")
    return [*lines, f"            {_number(1e3 * choice['choosing_s'])} ms spent choosing"]


def ladder_text(document: Mapping[str, Any]) -> str:
    """Return the document of ``impactlab choose`` for people."""
    choice = document["choice"]
    against = document["reference"] or "nothing: no reference converged"
    known = document["reference_uncertainty"]
    title = f"{document['case']}: tolerance {document['tolerance']:g}, measured against {against}"
    lines = [title + (f" (known to {known:.1g})" if known else ""), "", *_table(document["ladder"]), ""]
    lines += [line[2:] for line in choice_lines(choice)]
    lines.append(
        f"          measured error {_number(document['measured_error'])}, "
        f"{_number(1e3 * document['solve_s'])} ms to solve"
    )
    if not choice["met"]:
        lines.append("          the tolerance is not met: this is the best that was found")
    return "\n".join(lines)


def _table(rungs: Iterable[Mapping[str, Any]]) -> list[str]:
    rows = [HEADINGS]
    for rung in rungs:
        errors = [_number(rung[key]) for key in ("predicted_error", "estimated_error", "measured_error")]
        times = [_number(None if rung[key] is None else 1e3 * rung[key]) for key in ("predicted_s", "solve_s")]
        rows.append((rung["candidate"], errors[0], errors[1], errors[2], *times, rung["verdict"], rung["reason"]))
    widths = [max(len(row[i]) for row in rows) for i in range(len(HEADINGS) - 1)]
    texts = (0, 6)
    lines = []
    for row in rows:
        cells = [row[i].ljust(w) if i in texts else row[i].rjust(w) for i, w in enumerate(widths)]
        lines.append("  ".join([*cells, row[-1]]).rstrip())
    return [lines[0], "  ".join("-" * width for width in widths), *lines[1:]]


def _number(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.0f}" if 99.5 <= value < 1e6 else f"{value:.2g}"
