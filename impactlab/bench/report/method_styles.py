"""The style of a method in every figure of a report.

Also chosen are the methods that a figure names, and their names beside the lines.
"""

from __future__ import annotations

import collections
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from impactlab.bench.report.fronts import front_of
from impactlab.bench.report.views import CLOCKS, GOALS, NORMS, MethodRows, Norm, SceneRows, error, methods_of
from impactlab.report.figures.style import INK, LABEL, LETTER, PALETTE, beside, spread

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

SHAPES = ("o", "s", "^", "D")  # of dots: colours come again with another shape
COLOURS = tuple(colour for colour in PALETTE if colour != PALETTE[7])  # that one is near the grey of the others
GREY = "#a9b1bb"  # methods that are not named
MAX_NAMED = 8  # methods that a figure names
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MAX_LETTERS = 34  # of a name beside a line; a longer one is cut
SHORT_AXIS = 300.0  # largest over smallest number on a logarithmic axis, up to which 2 and 5 have labels, too
GAP = 0.14  # inches between an axes and the names at its right


class MethodStyle(NamedTuple):
    """Colour and shape of the dots of a method."""

    colour: str
    shape: str


MethodStyles = Mapping[str, MethodStyle]  # by method


class End(NamedTuple):
    """The end of a line, in data, and the name that belongs there."""

    x: float
    y: float
    name: str
    colour: str


def styles_of(scenes: Sequence[SceneRows]) -> dict[str, MethodStyle]:
    """Return the style of every method, the same in all figures.

    The most frequent leader comes first. Methods without steps, the exact solutions, are dark.
    """
    led: collections.Counter[str] = collections.Counter()
    for scene in scenes:
        for norm in (*GOALS, *NORMS[2:]):
            led.update(leaders(scene, norm))
    stepless = {family.method for scene in scenes for family in scene.families if family.stepless}
    others = [method for method in methods_of(scenes) if method not in stepless]
    others.sort(key=lambda method: -led[method])  # stable: the table decides between equals
    n = len(COLOURS)
    coloured = {m: MethodStyle(COLOURS[i % n], SHAPES[i // n % len(SHAPES)]) for i, m in enumerate(others)}
    return coloured | {method: MethodStyle(INK, "o") for method in stepless}


def methods_by_style(scenes: Sequence[SceneRows], styles: MethodStyles) -> list[str]:
    """Return the names of all methods.

    Those of `styles_of` come first, then those of the cases and the automatic choice.
    """
    every = dict.fromkeys(row.method for scene in scenes for row in scene.all_rows)
    return [*styles, *(name for name in every if name not in styles)]


def distinct(named: Iterable[str], styles: MethodStyles) -> dict[str, MethodStyle]:
    """Return all styles, with distinct colours for named methods.

    Of the methods that a figure names, one with the colour of another gets a free colour.
    """
    found: dict[str, MethodStyle] = {}
    for method in named:
        taken = {each.colour for each in found.values()}
        colour, shape = styles[method]
        free = [other for other in COLOURS if other not in taken]
        found[method] = MethodStyle(free[0] if colour in taken and colour != INK and free else colour, shape)
    return {**styles, **found}


def leaders(scene: SceneRows, norm: Norm) -> list[str]:
    """Return the methods that a figure names.

    They are those on the front, by time first, then by time with set-up, steps, unknowns; of a few methods all, as in a
    bench of one's own method beside some others. Methods without steps do not count among them.
    """
    costs = (*CLOCKS.values(), lambda row: row.steps, lambda row: row.unknowns)
    fronts = [front_of(scene.stepped, norm, scene, cost) for cost in costs]
    first = dict.fromkeys(point.row.method for found in fronts for point in found)
    stepped = [family for family in scene.families if not family.stepless]
    others = [each.method for each in stepped if any(error(row, norm, scene) is not None for row in each.rows)]
    return list(first | dict.fromkeys(others if len(others) <= MAX_NAMED else []))[:MAX_NAMED]


def draw_family(
    axes: Axes, family: MethodRows, styles: MethodStyles, named: bool, line: Sequence[tuple[float, float]], **more: Any
) -> None:
    """Draw a family as a line through its levels (x, y).

    It is dashed on the special grid, and grey where it is not named.
    """
    colour, shape = styles[family.method] if named else (GREY, ".")
    axes.plot(
        [x for x, _ in line],
        [y for _, y in line],
        color=colour,
        marker=shape,
        markersize=4.2 if named else 3.0,
        linewidth=1.6 if named else 0.7,
        linestyle=(0, (4, 1.5)) if family.special else "-",
        alpha=1.0 if named else 0.75,
        zorder=3.0 if named else 2.0,
        **more,
    )


def decades(axis: Axis) -> None:
    """Label a logarithmic axis by powers of ten."""
    from matplotlib.ticker import LogLocator, NullLocator

    axis.set_major_locator(LogLocator(10.0, numticks=9))
    axis.set_major_formatter(lambda value, _: power(value))
    axis.set_minor_locator(NullLocator())


def counts(axis: Axis, low: float, high: float) -> None:
    """Label a logarithmic axis from ``low`` to ``high`` by numbers; of a short one also by 2 and 5 in a decade."""
    from matplotlib.ticker import LogLocator, NullLocator

    axis.set_major_locator(LogLocator(10.0, subs=(1.0, 2.0, 5.0) if high / low < SHORT_AXIS else (1.0,), numticks=12))
    axis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_minor_locator(NullLocator())


def power(value: float) -> str:
    """Return a power of ten as it is printed: ``10⁻³``."""
    return "" if value <= 0.0 else f"10{str(round(math.log10(value))).translate(SUPERSCRIPT)}"


def shortened(name: str, letters: int = MAX_LETTERS) -> str:
    """Return a name that fits beside a line."""
    return name if len(name) <= letters else f"{name[: letters - 1]}…"


def room_beside(names: Iterable[str]) -> float:
    """Return the width that names at the right of an axes need [inch]."""
    return 0.3 + LETTER * max((len(shortened(name)) for name in names), default=8)


def name_ends(axes: Axes, ends: Iterable[End]) -> None:
    """Write names at the right of an axes, with leading lines.

    Each has a thin line to the end of its own line.
    """
    height = axes.bbox.height / axes.figure.dpi  # inch
    to_axes = axes.transData + axes.transAxes.inverted()
    items = sorted(
        (float(y), float(x), end)
        for end in ends
        for x, y in [to_axes.transform((end.x, end.y))]
        if math.isfinite(x + y)
    )
    heights = within([min(max(y, 0.0), 1.0) for y, _, _ in items], 1.45 * LABEL / 72.0 / height)
    for (y, x, end), at in zip(items, heights, strict=True):
        beside(axes, shortened(end.name), end.colour, at, (min(x, 1.0), y), GAP, linewidth=0.5, alpha=0.7, shrinkB=3.0)


def within(heights: Sequence[float], distance: float) -> list[float]:
    """Return sorted heights at least ``distance`` apart, moved little.

    They are kept between two bounds if they fit: a little below the axes and above.
    """
    low, high = -0.1, 1.02
    placed = spread(heights, distance)
    for i, limit in enumerate(high - distance * n for n in range(len(placed))):
        placed[-1 - i] = min(placed[-1 - i], limit)
    for i in range(len(placed)):
        placed[i] = max(placed[i], low + distance * i)
    return placed
