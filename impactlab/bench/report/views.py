"""The rows of a table by scene and family, and the error of a row."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from impactlab.bench.schema import OWN, Row
from impactlab.startup.cached import cached_property

AUTOMATIC = "automatic"  # name of the automatic choice among the methods
MIN_ERROR = 1e-12  # relative; a smaller error is rounding
MAX_UNCERTAINTY = 1.0 / 3.0  # of a tolerance: beyond it a reference cannot show that the tolerance is met

Clock = Callable[[Row], float | None]


class Norm(NamedTuple):
    """A measure of the error, with its title."""

    name: str
    title: str
    axis: str  # label of an axis
    relative: bool = True  # whether the uncertainty of a reference, which is relative, is its floor


NORMS = (
    Norm("displacement", "displacement", "error of displacement (relative L2)"),
    Norm("impulse", "impulse", "error of impulse (relative)"),
    Norm("force_away_from_jumps", "force away from jumps", "error of force, away from jumps (relative L2)", False),
    Norm("force_graph", "force graph", "distance of the force graphs (T, peak)", False),
    Norm("event_times", "event times", "error of event times [T]", False),
)
BOTH = Norm("both", "displacement and impulse", "larger error of displacement and impulse (relative)")
GOALS = (BOTH, NORMS[0], NORMS[1])  # the norms of the rankings
TOLERANCES = (1e-2, 1e-3, 1e-4)
CLOCKS: dict[str, Clock] = {"solve": lambda row: row.solve_s, "total": lambda row: row.total_s}


class MethodRows(NamedTuple):
    """One method on one scene through its levels, in the order of the ladder."""

    method: str
    rows: tuple[Row, ...]

    @property
    def completed(self) -> tuple[Row, ...]:
        """Return the rows that came to their end."""
        return tuple(row for row in self.rows if row.completed)

    @property
    def stepless(self) -> bool:
        """Return whether runs ended and none of them took a step."""
        return bool(self.completed) and all(row.stepless for row in self.completed)

    @property
    def special(self) -> bool:
        """Return whether a row stands on the special grid dt = h/c."""
        return any(row.special for row in self.rows)


@dataclass(frozen=True)
class SceneRows:
    """All rows of one scene, with derived values that are computed once."""

    name: str
    families: tuple[MethodRows, ...]  # of the grid
    own: tuple[MethodRows, ...]  # of the case file
    automatic: tuple[Row, ...]  # of the automatic choice

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """Return the rows of the grid."""
        return tuple(row for family in self.families for row in family.rows)

    @cached_property
    def stepped(self) -> tuple[Row, ...]:
        """Return the rows of the grid with steps.

        Beside an exact solution none of them would stand on a front.
        """
        return tuple(row for row in self.rows if not row.stepless)

    @cached_property
    def all_rows(self) -> tuple[Row, ...]:
        """Return the rows of grid, own methods and automatic choice."""
        return (*self.rows, *(row for family in self.own for row in family.rows), *self.automatic)

    @property
    def case(self) -> str:
        """Return the name of its case."""
        return self.name.partition("/")[0]

    @cached_property
    def measured(self) -> frozenset[str]:
        """Return the names of the norms in which any method has an error."""
        return frozenset(n.name for n in NORMS if any(getattr(row, n.name) is not None for row in self.all_rows))

    @cached_property
    def reference(self) -> str:
        """Return the name of the reference, or an empty string."""
        return next((row.reference for row in self.all_rows if row.reference not in ("", "none")), "")

    @cached_property
    def uncertainty(self) -> float:
        """Return the uncertainty of the reference (relative); 0 where the table has none."""
        return max((row.reference_uncertainty or 0.0 for row in self.all_rows), default=0.0)


def gathered(rows: Sequence[Row]) -> tuple[SceneRows, ...]:
    """Return the scenes in the order of the table.

    Each has its families; levels are in ascending order.
    """
    scenes: dict[str, dict[str, list[Row]]] = {}
    for row in rows:
        scenes.setdefault(row.scene, {}).setdefault(row.method, []).append(row)
    return tuple(_scene(name, methods) for name, methods in scenes.items())


def _scene(name: str, methods: Mapping[str, Sequence[Row]]) -> SceneRows:
    families = [MethodRows(m, tuple(sorted(own, key=_level))) for m, own in methods.items() if m != AUTOMATIC]
    return SceneRows(
        name,
        tuple(family for family in families if not family.method.startswith(OWN)),
        tuple(family for family in families if family.method.startswith(OWN)),
        tuple(methods.get(AUTOMATIC, ())),
    )


def _level(row: Row) -> float:
    """Return the place of a level on its ladder; named levels as in the table."""
    try:
        return float(row.level)
    except ValueError:
        return 0.0


def methods_of(scenes: Sequence[SceneRows]) -> tuple[str, ...]:
    """Return the names of all families of the grid, in the order of the table."""
    return tuple(dict.fromkeys(family.method for scene in scenes for family in scene.families))


def error(row: Row | None, norm: Norm, scene: SceneRows) -> float | None:
    """Return the error of a row for comparisons, or None.

    An error below the uncertainty of the reference counts as that uncertainty, and one below rounding as rounding.
    `BOTH` is the larger of the two; in a scene without impulse, or without displacement, the other one. Event times
    have an error only where no event was missed.
    """
    if row is None or not row.completed:
        return None
    if norm is BOTH:
        parts = [error(row, each, scene) for each in NORMS[:2] if each.name in scene.measured]
        return None if not parts or None in parts else max(part for part in parts if part is not None)
    value = getattr(row, norm.name)
    if value is None or (norm.name == "event_times" and row.events_missed):
        return None
    return max(float(value), MIN_ERROR, scene.uncertainty if norm.relative else 0.0)
