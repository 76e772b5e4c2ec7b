"""The tables of one scene: its fronts, its methods one by one, and the runs that did not end with their reasons."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from impactlab.bench.report.fronts import front_of, stepped
from impactlab.bench.report.looks import power
from impactlab.bench.report.ranking import fastest
from impactlab.bench.report.sheets import DASH, Heading, Sheet, milliseconds, percent, short
from impactlab.bench.report.summary_sheets import named
from impactlab.bench.report.views import BOTH, CLOCKS, NORMS, TOLERANCES, Family, SceneRows, error
from impactlab.bench.schema import COMPLETED, Row
from impactlab.report.summary import cell


def slug(name: str) -> str:
    """Return the name of a scene as it stands in names of files."""
    return name.replace("/", "-")


def front_sheet(scene: SceneRows) -> Sheet:
    """Return the rows on the fronts of displacement error, by time and by time with set-up, marked apart."""
    rows, norm = stepped(scene), NORMS[0]
    by_time = [point.row for point in front_of(rows, norm, scene, CLOCKS["solve"])]
    by_total = [point.row for point in front_of(rows, norm, scene, CLOCKS["total"])]
    union = _distinct([*by_time, *by_total])
    exact = [row for row in scene.rows if row.stepless]
    lines = [_front_line(row, "no steps") for row in exact]
    union.sort(key=lambda row: row.solve_s or 0.0)
    for row in union:
        fast, both = _within(row, by_time), _within(row, by_total)
        which = "time, with and without set-up" if fast and both else "time" if fast else "time with set-up"
        lines.append(_front_line(row, which))
    heads = (
        Heading("method", numeric=False),
        Heading("level"),
        Heading("steps"),
        Heading("unknowns"),
        Heading("displacement", group="error"),
        Heading("impulse", group="error"),
        Heading("solve", "ms", group="time"),
        Heading("spread", "ms", group="time"),
        Heading("set-up", "ms", group="time"),
        Heading("front of", numeric=False),
    )
    note = (
        "Runs with steps than which no other is both faster and closer in displacement; by time to solve, and by time "
        "with set-up. Runs without steps stand above them."
    )
    return Sheet(f"{slug(scene.name)}_front", f"Front of {scene.name}", note, heads, tuple(lines))


def _distinct(rows: Sequence[Row]) -> list[Row]:
    kept: list[Row] = []
    for row in rows:
        if not _within(row, kept):
            kept.append(row)
    return kept


def _within(row: Row, rows: Sequence[Row]) -> bool:
    """Return whether a row itself is among others: rows that look alike are still different runs."""
    return any(row is other for other in rows)


def _front_line(row: Row, which: str) -> tuple[str, ...]:
    return (
        named(row),
        row.level or DASH,
        DASH if row.stepless else cell(row.steps),
        cell(row.unknowns),
        short(row.displacement),
        short(row.impulse),
        milliseconds(row.solve_s),
        milliseconds(row.solve_spread_s),
        milliseconds(row.setup_s),
        which,
    )


def families_sheet(scene: SceneRows) -> Sheet:
    """Return the methods of a scene: time to each tolerance, least errors, energy, and runs without an end."""
    lines = []
    for family in (*scene.families, *scene.own):
        times = [fastest(family.rows, BOTH, scene, tolerance, CLOCKS["solve"]) for tolerance in TOLERANCES]
        cells = [named(family.rows[-1]), *(milliseconds(row.solve_s if row else None) for row in times)]
        cells += [short(_least(family, name)) for name in ("displacement", "impulse")]
        cells += [short(_least(family, name)) for name in ("force_away_from_jumps", "force_graph", "event_times")]
        finest = family.completed[-1] if family.completed else None
        cells += [percent(finest.energy_gain if finest else None), percent(finest.energy_loss if finest else None)]
        cells += [short(finest.force_oscillation if finest else None), _ended(family)]
        lines.append(tuple(cells))
    lines.sort(key=lambda line: [_number(text) for text in (line[2], line[1], line[4])])
    heads = (
        Heading("method", numeric=False),
        *(Heading(power(tolerance), "ms", group="time to tolerance") for tolerance in TOLERANCES),
        Heading("displ.", group="least error"),
        Heading("impulse", group="least error"),
        Heading("force", group="least error"),
        Heading("graph", group="least error"),
        Heading("events", "T", group="least error"),
        Heading("gain", "%", group="finest level"),
        Heading("loss", "%", group="finest level"),
        Heading("swing", group="finest level"),
        Heading("runs", numeric=False),
    )
    note = (
        "Time to solve of the fastest level that keeps displacement and impulse within the tolerance; least errors "
        "over all levels, of the force away from its jumps, of its graph in T and peaks, of event times where none was "
        "missed; energy gained and lost in % of the reference energy, and how far the force goes up and down too often "
        "in peaks, at the finest level that ended. † stands on the special grid dt = h/c; own. begins the methods that "
        "the case brings along."
    )
    return Sheet(slug(scene.name), f"Methods on {scene.name}", note, heads, tuple(lines), _quickest(lines))


def _least(family: Family, name: str) -> float | None:
    """Return the least error of all levels; that of event times only of runs that missed none."""
    rows = [row for row in family.completed if name != "event_times" or not row.events_missed]
    return min((v for row in rows if (v := getattr(row, name)) is not None), default=None)


def _ended(family: Family) -> str:
    """Return how the runs of a family ended: all of them, or how many did not."""
    counts: dict[str, int] = {}
    for row in family.rows:
        counts[row.status] = counts.get(row.status, 0) + 1
    lost = ", ".join(f"{count} {status}" for status, count in counts.items() if status != COMPLETED)
    return lost or f"all {len(family.rows)}"


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 1e30


def _quickest(lines: Sequence[tuple[str, ...]]) -> frozenset[tuple[int, int]]:
    """Return the cells of the least times to each tolerance."""
    marked = set()
    for column in (1, 2, 3):
        numbers = [_number(line[column]) for line in lines]
        if numbers and min(numbers) < 1e30:
            marked.add((numbers.index(min(numbers)), column))
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
    """Return every run that did not come to its end; levels of one method with the same reason stand together."""
    groups: dict[tuple[str, str, str, str, str], list[str]] = {}
    for row in scene.all_rows:
        if not row.completed:
            reached = "" if row.reached_time is None else f"{row.reached_time:.3g} s"
            key = (row.method, row.status, row.reason or "no reason given", row.remedy, reached)
            groups.setdefault(key, []).append(row.level or DASH)
    return [
        Unfinished(scene.name, method, tuple(levels), status, reason, remedy, reached)
        for (method, status, reason, remedy, reached), levels in groups.items()
    ]


def closest(scene: SceneRows) -> Row | None:
    """Return the run with steps that is closest in displacement, whatever it costs."""
    known = [(e, row) for row in stepped(scene) if (e := error(row, NORMS[0], scene)) is not None]
    return min(known, key=lambda pair: pair[0])[1] if known else None
