"""The automatic choice as summary lines for people, and as `impactlab choose` document for scripts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from impactlab.printing import plain
from impactlab.refine import choice as automatic
from impactlab.refine import ladder as ladder_of
from impactlab.refine.errors.distances import counted, difference
from impactlab.refine.references import reference
from impactlab.refine.search import Search, show_order
from impactlab.refine.studies import studies_of
from impactlab.report.comparison import solution_words
from impactlab.report.summary import method
from impactlab.scene.method import Simulation

if TYPE_CHECKING:
    from impactlab.history.base import AbstractHistory

HEADINGS = ("candidate", "predicted", "estimated", "measured", "predicted ms", "solved ms", "verdict", "reason")
TEXTS = ("candidate", "verdict")  # columns of words, aligned at the left


def choose(label: str, request: Simulation, physics: Simulation) -> dict[str, Any]:
    """Return the choice of a run, and all descriptions refined to tolerance.

    Each description is refined until it keeps the tolerance. Where a description does so in two runs, which show no
    order, a third and coarser one shows it. Of runs that the choice has made, too, the estimates are those of the
    choice, by the runs it had then.

    ``physics`` are the scene and the laws that errors refer to. Measured errors are the largest relative ones of the
    quantities that count; None without a reference.
    """
    exact = reference.find(*physics)
    history = automatic.run(*request)
    assert history.choice is not None  # noqa: S101 - a scene with a tolerance has one

    def measured(run: AbstractHistory) -> float | None:
        return None if exact is None else difference(run, exact.history, *counted(request))

    chosen = {each.candidate: each for each in history.choice.ladder if each.estimated_error is not None}
    studies, why = studies_of(request)
    ladder = []
    for study in studies:
        best = Search(request).best([study])
        show_order(study, request)
        for level in study.levels:
            record = ladder_of.candidate(study, level, "trial", level.reason)
            error = level.error
            if (own := chosen.get(record.candidate)) is not None and own.estimated_error is not None:
                error = own.estimated_error
                reason = level.reason if own.verdict == "chosen" else own.reason
                record = record._replace(estimated_error=error, reason=reason)
            met = error <= history.choice.tolerance
            ladder.append(record._replace(measured_error=measured(level.history), verdict="kept" if met else "trial"))
        if best is None or best[1].error > history.choice.tolerance:
            ladder.append(ladder_of.candidate(study, None, "rejected", study.closed))
    document = {
        "schema_version": 1,
        "case": label,
        "tolerance": history.choice.tolerance,
        "reference": None if exact is None else exact.name,
        "reference_uncertainty": None if exact is None else exact.uncertainty,
        "choice": history.choice.document(method(history)),
        "measured_error": measured(history),
        "solve_s": history.cost.solve_s,
        "ladder": [candidate._asdict() for candidate in ladder + ladder_of.not_served(why)],
    }
    return {key: plain(value) for key, value in document.items()}


def choice_lines(choice: Mapping[str, Any]) -> list[str]:
    """Return the choice of a summary as lines of text."""
    lines = [
        f"  choice    tolerance {choice['tolerance']:g}: {choice['chosen']['candidate']}",
        f"            expected error {_number(choice['expected_error'])}: {choice['estimate']}",
    ]
    for rung in choice["ladder"]:
        if rung["verdict"] in ("rejected", "refused", "not run"):
            lines.append(f"            {rung['verdict']}: {rung['candidate']}: {rung['reason']}")
    return [*lines, f"            {_number(1e3 * choice['choosing_s'])} ms spent choosing"]


def ladder_text(document: Mapping[str, Any]) -> str:
    """Return the document of `choose` as text."""
    choice = document["choice"]
    found = document["reference"]
    against = solution_words(found) if found else "nothing: no reference converged"
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
    rows: list[tuple[str, ...]] = [HEADINGS]
    for rung in rungs:
        errors = [_number(rung[key]) for key in ("predicted_error", "estimated_error", "measured_error")]
        times = [_number(None if rung[key] is None else 1e3 * rung[key]) for key in ("predicted_s", "solve_s")]
        rows.append((rung["candidate"], *errors, *times, rung["verdict"], rung["reason"]))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)][:-1]  # the reason is as long as it is
    lines = []
    for row in rows:
        cells = [
            cell.ljust(width) if heading in TEXTS else cell.rjust(width)
            for heading, cell, width in zip(HEADINGS, row, widths, strict=False)
        ]
        lines.append("  ".join([*cells, row[-1]]).rstrip())
    return [lines[0], "  ".join("-" * width for width in widths), *lines[1:]]


def _number(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.0f}" if 99.5 <= value < 1e6 else f"{value:.2g}"
