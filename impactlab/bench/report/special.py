"""Special grids: methods with dt = h/c beside the same with 0.9 h/c, and beside rods on which no step is special."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from impactlab.bench.report.read import Row, settings_of
from impactlab.bench.report.sheets import DASH, Heading, Sheet, milliseconds, short
from impactlab.bench.report.views import BOTH, Family, SceneRows, courant, error

RAGGED = ("two_material", "stepped")
"""In the names of cases whose rods are not uniform: on them dt = h/c makes nothing exact."""
ORDINARY = 0.9  # c dt/h of a sibling
TYPICAL = 100  # elements of the level that is shown


class Pair(NamedTuple):
    """A row on the special grid and its sibling off it: the same but for the step."""

    special: Row
    ordinary: Row | None


def pairs(scene: SceneRows) -> list[tuple[str, list[Pair]]]:
    """Return for every method on the special grid its rows and their siblings, level by level."""
    found = []
    for family in scene.families:
        on_grid = [row for row in family.rows if courant(row) == 1.0]
        if on_grid:
            found.append((family.method, [Pair(row, _sibling(row, scene.families)) for row in on_grid]))
    return found


def _sibling(row: Row, families: Sequence[Family]) -> Row | None:
    """Return the row that differs from a row by its step alone."""
    likely = [other for family in families for other in family.rows if courant(other) == ORDINARY and _same(row, other)]
    # Of two families that are alike in all that the table holds, the one with the like name is meant.
    return max(likely, key=lambda other: _common(row.method, other.method), default=None)


def _same(one: Row, other: Row) -> bool:
    return _but_step(one) == _but_step(other)


def _but_step(row: Row) -> tuple[object, ...]:
    """Return what makes a row, its step left out."""
    settings = {path: value for path, value in settings_of(row).items() if not path.startswith("solve.step")}
    return row.elements, row.model, row.basis, row.law, row.integrator, row.events, settings


def _common(one: str, other: str) -> int:
    return next((i for i, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other)))


def special_grids(scenes: Sequence[SceneRows]) -> Sheet:
    """Return the table of special grids: every scene on a uniform rod beside the scenes on rods that are not."""
    ragged = [scene for scene in scenes if any(word in scene.case for word in RAGGED)]
    rows = []
    for scene in scenes:
        if scene in ragged:
            continue
        for method, listed in pairs(scene):
            pair = _typical(listed)
            ordinary, special = _both(pair.ordinary, scene), _both(pair.special, scene)
            cells = [method, scene.name, str(pair.special.elements or DASH)]
            cells += [short(special), _time(pair.special), short(ordinary), _time(pair.ordinary)]
            cells.append(short(ordinary / special) if ordinary and special else DASH)
            for other in ragged:
                twin = next((_typical(found) for name, found in pairs(other) if name == method), None)
                cells += [short(_both(each, other)) for each in (twin or (None, None))]
            rows.append(tuple(cells))
    rows.sort(key=lambda row: row[0])
    heads = [Heading("method", numeric=False), Heading("scene", numeric=False), Heading("elements")]
    for group in ("c dt = h", "c dt = 0.9 h"):
        heads += [Heading("error", group=group), Heading("time", "ms", group=group)]
    heads.append(Heading("error ×"))
    for other in ragged:
        heads += [Heading("c dt = h", group=other.name), Heading("0.9 h", group=other.name)]
    note = (
        "Larger error of displacement and impulse. With dt = h/c a lumped mesh hands every wave of a uniform rod on "
        "without error, so that row tells of the grid, not of the method: read the row at 0.9 h/c (error ×: how many "
        "times larger it is), and the same method on rods of two materials or two areas at the right."
    )
    return Sheet("special_grids", "Special grids", note, tuple(heads), tuple(rows))


def _typical(listed: Sequence[Pair]) -> Pair:
    """Return the pair whose mesh is nearest to the typical one."""
    return min(listed, key=lambda pair: abs(math.log((pair.special.elements or 1) / TYPICAL)))


def _both(row: Row | None, scene: SceneRows) -> float | None:
    return None if row is None else error(row, BOTH, scene)


def _time(row: Row | None) -> str:
    return DASH if row is None or not row.completed else milliseconds(row.solve_s)
