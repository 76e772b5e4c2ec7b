"""Which method meets a tolerance where, how much dearer it is than the best there, and how sure that is."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from impactlab.bench.report.views import (
    CLOCKS,
    SURE,
    Family,
    Norm,
    SceneRows,
    error,
    meets,
    methods_of,
    on_special_grid,
)
from impactlab.bench.schema import Row

CONVERGED = "converged"  # the name of a reference that is itself computed
MET, MISSED, REFUSED, FAILED, UNMEASURED, ABSENT = "met", "missed", "refused", "failed", "unmeasured", "absent"


class Judged(NamedTuple):
    """The scenes in which a tolerance is resolved, and the reasons against the others."""

    scenes: tuple[SceneRows, ...]
    excluded: tuple[tuple[str, str], ...]  # name of a scene, reason


class Result(NamedTuple):
    """What one method makes of one scene under one tolerance."""

    outcome: str  # one of MET, MISSED, REFUSED, FAILED, UNMEASURED, ABSENT
    row: Row | None = None  # the fastest that meets it
    ratio: float | None = None  # its time over that of the best method
    ratio_stepped: float | None = None  # over that of the best method with steps, special grids left out


class Standing(NamedTuple):
    """One method over all judged scenes under one tolerance."""

    method: str
    results: tuple[Result, ...]  # scene by scene

    def count(self, outcome: str) -> int:
        """Return in how many scenes it ended so."""
        return sum(result.outcome == outcome for result in self.results)

    @property
    def ratios(self) -> tuple[float, ...]:
        """Return its times over those of the best method, where it meets the tolerance."""
        return tuple(result.ratio for result in self.results if result.ratio is not None)

    @property
    def ratios_stepped(self) -> tuple[float, ...]:
        """Return its times over those of the best method with steps off special grids, where both meet it."""
        return tuple(result.ratio_stepped for result in self.results if result.ratio_stepped is not None)


def judged(scenes: Sequence[SceneRows], norm: Norm, tolerance: float) -> Judged:
    """Return the scenes whose reference is certain enough for a tolerance."""
    kept, excluded = [], []
    for scene in scenes:
        if not scene.reference:
            excluded.append((scene.name, "no reference: no method is known to be right"))
        elif scene.reference == CONVERGED and all(row.reference_uncertainty is None for row in scene.all_rows):
            excluded.append((scene.name, "the table does not say how sure the reference is"))
        elif scene.uncertainty > SURE * tolerance:
            excluded.append((scene.name, f"the reference is only sure to {scene.uncertainty:.1g}"))
        elif not any(error(row, norm, scene) is not None for row in scene.rows):
            excluded.append((scene.name, f"no method has an error in {norm.title}"))
        else:
            kept.append(scene)
    return Judged(tuple(kept), tuple(excluded))


def fastest(
    rows: Iterable[Row], norm: Norm, scene: SceneRows, tolerance: float, clock: Callable[[Row], float | None]
) -> Row | None:
    """Return the row that meets a tolerance in the least time, or None; a row without a time comes last."""

    def time(row: Row) -> float:
        spent = clock(row)
        return math.inf if spent is None else spent

    return min((row for row in rows if meets(row, norm, scene, tolerance)), key=time, default=None)


def best(
    scene: SceneRows, norm: Norm, tolerance: float, clock: Callable[[Row], float | None], *, ordinary: bool = False
) -> Row | None:
    """Return the fastest row of any method that meets a tolerance; ordinary: with steps, and off special grids."""
    rows = [row for row in scene.rows if not (ordinary and (row.stepless or on_special_grid(row)))]
    return fastest(rows, norm, scene, tolerance, clock)


class Leads(NamedTuple):
    """The fastest rows that meet a tolerance on a scene."""

    any: Row | None
    ordinary: Row | None  # with steps, off special grids


def result(
    scene: SceneRows,
    family: Family | None,
    norm: Norm,
    tolerance: float,
    clock: Callable[[Row], float | None],
    leads: Leads,
) -> Result:
    """Return the result of a family in a scene: met if any level meets the tolerance, else its best outcome."""
    if family is None:
        return Result(ABSENT)
    own = fastest(family.rows, norm, scene, tolerance, clock)
    if own is not None:
        return Result(MET, own, *(None if lead is None else _over(clock(own), clock(lead)) for lead in leads))
    if any(error(row, norm, scene) is not None for row in family.rows):
        return Result(MISSED)
    if family.completed:
        return Result(UNMEASURED)
    return Result(REFUSED if all(row.status == "refused" for row in family.rows) else FAILED)


def _over(value: float | None, base: float | None) -> float | None:
    return None if value is None or not base else value / base


def ranking(scenes: Sequence[SceneRows], norm: Norm, tolerance: float, clock: str = "solve") -> list[Standing]:
    """Return all methods: those that meet the tolerance in most scenes first, among equals the faster ones.

    Parameters
    ----------
    scenes : sequence of SceneRows
        All scenes; those that cannot be judged (`judged`) are left out for every method alike.
    clock : {"solve", "total"}
        Time without set-up, or with it.
    """
    table, time = judged(scenes, norm, tolerance).scenes, CLOCKS[clock]
    leads = [
        Leads(best(scene, norm, tolerance, time), best(scene, norm, tolerance, time, ordinary=True)) for scene in table
    ]
    families = [{family.method: family for family in scene.families} for scene in table]
    standings = []
    for method in methods_of(scenes):
        found = zip(table, families, leads, strict=True)
        results = tuple(result(scene, own.get(method), norm, tolerance, time, lead) for scene, own, lead in found)
        standings.append(Standing(method, results))
    return sorted(standings, key=lambda each: (-each.count(MET), median(each.ratios) or 0.0))


def median(values: Sequence[float]) -> float | None:
    """Return the median, None of nothing."""
    return statistics.median(values) if values else None


def profile(standing: Standing) -> list[tuple[float, float]]:
    """Return the performance profile of a method: (ratio, share of scenes it solves within that ratio), rising.

    References
    ----------
    DolanMore2002, section 2: the share counts all scenes, so that who fails in some never reaches one.
    """
    ratios, count = sorted(standing.ratios), len(standing.results)
    return [(ratio, (i + 1) / count) for i, ratio in enumerate(ratios)]
