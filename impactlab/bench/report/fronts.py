"""Pareto fronts: the rows than which no other is both as fast and as close."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from impactlab.bench.report.views import CLOCKS, Norm, SceneRows, error
from impactlab.bench.schema import Row


class Point(NamedTuple):
    """A row as a point of a work-precision figure."""

    cost: float
    error: float
    row: Row


def front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Return the Pareto front of points (cost, error) as indices, by rising cost.

    A point is beaten by one that is nowhere worse and somewhere better; equal points stand together.
    """
    kept: list[int] = []
    for i in sorted(range(len(points)), key=lambda i: points[i]):
        if not kept or points[i][1] < points[kept[-1]][1] or points[i] == points[kept[-1]]:
            kept.append(i)
    return kept


def points(
    rows: Iterable[Row], norm: Norm, scene: SceneRows, cost: Callable[[Row], float | None] = CLOCKS["solve"]
) -> list[Point]:
    """Return the completed rows that have both a cost above 0 and an error."""
    found = ((cost(row), error(row, norm, scene), row) for row in rows)
    return [Point(float(c), e, row) for c, e, row in found if c is not None and c > 0.0 and e is not None]


def front_of(
    rows: Iterable[Row], norm: Norm, scene: SceneRows, cost: Callable[[Row], float | None] = CLOCKS["solve"]
) -> list[Point]:
    """Return the Pareto front of some rows of a scene, by rising cost.

    Errors that agree in three digits count as equal: methods that differ by rounding do not beat each other.
    """
    candidates = points(rows, norm, scene, cost)
    return [candidates[i] for i in front([(p.cost, float(f"{p.error:.2e}")) for p in candidates])]


def stepped(scene: SceneRows) -> list[Row]:
    """Return the rows with steps: where an exact answer exists, no other would stand on a front beside it."""
    return [row for row in scene.rows if not row.stepless]
