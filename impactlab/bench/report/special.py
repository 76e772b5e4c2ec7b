"""Special grids: methods with dt = h/c beside the same with 0.9 h/c, and beside rods on which no step is special."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from typing import NamedTuple

from impactlab.bench.report.sheets import DASH, Heading, Sheet, milliseconds, short
from impactlab.bench.report.views import BOTH, Family, SceneRows, courant, error
from impactlab.bench.schema import Row, settings_of

RAGGED = ("two_material", "stepped")
"""In the names of cases whose rods are not uniform: on them dt = h/c makes nothing exact."""
ORDINARY = 0.9  # c dt/h of a sibling
TYPICAL = 100  # elements of the level that is shown


class Pair(NamedTuple):
    """A row on the special grid and its sibling off it: equal except for the step."""

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
    """Return the settings of a row without its step."""
    settings = {path: value for path, value in settings_of(row).items() if not path.startswith("solve.step")}
    return row.elements, row.model, row.basis, row.law, row.integrator, row.events, settings


def _common(one: str, other: str) -> int:
    return next((i for i, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other)))


class Line(NamedTuple):
    """One method on one scene of a uniform rod, and the same level on the rods that are not."""

    method: str
    scene: SceneRows
    pair: Pair
    twins: tuple[Pair | None, ...]  # in the order of the scenes that are not uniform

    @property
    def errors(self) -> tuple[float | None, float | None]:
        """Return the error on the special grid and off it."""
        return _both(self.pair.special, self.scene), _both(self.pair.ordinary, self.scene)

    @property
    def factor(self) -> float | None:
        """Return how many times larger the error is off the special grid."""
        special, ordinary = self.errors
        return ordinary / special if ordinary is not None and special else None


def ragged_of(scenes: Sequence[SceneRows]) -> list[SceneRows]:
    """Return the scenes with rods on which no step is special."""
    return [scene for scene in scenes if any(word in scene.case for word in RAGGED)]


def lines(scenes: Sequence[SceneRows]) -> list[Line]:
    """Return every method on the special grid on every scene of a uniform rod, at the level of a typical mesh."""
    ragged = ragged_of(scenes)
    beside = [{method: _typical(listed) for method, listed in pairs(other)} for other in ragged]
    found = []
    for scene in scenes:
        if not any(scene is other for other in ragged):
            for method, listed in pairs(scene):
                found.append(Line(method, scene, _typical(listed), tuple(own.get(method) for own in beside)))
    return sorted(found, key=lambda line: line.method)


NOTE = (
    "Larger error of displacement and impulse. With dt = h/c a mesh may hand every wave of a uniform rod on without "
    "error: such a row tells of the grid, not of the method. Read the row at 0.9 h/c, and the same method on rods of "
    "two materials or two areas. Where there is no row at 0.9 h/c there is a dash."
)


def special_grids(scenes: Sequence[SceneRows]) -> Sheet:
    """Return the table of special grids, scene by scene."""
    ragged = ragged_of(scenes)
    rows = []
    for line in lines(scenes):
        special, ordinary = line.errors
        cells = [line.method, line.scene.name, str(line.pair.special.elements or DASH), short(special)]
        cells += [_time(line.pair.special), short(ordinary), _time(line.pair.ordinary), short(line.factor)]
        rows.append((*cells, *_beside(line, ragged)))
    heads = [Heading("method", numeric=False), Heading("scene", numeric=False), Heading("elements")]
    for group in ("c dt = h", "c dt = 0.9 h"):
        heads += [Heading("error", group=group), Heading("time", "ms", group=group)]
    heads += [Heading("error ×"), *_beside_heads(ragged)]
    note = f"{NOTE} Error ×: how many times larger it is at 0.9 h/c."
    return Sheet("special_grids", "Special grids, scene by scene", note, tuple(heads), tuple(rows))


def special_summary(scenes: Sequence[SceneRows]) -> Sheet:
    """Return the table of special grids, method by method: medians over the scenes of uniform rods."""
    ragged = ragged_of(scenes)
    groups: dict[str, list[Line]] = {}
    for line in lines(scenes):
        groups.setdefault(line.method, []).append(line)
    rows = []
    for method, own in groups.items():
        known = [(factor, line.scene.name) for line in own if (factor := line.factor) is not None]
        worst = max(known, default=None)
        cells = [method, str(own[0].pair.special.elements or DASH), str(len(own))]
        cells += [short(_median([line.errors[i] for line in own])) for i in (0, 1)]
        cells += [short(_median([factor for factor, _ in known])), f"{short(worst[0])} {worst[1]}" if worst else DASH]
        rows.append((*cells, *_beside(own[0], ragged)))
    heads = (
        Heading("method", numeric=False),
        Heading("elements"),
        Heading("scenes"),
        Heading("c dt = h", group="median error, uniform rods"),
        Heading("0.9 h", group="median error, uniform rods"),
        Heading("median", group="error × at 0.9 h/c"),
        Heading("worst", numeric=False, group="error × at 0.9 h/c"),
        *_beside_heads(ragged),
    )
    return Sheet("special_grids_summary", "Special grids", NOTE, heads, tuple(rows))


def _median(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return statistics.median(known) if known else None


def _beside(line: Line, ragged: Sequence[SceneRows]) -> list[str]:
    """Return the errors of a method on the rods that are not uniform, on the special grid and off it."""
    return [
        short(_both(each, scene))
        for twin, scene in zip(line.twins, ragged, strict=True)
        for each in (twin or (None, None))
    ]


def _beside_heads(ragged: Sequence[SceneRows]) -> list[Heading]:
    return [Heading(name, group=scene.name) for scene in ragged for name in ("c dt = h", "0.9 h")]


def _typical(listed: Sequence[Pair]) -> Pair:
    """Return the pair whose mesh is nearest to the typical one."""
    return min(listed, key=lambda pair: abs(math.log((pair.special.elements or 1) / TYPICAL)))


def _both(row: Row | None, scene: SceneRows) -> float | None:
    return None if row is None else error(row, BOTH, scene)


def _time(row: Row | None) -> str:
    return DASH if row is None or not row.completed else milliseconds(row.solve_s)
