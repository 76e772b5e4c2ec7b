"""The tables over all scenes: fastest methods, ranking, special grids, uncertainties."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

from impactlab.bench.report.looks import power
from impactlab.bench.report.ranking import FAILED, MET, REFUSED, Standing, best, fastest, judged, median, ranking
from impactlab.bench.report.sheets import DASH, SPECIAL, Heading, Sheet, milliseconds, short
from impactlab.bench.report.views import BOTH, CLOCKS, TOLERANCES, Norm, SceneRows, on_special_grid
from impactlab.bench.schema import COMPLETED, Row

CLOCK_WORDS = {"solve": "time to solve", "total": "time to solve with set-up"}


def winners(scenes: Sequence[SceneRows], norm: Norm = BOTH) -> Sheet:
    """Return the fastest method by scene and tolerance, and the time of the exact solution.

    A method on a special grid is followed by the fastest that is not.
    """
    rows = []
    for scene in scenes:
        stepless = [row for row in scene.rows if row.stepless]
        exact = fastest(stepless, norm, scene, TOLERANCES[-1], CLOCKS["solve"])
        cells = [scene.name, milliseconds(exact.solve_s if exact else None)]
        for tolerance in TOLERANCES:
            sure = bool(judged([scene], norm, tolerance).scenes)
            cells.append(_winner(scene, norm, tolerance) if sure else "not judged")
        rows.append(tuple(cells))
    heads = (
        Heading("scene", numeric=False),
        Heading("exact", "ms"),
        *(Heading(power(t), "", numeric=False, group="fastest with steps, time in ms") for t in TOLERANCES),
    )
    note = (
        f"The fastest method with steps whose errors in {norm.title} both stay within the tolerance, and its time to "
        f"solve without set-up. Exact: the time of the answer from event to event, where the scene has one. {SPECIAL} "
        "stands on the special grid dt = h/c; the fastest without it follows."
    )
    return Sheet("winners", "Which method is fastest where", note, heads, tuple(rows))


def _winner(scene: SceneRows, norm: Norm, tolerance: float) -> str:
    rows = [row for row in scene.rows if not row.stepless]
    first = fastest(rows, norm, scene, tolerance, CLOCKS["solve"])
    if first is None:
        return "none"
    if not on_special_grid(first):
        return _timed(first)
    second = best(scene, norm, tolerance, CLOCKS["solve"], ordinary=True)
    return f"{_timed(first)}; {_timed(second) if second else 'no other'}"


def _timed(row: Row) -> str:
    return f"{named(row)}\N{NO-BREAK SPACE}{milliseconds(row.solve_s)}"


def named(row: Row) -> str:
    """Return the method of a row, marked where it stands on a special grid."""
    return row.method + (SPECIAL if on_special_grid(row) else "")


def ranking_sheet(scenes: Sequence[SceneRows], norm: Norm, clock: str = "solve") -> Sheet:
    """Return in how many scenes each method meets each tolerance, and its time over that of the best."""
    tables = [{s.method: s for s in ranking(scenes, norm, tolerance, clock)} for tolerance in TOLERANCES]
    order = sorted(tables[0], key=lambda method: _worth(method, tables))
    special = {row.method for scene in scenes for row in scene.rows if on_special_grid(row)}
    rows = []
    for method in order:
        cells = [method + (SPECIAL if method in special else "")]
        for table in tables:
            each = table[method]
            worst = max(each.ratios, default=None)
            cells += [_share(each), *(map(short, (median(each.ratios), worst, median(each.ratios_stepped))))]
        cells += [str(tables[1][method].count(REFUSED)), _failed(scenes, method)]
        rows.append(tuple(cells))
    heads = [Heading("method", numeric=False)]
    for tolerance, table in zip(TOLERANCES, tables, strict=True):
        count = max((len(each.results) for each in table.values()), default=0)
        group = f"{power(tolerance)}, {count} scene{'' if count == 1 else 's'}"
        heads += [Heading("met in", group=group), Heading("× best", group=group), Heading("worst", group=group)]
        heads += [Heading("× stepped", group=group)]
    heads += [Heading("refused", "scenes"), Heading("failed", "runs")]
    note = (
        f"Scenes in which at least one level of the method keeps its error in {norm.title} within the tolerance; and, "
        f"over those scenes, its {CLOCK_WORDS[clock]} over that of the fastest method there: median and worst, and the "
        f"median over the fastest method with steps off special grids. Refused: scenes that the method does not take. "
        f"Failed: runs that ended in a failure, hung or crashed. {SPECIAL} stands on the special grid dt = h/c."
    )
    title = f"Ranking, {norm.title}, {CLOCK_WORDS[clock]}"
    return Sheet(f"ranking_{norm.name}_{clock}", title, note, tuple(heads), tuple(rows), _firsts(rows))


def _worth(method: str, tables: Sequence[dict[str, Standing]]) -> tuple[float, ...]:
    """Return a key of order: the middle tolerance counts first, then the loose, then the sharp one, then the time."""
    counts = [-table[method].count(MET) for table in tables]
    return (counts[1], counts[0], counts[2], median(tables[1][method].ratios or tables[0][method].ratios) or 1e9)


def _share(standing: Standing) -> str:
    return str(standing.count(MET)) if standing.results else DASH


def _failed(scenes: Sequence[SceneRows], method: str) -> str:
    rows = [row for scene in scenes for row in scene.rows if row.method == method]
    return str(sum(not row.completed and row.status != "refused" for row in rows))


def _firsts(rows: Sequence[tuple[str, ...]]) -> frozenset[tuple[int, int]]:
    """Return the cells of the most scenes met, tolerance by tolerance."""
    marked = set()
    for column in (1, 5, 9):
        counts = [int(row[column]) if row[column] != DASH else 0 for row in rows]
        most = max(counts, default=0)
        marked |= {(i, column) for i, count in enumerate(counts) if count == most and most > 0}
    return frozenset(marked)


def certainty(scenes: Sequence[SceneRows]) -> Sheet:
    """Return the reference of each scene, its uncertainty, and the outcomes of its runs."""
    rows = []
    for scene in scenes:
        counts = [sum(row.status == status for row in scene.all_rows) for status in (COMPLETED, "refused")]
        spread = spreads(scene.all_rows)
        rows.append(
            (
                scene.name,
                scene.reference or "none",
                short(scene.uncertainty) if scene.reference else DASH,
                str(len(scene.all_rows)),
                *map(str, counts),
                str(len(scene.all_rows) - sum(counts)),
                percent_of(statistics.median(spread)) if spread else DASH,
                percent_of(max(spread)) if spread else DASH,
            )
        )
    heads = (
        Heading("scene", numeric=False),
        Heading("reference", numeric=False),
        Heading("uncertainty"),
        Heading("runs"),
        Heading("completed"),
        Heading("refused"),
        Heading("failed"),
        Heading("median", "%", group="spread of times"),
        Heading("worst", "%", group="spread of times"),
    )
    note = (
        "The uncertainty of a reference is relative; no error is counted as smaller, and a tolerance less than three "
        "times as large is not judged. The spread of a time is how far the median of its repeats lies above their "
        "minimum, which is the time shown everywhere: differences smaller than that are none."
    )
    return Sheet("certainty", "How sure the numbers are", note, heads, tuple(rows))


def spreads(rows: Sequence[Row]) -> list[float]:
    """Return the spread of the time to solve over that time, of every run that was timed more than once."""
    return [
        row.solve_spread_s / row.solve_s
        for row in rows
        if row.solve_s and row.solve_spread_s is not None and (row.repeats or 0) > 1
    ]


def percent_of(share: float) -> str:
    """Return a share in whole per cent."""
    return f"{100.0 * share:.0f}"


def excluded(scenes: Sequence[SceneRows], norm: Norm) -> list[tuple[str, str, str]]:
    """Return the exclusions of a ranking: tolerance, scene, reason; once if the same for all tolerances."""
    found: dict[tuple[str, str], list[str]] = {}
    for tolerance in TOLERANCES:
        for name, reason in judged(scenes, norm, tolerance).excluded:
            found.setdefault((name, reason), []).append(power(tolerance))
    return [
        ("all tolerances" if len(which) == len(TOLERANCES) else ", ".join(which), name, reason)
        for (name, reason), which in found.items()
    ]


def failures(scenes: Sequence[SceneRows]) -> int:
    """Return how many runs failed, hung or crashed."""
    return sum(not row.completed and row.status != "refused" for scene in scenes for row in scene.rows)


def refusals(table: Sequence[Standing]) -> int:
    """Return how many pairs of method and scene were refused."""
    return sum(each.count(REFUSED) for each in table)


def broken(table: Sequence[Standing]) -> int:
    """Return how many pairs of method and scene have no run that ended, though not all were refused."""
    return sum(each.count(FAILED) for each in table)
