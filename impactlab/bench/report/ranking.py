"""Ranking of methods by scenes within a tolerance, and by time over that of the fastest there."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from impactlab.bench.report.views import CLOCKS, MAX_UNCERTAINTY, Clock, MethodRows, Norm, SceneRows, error, methods_of
from impactlab.bench.schema import Row

CONVERGED = "converged"  # the name of a reference that is itself computed
MET, MISSED, REFUSED, FAILED, UNMEASURED, ABSENT = "met", "missed", "refused", "failed", "unmeasured", "absent"


class Comparable(NamedTuple):
    """The scenes with a reference certain enough for a tolerance, and reasons against others."""

    scenes: tuple[SceneRows, ...]
    excluded: tuple[tuple[str, str], ...]  # name of a scene, reason


class Result(NamedTuple):
    """The result of one method in one scene under one tolerance."""

    outcome: str  # one of MET, MISSED, REFUSED, FAILED, UNMEASURED, ABSENT
    ratio: float | None = None  # its time over that of the fastest method
    ratio_stepped: float | None = None  # over that of the fastest method with steps, special grids left out


class MethodResults(NamedTuple):
    """One method over all comparable scenes under one tolerance."""

    method: str
    results: tuple[Result, ...]  # scene by scene

    def count(self, outcome: str) -> int:
        """Return the number of scenes with an outcome."""
        return sum(result.outcome == outcome for result in self.results)

    @property
    def ratios(self) -> tuple[float, ...]:
        """Return its times over those of the fastest method, where it meets the tolerance."""
        return tuple(result.ratio for result in self.results if result.ratio is not None)

    @property
    def ratios_stepped(self) -> tuple[float, ...]:
        """Return its times over those of the fastest ordinary method.

        That has steps off special grids; both meet the tolerance.
        """
        return tuple(result.ratio_stepped for result in self.results if result.ratio_stepped is not None)


def comparable(scenes: Sequence[SceneRows], norm: Norm, tolerance: float) -> Comparable:
    """Return the scenes whose reference is certain enough for a tolerance."""
    kept, excluded = [], []
    for scene in scenes:
        if not scene.reference:
            excluded.append((scene.name, "no reference to measure errors against"))
        elif scene.reference == CONVERGED and all(row.reference_uncertainty is None for row in scene.all_rows):
            excluded.append((scene.name, "the table has no uncertainty of the reference"))
        elif scene.uncertainty > MAX_UNCERTAINTY * tolerance:
            excluded.append((scene.name, f"the uncertainty of the reference is {scene.uncertainty:.1g}"))
        elif not any(error(row, norm, scene) is not None for row in scene.rows):
            excluded.append((scene.name, f"no method has an error in {norm.title}"))
        else:
            kept.append(scene)
    return Comparable(tuple(kept), tuple(excluded))


def fastest(rows: Iterable[Row], norm: Norm, scene: SceneRows, tolerance: float, clock: Clock) -> Row | None:
    """Return the row that meets a tolerance in the least time.

    None if no row does; a row without a time comes last.
    """

    def time(row: Row) -> float:
        spent = clock(row)
        return math.inf if spent is None else spent

    kept = [row for row in rows if (wrong := error(row, norm, scene)) is not None and wrong <= tolerance]
    return min(kept, key=time, default=None)


def best(
    scene: SceneRows, norm: Norm, tolerance: float, clock: Clock = CLOCKS["solve"], *, ordinary: bool = False
) -> Row | None:
    """Return the fastest row of any method that meets a tolerance.

    Ordinary rows have steps, and are off special grids.
    """
    rows = [row for row in scene.stepped if not row.special] if ordinary else scene.rows
    return fastest(rows, norm, scene, tolerance, clock)


def _result(
    scene: SceneRows, family: MethodRows | None, norm: Norm, tolerance: float, clock: Clock, leads: Sequence[Row | None]
) -> Result:
    """Return the result of a family: met if any level meets the tolerance, else its best."""
    if family is None:
        return Result(ABSENT)
    own = fastest(family.rows, norm, scene, tolerance, clock)
    if own is not None:
        return Result(MET, *(over(clock(own), None if lead is None else clock(lead)) for lead in leads))
    if any(error(row, norm, scene) is not None for row in family.rows):
        return Result(MISSED)
    if family.completed:
        return Result(UNMEASURED)
    return Result(REFUSED if all(row.status == "refused" for row in family.rows) else FAILED)


def over(value: float | None, base: float | None) -> float | None:
    """Return a quotient; None where a number is missing or the base is zero."""
    return None if value is None or not base else value / base


def ranking(scenes: Sequence[SceneRows], norm: Norm, tolerance: float, clock: str = "solve") -> list[MethodResults]:
    """Return the results of all methods, the best first.

    Those that meet the tolerance in most scenes come first, among equals the faster ones.

    Parameters
    ----------
    scenes : sequence of SceneRows
        All scenes; those without a certain reference (`comparable`) are left out for every method alike.
    clock : {"solve", "total"}
        Time without set-up, or with it.
    """
    time = CLOCKS[clock]
    found: dict[str, list[Result]] = {method: [] for method in methods_of(scenes)}
    for scene in comparable(scenes, norm, tolerance).scenes:
        leads = [best(scene, norm, tolerance, time, ordinary=ordinary) for ordinary in (False, True)]
        families = {family.method: family for family in scene.families}
        for method, results in found.items():
            results.append(_result(scene, families.get(method), norm, tolerance, time, leads))
    standings = [MethodResults(method, tuple(results)) for method, results in found.items()]
    return sorted(standings, key=lambda each: (-each.count(MET), median(each.ratios) or 0.0))


def median(values: Iterable[float | None]) -> float | None:
    """Return the median of the values that exist; None without any."""
    known = [value for value in values if value is not None]
    return statistics.median(known) if known else None


def profile(standing: MethodResults) -> list[tuple[float, float]]:
    """Return the performance profile of a method, rising.

    Entries are (ratio, share of scenes it solves within that ratio).

    References
    ----------
    DolanMore2002, section 2: the share counts all scenes, so a method that fails in some never reaches one.
    """
    return [(ratio, (i + 1) / len(standing.results)) for i, ratio in enumerate(sorted(standing.ratios))]
