"""Comparison of special grids, dt = h/c, with ordinary ones.

Methods with dt = h/c are shown beside the same with 0.9 h/c, and beside rods on which no step is special.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

from impactlab.bench.report.ranking import median, over
from impactlab.bench.report.sheets import DASH, Sheet, headings, milliseconds, short
from impactlab.bench.report.views import BOTH, SceneRows, error
from impactlab.bench.schema import Row, settings_of

NOT_UNIFORM = ("two_material", "stepped")
"""In the names of cases whose rods are not uniform: on them dt = h/c makes nothing exact."""
SIBLING_COURANT = 0.9  # c dt/h of a sibling
SHOWN_ELEMENTS = 100  # elements of the level that is shown


class Pair(NamedTuple):
    """A row on the special grid and its sibling off it, equal except for the step."""

    special: Row
    ordinary: Row | None


class Line(NamedTuple):
    """One method on one scene of a uniform rod, at the level of a typical mesh."""

    method: str
    scene: str
    pair: Pair
    errors: tuple[float | None, float | None]  # on the special grid and off it
    beside: tuple[str, ...]  # the same on the rods that are not uniform, in the order of their scenes

    @property
    def factor(self) -> float | None:
        """Return how many times larger the error is off the special grid."""
        return over(self.errors[1], self.errors[0])


def pairs(scene: SceneRows) -> list[tuple[str, list[Pair]]]:
    """Return rows on the special grid with siblings, by method, in the order of levels."""
    siblings = [row for row in scene.rows if row.courant == SIBLING_COURANT]
    found = []
    for family in scene.families:
        on_grid = [Pair(row, _sibling(row, siblings)) for row in family.rows if row.special]
        if on_grid:
            found.append((family.method, on_grid))
    return found


def _sibling(row: Row, others: Sequence[Row]) -> Row | None:
    """Return the row that differs from a row by its step alone."""
    likely = [other for other in others if _without_step(row) == _without_step(other)]
    # Of two families that are alike in all columns the one with the more similar name is meant.
    return max(likely, key=lambda other: _common(row.method, other.method), default=None)


def _common(one: str, other: str) -> int:
    """Return the number of leading letters that two names share."""
    return sum(1 for _ in itertools.takewhile(lambda pair: pair[0] == pair[1], zip(one, other, strict=False)))


def _without_step(row: Row) -> tuple[object, ...]:
    settings = settings_of(row.settings).items()
    others = {path: value for path, value in settings if not path.startswith("solve.step")}
    return row.elements, row.model, row.basis, row.law, row.integrator, row.events, others


def _lines(scenes: Sequence[SceneRows], others: Sequence[SceneRows]) -> list[Line]:
    """Return every method on the special grid on uniform rods.

    Each scene of a uniform rod is beside the other scenes.
    """
    known = [{method: _typical(listed) for method, listed in pairs(scene)} for scene in others]
    found = []
    for scene in (scene for scene in scenes if scene not in others):
        for method, listed in pairs(scene):
            twins = [(own.get(method, (None, None)), other) for own, other in zip(known, others, strict=True)]
            beside = tuple(short(error(row, BOTH, other)) for twin, other in twins for row in twin)
            pair = _typical(listed)
            errors = error(pair.special, BOTH, scene), error(pair.ordinary, BOTH, scene)
            found.append(Line(method, scene.name, pair, errors, beside))
    return sorted(found, key=lambda line: line.method)


def _typical(listed: Sequence[Pair]) -> Pair:
    """Return the pair whose mesh is nearest to the typical one."""
    return min(listed, key=lambda pair: abs(math.log((pair.special.elements or 1) / SHOWN_ELEMENTS)))


NOTE = (
    "Larger error of displacement and impulse. With dt = h/c a mesh may pass every wave of a uniform rod on without "
    "error: such a row shows the grid, not the method. Read the row at 0.9 h/c, and the same method on rods of two "
    "materials or two areas. A dash stands where there is no row at 0.9 h/c."
)


def _not_uniform(scenes: Sequence[SceneRows]) -> list[SceneRows]:
    return [scene for scene in scenes if any(word in scene.case for word in NOT_UNIFORM)]


def _beside_columns(others: Sequence[SceneRows]) -> list[str]:
    return [f"{scene.name}: {step}" for scene in others for step in ("c dt = h", "0.9 h")]


def special_grids(scenes: Sequence[SceneRows]) -> Sheet:
    """Return the table of special grids, scene by scene."""
    others, rows = _not_uniform(scenes), []
    for line in _lines(scenes, others):
        cells = [line.method, line.scene, str(line.pair.special.elements or DASH)]
        for row, wrong in zip(line.pair, line.errors, strict=True):
            cells += [short(wrong), milliseconds(row.solve_s) if row is not None and row.completed else DASH]
        rows.append((*cells, short(line.factor), *line.beside))
    columns = [f"{group}: {name}" for group in ("c dt = h", "c dt = 0.9 h") for name in ("error", "time [ms]")]
    heads = headings(
        *("method", "scene", "elements", *columns, "error ×", *_beside_columns(others)), text=("method", "scene")
    )
    note = f"{NOTE} Error ×: how many times larger it is at 0.9 h/c."
    return Sheet("special_grids", "Special grids, scene by scene", note, heads, tuple(rows))


def special_summary(scenes: Sequence[SceneRows]) -> Sheet:
    """Return medians over uniform rods on special grids, method by method."""
    others = _not_uniform(scenes)
    groups: dict[str, list[Line]] = {}
    for line in _lines(scenes, others):
        groups.setdefault(line.method, []).append(line)
    rows = []
    for method, own in groups.items():
        known = [(factor, line.scene) for line in own if (factor := line.factor) is not None]
        worst = max(known, default=None)
        errors = [short(median(line.errors[i] for line in own)) for i in (0, 1)]
        factors = [short(median(factor for factor, _ in known)), f"{short(worst[0])} {worst[1]}" if worst else DASH]
        size = str(own[0].pair.special.elements or DASH)
        rows.append((method, size, str(len(own)), *errors, *factors, *own[0].beside))
    heads = headings(
        *("method", "elements", "scenes", *(f"median error, uniform rods: {step}" for step in ("c dt = h", "0.9 h"))),
        *("error × at 0.9 h/c: median", "error × at 0.9 h/c: worst", *_beside_columns(others)),
        text=("method", "worst"),
    )
    return Sheet("special_grids_summary", "Special grids", NOTE, heads, tuple(rows))
