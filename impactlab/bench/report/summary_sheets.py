"""The tables over all scenes: fastest methods, ranking, uncertainties."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

from impactlab.bench.report.method_styles import power
from impactlab.bench.report.ranking import MET, REFUSED, MethodResults, best, comparable, fastest, median, ranking
from impactlab.bench.report.sheets import DASH, SPECIAL, Sheet, headings, milliseconds, short
from impactlab.bench.report.views import BOTH, CLOCKS, TOLERANCES, Norm, SceneRows
from impactlab.bench.schema import COMPLETED, Row
from impactlab.printing import counted

CLOCK_WORDS = {"solve": "time to solve", "total": "time to solve with set-up"}
PER_TOLERANCE = ("met in", "× best", "worst", "× stepped")  # columns of a ranking


def winners(scenes: Sequence[SceneRows]) -> Sheet:
    """Return the fastest method by scene and tolerance, and the time of the exact solution.

    A method on a special grid is followed by the fastest that is not.
    """
    rows = []
    for scene in scenes:
        stepless = [row for row in scene.rows if row.stepless]
        exact = fastest(stepless, BOTH, scene, TOLERANCES[-1], CLOCKS["solve"])
        cells = [scene.name, milliseconds(exact.solve_s if exact else None)]
        for tolerance in TOLERANCES:
            certain = comparable([scene], BOTH, tolerance).scenes
            cells.append(_winner(scene, tolerance) if certain else "uncertain")
        rows.append(tuple(cells))
    columns = [f"fastest with steps, time in ms: {power(t)}" for t in TOLERANCES]
    heads = headings("scene", "exact [ms]", *columns, text=("scene", *map(power, TOLERANCES)))
    note = (
        f"The fastest method with steps whose errors in {BOTH.title} both stay within the tolerance, and its time to "
        f"solve without set-up. Exact: the time of the solution from event to event, where the scene has one. {SPECIAL}"
        " stands on the special grid dt = h/c; the fastest without it follows."
    )
    return Sheet("winners", "Fastest method by scene and tolerance", note, heads, tuple(rows))


def _winner(scene: SceneRows, tolerance: float) -> str:
    first = fastest(scene.stepped, BOTH, scene, tolerance, CLOCKS["solve"])
    if first is None:
        return "none"
    if first.solve_s is None:  # a row without a time comes last: none has one
        return DASH
    if not first.special:
        return _timed(first)
    second = best(scene, BOTH, tolerance, ordinary=True)
    return f"{_timed(first)}; {_timed(second) if second else 'no other'}"


def _timed(row: Row) -> str:
    return f"{named(row)}\N{NO-BREAK SPACE}{milliseconds(row.solve_s)}"


def named(row: Row) -> str:
    """Return the method of a row, marked where it stands on a special grid."""
    return row.method + (SPECIAL if row.special else "")


def ranking_sheet(scenes: Sequence[SceneRows], norm: Norm, clock: str = "solve") -> Sheet:
    """Return the table of the ranking of methods.

    It shows in how many scenes each method meets each tolerance, and its time over that of the fastest.
    """
    tables = [{s.method: s for s in ranking(scenes, norm, tolerance, clock)} for tolerance in TOLERANCES]
    special = {row.method for scene in scenes for row in scene.rows if row.special}
    rows = []
    for method in sorted(tables[0], key=lambda method: _order(method, tables)):
        cells = [method + (SPECIAL if method in special else "")]
        for each in (table[method] for table in tables):
            ratios = median(each.ratios), max(each.ratios, default=None), median(each.ratios_stepped)
            cells += [str(each.count(MET)) if each.results else DASH, *map(short, ratios)]
        own = [row for scene in scenes for row in scene.rows if row.method == method]
        failed = sum(not row.completed and row.status != "refused" for row in own)
        rows.append((*cells, str(tables[1][method].count(REFUSED)), str(failed)))
    columns = []
    for tolerance in TOLERANCES:
        count = len(comparable(scenes, norm, tolerance).scenes)
        columns += [f"{power(tolerance)}, {counted(count, 'scene')}: {name}" for name in PER_TOLERANCE]
    heads = headings("method", *columns, "refused [scenes]", "failed [runs]", text=("method",))
    note = (
        f"Scenes in which at least one level of the method keeps its error in {norm.title} within the tolerance; and, "
        f"over those scenes, its {CLOCK_WORDS[clock]} over that of the fastest method there: median and worst, and the "
        f"median over the fastest method with steps off special grids. Refused: scenes that the method refuses. "
        f"Failed: runs that failed, hung or crashed. {SPECIAL} stands on the special grid dt = h/c."
    )
    title = f"Ranking, {norm.title}, {CLOCK_WORDS[clock]}"
    return Sheet(f"ranking_{norm.name}_{clock}", title, note, heads, tuple(rows), _most(rows))


def _order(method: str, tables: Sequence[dict[str, MethodResults]]) -> tuple[float, ...]:
    """Return a sorting key by scenes met, then by time.

    Scenes are met at the middle tolerance, then the loose, then the sharp one.
    """
    counts = [-table[method].count(MET) for table in tables]
    return (counts[1], counts[0], counts[2], median(tables[1][method].ratios or tables[0][method].ratios) or 1e9)


def _most(rows: Sequence[tuple[str, ...]]) -> frozenset[tuple[int, int]]:
    """Return the cells of the most scenes met, tolerance by tolerance."""
    marked = set()
    for number in range(len(TOLERANCES)):
        column = 1 + number * len(PER_TOLERANCE)  # "met in", behind the name of the method
        counts = [int(row[column]) if row[column] != DASH else 0 for row in rows]
        most = max(counts, default=0)
        marked |= {(i, column) for i, count in enumerate(counts) if count == most and most > 0}
    return frozenset(marked)


def certainty(scenes: Sequence[SceneRows]) -> Sheet:
    """Return the reference of each scene, its uncertainty, and the outcomes of its runs."""
    rows = []
    for scene in scenes:
        counts = [sum(row.status == status for row in scene.all_rows) for status in (COMPLETED, "refused")]
        total, spread = len(scene.all_rows), spreads(scene.all_rows)
        uncertainty = short(scene.uncertainty) if scene.reference else DASH
        shares = (percent_of(statistics.median(spread)), percent_of(max(spread))) if spread else (DASH, DASH)
        runs = map(str, (total, *counts, total - sum(counts)))
        rows.append((scene.name, scene.reference or "none", uncertainty, *runs, *shares))
    heads = headings(
        *("scene", "reference", "uncertainty", "runs", "completed", "refused", "failed"),
        *("spread of times: median [%]", "spread of times: worst [%]"),
        text=("scene", "reference"),
    )
    note = (
        "The uncertainty of a reference is relative; no error is counted as smaller, and a tolerance less than three "
        "times as large is not compared. The spread of a time is how far the median of its repeats lies above their "
        "minimum, which is the time in all tables: smaller differences are noise."
    )
    return Sheet("certainty", "Uncertainty of references and times", note, heads, tuple(rows))


def spreads(rows: Sequence[Row]) -> list[float]:
    """Return relative spreads of the times of runs that were timed more than once."""
    return [
        row.solve_spread_s / row.solve_s
        for row in rows
        if row.solve_s and row.solve_spread_s is not None and (row.repeats or 0) > 1
    ]


def percent_of(share: float) -> str:
    """Return a share in whole per cent."""
    return f"{100.0 * share:.0f}"


def excluded(scenes: Sequence[SceneRows], norm: Norm) -> list[tuple[str, str, str]]:
    """Return the exclusions of a ranking: tolerance, scene, reason.

    They stand once if the same for all tolerances.
    """
    found: dict[tuple[str, str], list[str]] = {}
    for tolerance in TOLERANCES:
        for key in comparable(scenes, norm, tolerance).excluded:
            found.setdefault(key, []).append(power(tolerance))
    return [
        ("all tolerances" if len(which) == len(TOLERANCES) else ", ".join(which), name, reason)
        for (name, reason), which in found.items()
    ]
