"""The automatic choice compared with the grid: error against tolerance, cost, time to choose."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from impactlab.bench.report.ranking import best, over
from impactlab.bench.report.sheets import DASH, Sheet, headings, milliseconds, short
from impactlab.bench.report.views import BOTH, MAX_UNCERTAINTY, SceneRows, error
from impactlab.bench.schema import Row

KEPT, MISSED, DECLINED, LOST, UNCERTAIN = "kept", "missed", "declined", "failed", "uncertain"
ORDER = (MISSED, LOST, DECLINED, UNCERTAIN, KEPT)  # of the rows of the table
MAX_RATIO = 2.0  # time of a chosen run over the fastest, above which it is counted as costly
MAX_CHOOSING = 10.0  # times its own run that a choice may take


class ChosenRun(NamedTuple):
    """One automatic run."""

    scene: str
    row: Row
    measured: float | None  # larger error of displacement and impulse
    verdict: str
    rival: Row | None  # the fastest row of any method that meets the tolerance
    over_best: float | None  # time to solve over the rival's
    choosing: float | None  # time to choose over time to solve


def choices(scenes: Sequence[SceneRows]) -> list[ChosenRun]:
    """Return all rows of the automatic choice, with their measured errors."""
    return [_choice(row, scene) for scene in scenes for row in scene.automatic]


def _choice(row: Row, scene: SceneRows) -> ChosenRun:
    tolerance, measured = row.tolerance_asked, error(row, BOTH, scene)
    rival = best(scene, BOTH, tolerance) if tolerance is not None else None
    ratio = over(row.solve_s or None, None if rival is None else rival.solve_s)
    return ChosenRun(
        scene.name, row, measured, _verdict(row, scene, measured), rival, ratio, over(row.choosing_s, row.solve_s)
    )


def _verdict(row: Row, scene: SceneRows, measured: float | None) -> str:
    if row.status == "refused":
        return DECLINED
    if not row.completed:
        return LOST
    if measured is None or row.tolerance_asked is None or scene.uncertainty > MAX_UNCERTAINTY * row.tolerance_asked:
        return UNCERTAIN
    return KEPT if measured <= row.tolerance_asked else MISSED


def automatic_sheet(scenes: Sequence[SceneRows]) -> Sheet:
    """Return the table of the automatic choice; misses and failures are marked and come first."""
    found = sorted(choices(scenes), key=lambda choice: ORDER.index(choice.verdict))
    rows = tuple(
        (
            each.scene,
            short(each.row.tolerance_asked),
            each.verdict,
            short(each.measured),
            short(each.row.expected_error),
            _chosen(each.row) if each.row.completed else each.row.reason or DASH,
            milliseconds(each.row.solve_s),
            short(each.over_best),
            each.rival.method if each.rival is not None else DASH,
            short(each.choosing),
        )
        for each in found
    )
    heads = headings(
        *("scene", "tolerance", "outcome", "measured", "expected", "chosen", "time [ms]", "× best", "best"),
        "choosing [× time]",
        text=("scene", "outcome", "chosen", "best"),
    )
    note = (
        "Tolerance: on displacement and impulse; measured and expected: the larger error of both. × best: time "
        "to solve over that of the fastest method of the grid that meets the tolerance, named beside it. Choosing: "
        "time to choose over time to solve. Declined: the choice reported that it cannot meet the tolerance. "
        "Uncertain: the reference is not known to a third of the tolerance."
    )
    wrong = frozenset(i for i, each in enumerate(found) if each.verdict in (MISSED, LOST))
    return Sheet("automatic", "The automatic choice", note, heads, rows, wrong=wrong)


def _chosen(row: Row) -> str:
    """Return the chosen description in few words."""
    sizes = "/".join(str(size) for size in (row.elements, row.modes) if size is not None)
    words = (row.model, sizes, row.basis, row.law, row.integrator, row.events if row.integrator else "")
    return " ".join(word for word in words if word) or DASH


def choice_words(scenes: Sequence[SceneRows]) -> list[str]:
    """Return sentences on the automatic choice; none where it was not run."""
    found = choices(scenes)
    if not found:
        return []
    compared = [each for each in found if each.verdict in (KEPT, MISSED)]
    missed = [each for each in found if each.verdict == MISSED]
    if not compared:
        return ["No run of the automatic choice has a reference that is certain enough."]
    words = [
        f"The automatic choice met its tolerance in {len(compared) - len(missed)} of {len(compared)} compared runs."
    ]
    if missed:
        named = ", ".join(f"{each.scene} at {short(each.row.tolerance_asked)}" for each in missed)
        words.append(f"It missed in {named}.")
    ratios = [each.over_best for each in compared if each.over_best is not None]
    if ratios:
        costly = sum(ratio > MAX_RATIO for ratio in ratios)
        words.append(
            f"Its runs took {short(min(ratios))} to {short(max(ratios))} times as long as the fastest method of the "
            f"grid that meets the tolerance; {costly or 'none'} took more than {MAX_RATIO:g} times as long."
        )
    spent = [each.choosing for each in compared if each.choosing is not None]
    if spent:
        words.append(f"Choosing took up to {short(max(spent))} times as long as the run (target: {MAX_CHOOSING:g}).")
    return words
