"""Pareto fronts: rows that are not beaten in time and error."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from impactlab.bench.report.views import CLOCKS, Clock, Norm, SceneRows, error
from impactlab.bench.schema import Row


class Point(NamedTuple):
    """A row as a point of a work-precision figure."""

    cost: float
    error: float
    row: Row


def points(rows: Iterable[Row], norm: Norm, scene: SceneRows, cost: Clock = CLOCKS["solve"]) -> list[Point]:
    """Return the completed rows that have both a cost above 0 and an error."""
    found = ((cost(row), error(row, norm, scene), row) for row in rows)
    return [Point(float(c), e, row) for c, e, row in found if c is not None and c > 0.0 and e is not None]


def front_of(rows: Iterable[Row], norm: Norm, scene: SceneRows, cost: Clock = CLOCKS["solve"]) -> list[Point]:
    """Return the Pareto front of some rows of a scene, by rising cost.

    A point is beaten by one that is nowhere worse and somewhere better; equal points stand together. Errors that agree
    in three digits count as equal: methods that differ by rounding do not beat each other.
    """
    kept: list[Point] = []
    rounded = [(p.cost, float(f"{p.error:.2e}"), p) for p in points(rows, norm, scene, cost)]
    last = (0.0, float("inf"))
    for spent, wrong, point in sorted(rounded, key=lambda each: each[:2]):
        if wrong < last[1] or (spent, wrong) == last:
            kept.append(point)
            last = (spent, wrong)
    return kept
