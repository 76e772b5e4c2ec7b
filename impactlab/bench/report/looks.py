"""How a method looks in every figure of a report, who is named in a figure, and how a name meets the end of a line."""

from __future__ import annotations

import collections
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from impactlab.bench.report.fronts import front_of, stepped
from impactlab.bench.report.views import CLOCKS, GOALS, NORMS, Family, Norm, SceneRows, methods_of, on_special_grid
from impactlab.report.style import INK, LABEL, PALETTE, spread

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

SHAPES = ("o", "s", "^", "D")  # of dots: colours come again with another shape
COLOURS = tuple(colour for colour in PALETTE if colour != PALETTE[7])  # that one is near the grey of the crowd
GREY = "#a9b1bb"  # methods that are not named
NAMED = 8  # methods at most that a figure names
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
LETTERS = 34  # of a name beside a line; a longer one is cut


class Look(NamedTuple):
    """Colour and shape of the dots of a method."""

    colour: str
    shape: str


class End(NamedTuple):
    """The end of a line, in data, and the name that belongs there."""

    x: float
    y: float
    name: str
    colour: str


def looks(scenes: Sequence[SceneRows]) -> dict[str, Look]:
    """Return the look of every method, the same in all figures; who leads most often comes first.

    Methods that go without steps, the exact answers, are dark.
    """
    led: collections.Counter[str] = collections.Counter()
    for scene in scenes:
        for norm in (*GOALS, *NORMS[2:]):
            led.update(leaders(scene, norm))
    stepless = {family.method for scene in scenes for family in scene.families if is_stepless(family)}
    others = [method for method in methods_of(scenes) if method not in stepless]
    others.sort(key=lambda method: -led[method])  # stable: the table decides between equals
    n = len(COLOURS)
    coloured = {m: Look(COLOURS[i % n], SHAPES[i // n % len(SHAPES)]) for i, m in enumerate(others)}
    return coloured | {method: Look(INK, "o") for method in stepless}


def told_apart(named: Iterable[str], look: Mapping[str, Look]) -> dict[str, Look]:
    """Return the looks of the methods that a figure names: who would have the colour of another gets a free one."""
    found: dict[str, Look] = {}
    for method in named:
        taken = {each.colour for each in found.values()}
        colour, shape = look[method]
        free = [other for other in COLOURS if other not in taken]
        found[method] = Look(free[0] if colour in taken and colour != INK and free else colour, shape)
    return found


def is_stepless(family: Family) -> bool:
    """Return whether a family ended somewhere and never took a step."""
    return bool(family.completed) and all(row.stepless for row in family.completed)


def is_special(family: Family) -> bool:
    """Return whether a family stands on the special grid dt = h/c."""
    return any(on_special_grid(row) for row in family.rows)


def leaders(scene: SceneRows, norm: Norm, most: int = NAMED) -> list[str]:
    """Return the methods a figure names: those on the front, by time first, then by time with set-up, steps, unknowns.

    Methods without steps do not count among them.
    """
    rows = stepped(scene)
    fronts = [front_of(rows, norm, scene, clock) for clock in CLOCKS.values()]
    fronts += [front_of(rows, norm, scene, cost) for cost in (lambda row: row.steps, lambda row: row.unknowns)]
    names = dict.fromkeys(point.row.method for found in fronts for point in found)
    return list(names)[:most]


def decades(axis: Axis) -> None:
    """Label a logarithmic axis by powers of ten."""
    from matplotlib.ticker import LogLocator, NullLocator

    axis.set_major_locator(LogLocator(10.0, numticks=9))
    axis.set_major_formatter(lambda value, _: power(value))
    axis.set_minor_locator(NullLocator())


def power(value: float) -> str:
    """Return a power of ten as it is printed: ``10⁻³``."""
    return "" if value <= 0.0 else f"10{str(round(math.log10(value))).translate(SUPERSCRIPT)}"


def shortened(name: str, letters: int = LETTERS) -> str:
    """Return a name that fits beside a line."""
    return name if len(name) <= letters else f"{name[: letters - 1]}…"


def name_ends(axes: Axes, ends: Iterable[End], gap: float = 0.14) -> None:
    """Write names in a column at the right of an axes, each with a thin line to the end of its own line.

    Parameters
    ----------
    gap : float
        Distance of the column from the axes [inch].
    """
    from matplotlib.figure import Figure

    figure = axes.get_figure()
    assert isinstance(figure, Figure)  # noqa: S101 - no subfigures here
    place = axes.get_position()
    width, height = figure.get_figwidth() * place.width, figure.get_figheight() * place.height
    to_axes = axes.transData + axes.transAxes.inverted()
    items = sorted(
        (float(y), float(x), end)
        for end in ends
        for x, y in [to_axes.transform((end.x, end.y))]
        if math.isfinite(x + y)
    )
    heights = within([min(max(y, 0.0), 1.0) for y, _, _ in items], 1.45 * LABEL / 72.0 / height)
    for (y, x, end), at in zip(items, heights, strict=True):
        axes.annotate(
            shortened(end.name),
            xy=(min(x, 1.0), y),
            xytext=(1.0 + gap / width, at),
            xycoords="axes fraction",
            textcoords="axes fraction",
            color=end.colour,
            fontsize=LABEL,
            va="center",
            annotation_clip=False,
            arrowprops={
                "arrowstyle": "-",
                "color": end.colour,
                "linewidth": 0.5,
                "alpha": 0.7,
                "shrinkA": 1.0,
                "shrinkB": 3.0,
                "relpos": (0, 0.5),
            },
        )


def within(heights: Sequence[float], distance: float, low: float = -0.1, high: float = 1.02) -> list[float]:
    """Return heights (sorted) at least ``distance`` apart, moved little, and kept between two bounds if they fit."""
    placed = spread(heights, distance)
    for i, limit in enumerate(high - distance * n for n in range(len(placed))):
        placed[-1 - i] = min(placed[-1 - i], limit)
    for i in range(len(placed)):
        placed[i] = max(placed[i], low + distance * i)
    return placed
