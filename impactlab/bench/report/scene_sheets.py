"""The tables of one scene: fronts, methods, and unfinished runs with their reasons."""

from __future__ import annotations

import collections
import math
from collections.abc import Sequence
from typing import NamedTuple

from impactlab.bench.report.fronts import front_of
from impactlab.bench.report.method_styles import power
from impactlab.bench.report.ranking import fastest
from impactlab.bench.report.sheets import DASH, Sheet, headings, milliseconds, percent, short
from impactlab.bench.report.summary_sheets import named
from impactlab.bench.report.views import BOTH, CLOCKS, NORMS, TOLERANCES, MethodRows, SceneRows
from impactlab.bench.schema import COMPLETED, Row
from impactlab.report.comparison import cell


def slug(name: str) -> str:
    """Return the name of a scene as a part of file names."""
    return name.replace("/", "-")


def front_sheet(scene: SceneRows) -> Sheet:
    """Return the rows on the fronts of displacement error, marked by time with and without set-up."""
    by_time, by_total = (
        [point.row for point in front_of(scene.stepped, NORMS[0], scene, CLOCKS[clock])] for clock in ("solve", "total")
    )
    lines = [_front_line(row, "no steps") for row in scene.rows if row.stepless]
    for row in sorted(dict.fromkeys([*by_time, *by_total]), key=lambda row: row.solve_s or 0.0):
        times = "time" if row in by_time else "time with set-up"
        both = row in by_time and row in by_total
        lines.append(_front_line(row, "time, with and without set-up" if both else times))
    heads = headings(
        *("method", "level", "steps", "unknowns", "error: displacement", "error: impulse"),
        *("time: solve [ms]", "time: spread [ms]", "time: set-up [ms]", "front of"),
        text=("method", "front of"),
    )
    note = (
        "Runs with steps that no other run beats in both time and displacement error; by time to solve, and by time "
        "with set-up. Runs without steps stand above them."
    )
    return Sheet(f"{slug(scene.name)}_front", f"Front of {scene.name}", note, heads, tuple(lines))


def _front_line(row: Row, which: str) -> tuple[str, ...]:
    sizes = (DASH if row.stepless else cell(row.steps), cell(row.unknowns))
    times = map(milliseconds, (row.solve_s, row.solve_spread_s, row.setup_s))
    return (named(row), row.level or DASH, *sizes, short(row.displacement), short(row.impulse), *times, which)


def families_sheet(scene: SceneRows) -> Sheet:
    """Return the table of the methods of a scene.

    It has time to each tolerance, least errors, energy, and runs without a result.
    """
    lines = []
    for family in (*scene.families, *scene.own):
        times = [fastest(family.rows, BOTH, scene, tolerance, CLOCKS["solve"]) for tolerance in TOLERANCES]
        cells = [named(family.rows[-1]), *(milliseconds(row.solve_s if row else None) for row in times)]
        cells += [short(_least(family, norm.name)) for norm in NORMS]
        finest = family.completed[-1] if family.completed else Row()
        cells += [percent(finest.energy_gain), percent(finest.energy_loss), short(finest.force_oscillation)]
        counts = collections.Counter(row.status for row in family.rows)
        lost = ", ".join(f"{count} {status}" for status, count in counts.items() if status != COMPLETED)
        lines.append((*cells, lost or f"all {len(family.rows)}"))
    lines.sort(key=lambda line: [_number(text) for text in (line[2], line[1], line[4])])
    heads = headings(
        "method",
        *(f"time to tolerance: {power(tolerance)} [ms]" for tolerance in TOLERANCES),
        *(f"least error: {name}" for name in ("displ.", "impulse", "force", "graph", "events [T]")),
        *(f"finest level: {name}" for name in ("gain [%]", "loss [%]", "oscillation")),
        "runs",
        text=("method", "runs"),
    )
    note = (
        "Time to solve of the fastest level that keeps displacement and impulse within the tolerance; least errors "
        "over all levels, of the force away from its jumps, of its graph in T and peaks, of event times where none was "
        "missed; energy gained and lost in % of the reference energy, and the total variation of the force beyond that "
        "of the reference in peaks, at the finest level that ended. † stands on the special grid dt = h/c; own. begins "
        "the methods of the case file."
    )
    return Sheet(slug(scene.name), f"Methods on {scene.name}", note, heads, tuple(lines), _quickest(lines))


def convergence_sheet(scene: SceneRows) -> Sheet:
    """Return the errors of each method with more than one level, and the rates by which they fall."""
    lines = []
    for family in (*scene.families, *scene.own):
        rows = sorted((row for row in family.completed if row.steps), key=lambda row: row.steps or 0)
        if len(rows) < 2:
            continue
        for before, row in zip([None, *rows], rows, strict=False):
            cells = [named(row), row.level or DASH, cell(row.elements), cell(row.steps)]
            for norm in ("displacement", "impulse"):
                cells += [short(getattr(row, norm)), _rate(before, row, norm)]
            lines.append(tuple(cells))
    errors = (f"{norm}: {name}" for norm in ("displacement", "impulse") for name in ("error", "rate"))
    heads = headings("method", "level", "elements", "steps", *errors, text=("method",))
    note = (
        "Relative errors, and the rate by which each falls from the level before: the logarithm of the ratio of the "
        "errors over that of the steps, or of the unknowns where the steps are the same."
    )
    return Sheet(f"{slug(scene.name)}_convergence", f"Convergence on {scene.name}", note, heads, tuple(lines))


def _rate(before: Row | None, row: Row, norm: str) -> str:
    """Return the rate by which an error falls from one level to the next, or a dash."""
    if before is None or not (first := getattr(before, norm)) or not (last := getattr(row, norm)):
        return DASH
    sizes = ((a, b) for a, b in ((before.steps, row.steps), (before.unknowns, row.unknowns)) if a and b and a != b)
    fewer, more = next(sizes, (1, 1))
    if more == fewer:
        return DASH
    return f"{math.log(first / last) / math.log(more / fewer):.2f}".replace("-", "\N{MINUS SIGN}")


def _least(family: MethodRows, name: str) -> float | None:
    """Return the least error of all levels.

    That of event times is only of runs that missed none.
    """
    rows = [row for row in family.completed if name != "event_times" or not row.events_missed]
    return min((v for row in rows if (v := getattr(row, name)) is not None), default=None)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.inf


def _quickest(lines: Sequence[tuple[str, ...]]) -> frozenset[tuple[int, int]]:
    """Return the cells of the least times to each tolerance."""
    marked = set()
    for column in range(1, 1 + len(TOLERANCES)):
        least, line = min(((_number(line[column]), i) for i, line in enumerate(lines)), default=(math.inf, 0))
        if least < math.inf:
            marked.add((line, column))
    return frozenset(marked)


class Unfinished(NamedTuple):
    """Runs of one method on one scene that ended alike, without a result."""

    scene: str
    method: str
    levels: tuple[str, ...]
    status: str
    reason: str
    remedy: str
    reached: str


def unfinished(scene: SceneRows) -> list[Unfinished]:
    """Return all runs without a result.

    Levels of one method with the same reason stand together.
    """
    groups: dict[tuple[str, ...], list[str]] = {}
    for row in scene.all_rows:
        if not row.completed:
            reached = "" if row.reached_time is None else f"{row.reached_time:.3g} s"
            key = (row.method, row.status, row.reason or "no reason given", row.remedy, reached)
            groups.setdefault(key, []).append(row.level or DASH)
    return [Unfinished(scene.name, method, tuple(levels), *rest) for (method, *rest), levels in groups.items()]
