"""The house style of the figures: colours, widths, axes, units, labels beside their lines."""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, ParamSpec, TypeVar, cast

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.prefixes import Unit, scaled
from impactlab.scene.problem import Scene
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

INK = "#1b2330"  # the exact solution, text
MUTED = "#6b7480"  # text and lines in the background
GRID = "#e1e5ea"
PAPER = "#ffffff"
UNNAMED = "#b4bcc6"  # lines without a name, among many
# Told apart also by eyes without red or green: neighbours differ in lightness. Labels never rely on colour alone.
PALETTE = ("#2563d9", "#d1481f", "#0d9a84", "#d6a01c", "#7f3f9c", "#62b4e8", "#e78bb2", "#8d97a3", "#5c6b1a")
DASHES: tuple[tuple[float, tuple[float, ...] | None], ...] = ((0, None), (0, (4, 1.5)), (0, (1.2, 1.2)))
STYLE = Path(__file__).parents[2] / "house.mplstyle"
WIDTH = 8.6  # inches, of a figure on a page
COLUMNS = {"one": 3.35, "two": 6.9}  # inches, of a figure in one column and across two of a journal
_width: ContextVar[float] = ContextVar("width", default=WIDTH)
LABEL = 8.0  # points, of names beside lines

P = ParamSpec("P")
R = TypeVar("R")


class Trace(NamedTuple):
    """A history as it is drawn."""

    name: str
    history: AbstractHistory
    colour: str
    dash: tuple[float, tuple[float, ...] | None] = (0, None)
    reference: AbstractHistory | None = None  # the reference of its errors, a dark line


@functools.cache
def house_style() -> Any:
    """Return matplotlib's settings in the house style."""
    import matplotlib as mpl

    return mpl.rc_params_from_file(STYLE, use_default_template=False)


def drawn(function: Callable[P, R]) -> Callable[P, R]:
    """Return the function, run in the house style (matplotlib is imported only then)."""

    @functools.wraps(function)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> R:
        import matplotlib as mpl

        with mpl.rc_context(house_style()):
            return function(*args, **kwargs)

    return wrapper


def traces(
    histories: Mapping[str, AbstractHistory], references: Mapping[str, AbstractHistory] | None = None
) -> list[Trace]:
    """Return the histories with colours and references; dashed beyond the palette."""
    n, references = len(PALETTE), references or {}
    return [
        Trace(name, history, PALETTE[i % n], DASHES[min(i // n, len(DASHES) - 1)], references.get(name))
        for i, (name, history) in enumerate(histories.items())
    ]


def exact_of(drawn: Sequence[Trace]) -> AbstractHistory | None:
    """Return the first reference of the traces, the dark line of a figure."""
    return next((trace.reference for trace in drawn if trace.reference is not None), None)


@contextlib.contextmanager
def figure_width(inches: float) -> Iterator[None]:
    """Draw figures of that width inside."""
    token = _width.set(inches)
    try:
        yield
    finally:
        _width.reset(token)


def is_narrow() -> bool:
    """Return whether figures are drawn for one column."""
    return _width.get() < 4.0


def across(columns: int) -> int:
    """Return how many of some panels stand side by side."""
    return min(columns, 1 if is_narrow() else 2 if _width.get() < 8.0 else 3)


class Margins(NamedTuple):
    """Fixed space around and between the axes of a figure [inch]."""

    left: float = 0.72
    right: float = 0.12
    top: float = 0.32
    bottom: float = 0.48
    across: float = 0.62  # between columns
    down: float = 0.62  # between rows


MARGINS = Margins()
NAMES = 1.45  # inches, beside axes for names of methods
LETTER = 0.078  # inches, of a name's letter


def room_for(names: Iterable[str]) -> float:
    """Return how many inches the longest of some names needs beside axes, at least `NAMES`."""
    return max(0.0 if is_narrow() else NAMES, LETTER * max(map(len, names), default=0))


def room_beside(names: Iterable[str]) -> float:
    """Return the inches beside axes for line names; little if narrow."""
    return MARGINS.right if is_narrow() else room_for(names)


def grid(
    rows: int, columns: int, panel: float, margins: Margins = MARGINS, *, share: bool = False
) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure of the present width and its axes by row.

    Each is ``panel`` inches high. With ``share`` the panels have common scales, and only the outer ones show them.
    """
    from matplotlib.figure import Figure

    whole = _width.get()
    height = margins.top + margins.bottom + rows * panel + (rows - 1) * margins.down
    figure = Figure(figsize=(whole, height))
    width = (whole - margins.left - margins.right - (columns - 1) * margins.across) / columns
    places = {
        "left": margins.left / whole,
        "right": 1.0 - margins.right / whole,
        "top": 1.0 - margins.top / height,
        "bottom": margins.bottom / height,
        "wspace": margins.across / width,
        "hspace": margins.down / panel,
    }
    axes = figure.subplots(rows, columns, squeeze=False, sharex=share, sharey=share, gridspec_kw=places)
    return figure, [list(row) for row in axes]


def panel_grid(count: int, columns: int, panel: float, margins: Margins) -> tuple[Figure, list[Axes]]:
    """Return a figure as `grid`, and the axes of ``count`` panels."""
    figure, rows = grid(math.ceil(count / columns), columns, panel, margins)
    flat = [axes for row in rows for axes in row]
    for axes in flat[count:]:
        axes.set_visible(False)
    return figure, flat[:count]


def clock(scene: Scene) -> Unit:
    """Return the unit of time axes: seconds with the prefix that suits the run."""
    return scaled("s", scene.duration)


def log_axis(axis: Axis) -> None:
    """Label a logarithmic axis by its decades in decimal notation."""
    from matplotlib.ticker import NullLocator

    axis.set_major_formatter(lambda value, _: f"{value:g}".replace("-", "\N{MINUS SIGN}"))
    axis.set_minor_locator(NullLocator())


TRIPS = 0.4  # inches below an axis of time, for a second one in round trips T


def time_axis(axes: Axes, scene: Scene, *, trips: bool = False, view: tuple[float, float] | None = None) -> None:
    """Set up a time axis; ``trips`` adds one in round trips.

    Parameters
    ----------
    view : pair of float, optional
        Times [s] between which the figure is drawn, in the unit of the later one; the whole run if not given.
    """
    start, end = view or (0.0, scene.duration)
    unit = scaled("s", end)
    axes.set_xlim(start / unit.size, end / unit.size)
    part = "" if (start, end) == (0.0, scene.duration) else f"  (run: {_seconds(scene.duration)})"
    axes.set_xlabel(f"time  t  [{unit.label}]{part}")
    if trips and math.isfinite(scene.round_trip):
        _trip_axis(axes, scene.round_trip / unit.size, start / unit.size, end / unit.size)


def _seconds(time: float) -> str:
    unit = scaled("s", time)
    return f"{time / unit.size:.4g} {unit.label}"


def _trip_axis(axes: Axes, trip: float, start: float, end: float) -> None:
    """Draw lines and words of round trips below the time axis."""
    from matplotlib.lines import Line2D
    from matplotlib.ticker import MaxNLocator

    figure = cast("Figure", axes.get_figure())
    inch = 1.0 / (figure.get_figheight() * axes.get_position().height)  # as a share of the height of the axes
    low = -TRIPS * inch
    known = MaxNLocator(6, steps=[1, 2, 5, 10]).tick_values(start / trip, end / trip)
    ticks = [value for value in known if start <= value * trip <= end]
    places = [value * trip for value in ticks]
    x = [start, end, *(x for place in places for x in (math.nan, place, place))]
    y = [low, low, *(y for _ in places for y in (math.nan, low, low - 0.042 * inch))]
    across = axes.get_xaxis_transform()
    figure.add_artist(Line2D(x, y, transform=across, color=MUTED, linewidth=0.7))
    for place, value in zip(places, ticks, strict=True):
        figure.text(place, low - 0.06 * inch, f"{value:g}", transform=across, ha="center", va="top", fontsize=8)
    figure.text(0.5, low - 0.21 * inch, "t / T", transform=axes.transAxes, ha="center", va="top")
    axes.xaxis.labelpad = 0.0


def lower_margin(*, trips: bool) -> float:
    """Return the margin below the axes [inch], with ``trips`` for a second axis of time."""
    return MARGINS.bottom + TRIPS * trips


def curve(history: AbstractHistory, channel: str, duration: float, columns: int = 700) -> tuple[Array, Array]:
    """Return times [s] and values of a channel as a line to draw.

    Of the samples in each narrow column of time only the first, least, largest and last are kept, so that no spike is
    lost and no file grows large; both sides of each jump are among them.
    """
    jumps = history.jumps(channel)
    jumps = jumps[(jumps > 0.0) & (jumps < duration)]
    samples = max(6 * columns, 2 * min(history.cost.steps, 50_000))
    t = np.sort(np.concatenate((np.linspace(0.0, duration, samples), jumps, np.nextafter(jumps, 0.0))))
    return thinned(t, history.evaluate(t, channel), columns)


def thinned(t: Array, values: Array, columns: int) -> tuple[Array, Array]:
    """Return first, least, largest and last samples per column; empty if one is missing."""
    if not np.all(np.isfinite(values)):
        return np.empty(0), np.empty(0)
    first = np.searchsorted(t, np.linspace(t[0], t[-1], columns, endpoint=False))
    edges = np.append(first, t.size)
    kept: list[int] = []
    for start, end in itertools.pairwise(edges):
        part = values[start:end]
        kept += [start, start + int(part.argmin()), start + int(part.argmax()), end - 1]
    index = np.unique(kept)
    return t[index], values[index]


MAX_LABELS = 10  # names beside an axes: more do not fit


def labelled(curves: Sequence[Array], most: int = MAX_LABELS) -> list[int]:
    """Return the numbers of curves that have a name in a figure.

    Of few these are all, else those furthest apart. Each one is chosen for its largest distance from all curves chosen
    before it, the first curve first.
    """
    if len(curves) <= most:
        return list(range(len(curves)))
    table, chosen = np.nan_to_num(np.array(curves)), [0]
    distance = np.max(np.abs(table - table[0]), axis=1)
    while len(chosen) < most:
        chosen.append(int(np.argmax(np.where(np.isin(np.arange(len(curves)), chosen), -1.0, distance))))
        distance = np.minimum(distance, np.max(np.abs(table - table[chosen[-1]]), axis=1))
    return sorted(chosen)


def label_lines(axes: Axes, ends: Iterable[tuple[float, str, str]]) -> None:
    """Write names beside the ends of their lines, without overlaps.

    Parameters
    ----------
    ends : iterable of (float, str, str)
        Height of the line's end in data, name, colour.
    """
    if is_narrow():
        small_legend(axes, [(name, colour, "solid") for _, name, colour in ends])
        return
    low, high = axes.get_ylim()
    to_axes = axes.transAxes.inverted()
    items = sorted(
        (float(to_axes.transform(axes.transData.transform((0.0, min(max(y, low), high))))[1]), name, colour)
        for y, name, colour in ends
    )
    for (y, name, colour), at in zip(items, inside(spread([y for y, _, _ in items], _line_height(axes))), strict=True):
        beside(axes, name, colour, at, (1.0, y))


def key(axes: Axes, traces: Sequence[Trace]) -> None:
    """Write the names of traces at the right of an axes."""
    name_lines(axes, [(trace.name, trace.colour, trace.dash) for trace in traces])


def name_lines(axes: Axes, names: Sequence[tuple[str, str, Any]]) -> None:
    """Write names with colour and dash beside an axes; above if narrow."""
    if is_narrow():
        small_legend(axes, names)
        return
    for row, (name, colour, dash) in enumerate(names):
        at = 1.0 - (row + 0.5) * _line_height(axes)
        beside(axes, name, colour, at, (1.0, at), linewidth=2.0, linestyle=dash)


LEGEND_LINE = 0.15  # inches


def upper_margin(names: Iterable[str]) -> float:
    """Return the margin above axes [inch], with line names if narrow."""
    return MARGINS.top + (LEGEND_LINE * ((len(list(names)) + 1) // 2) + 0.05 if is_narrow() else 0.0)


def small_legend(axes: Axes, names: Sequence[tuple[str, str, Any]]) -> None:
    """Write names and lines at the top of a narrow figure."""
    from matplotlib.lines import Line2D

    figure = cast("Figure", axes.get_figure())
    lines = [Line2D([], [], color=colour, linestyle=dash, linewidth=1.5) for _, colour, dash in names]
    figure.legend(
        lines,
        [name for name, _, _ in names],
        loc="upper left",
        bbox_to_anchor=(0.1, 1.0),
        borderaxespad=0.0,
        labelspacing=0.25,
        fontsize=6.5,
        frameon=False,
        ncols=2 if len(names) > 1 else 1,
    )


def _line_height(axes: Axes) -> float:
    """Return the height of a line of names relative to the axes."""
    figure = cast("Figure", axes.get_figure())
    return 1.4 * LABEL / 72.0 / (figure.get_figheight() * axes.get_position().height)


def beside(
    axes: Axes, name: str, colour: str, at: float, end: tuple[float, float], gap: float = 0.2, **line: Any
) -> None:
    """Write a name ``gap`` [inch] beside an axes, and its line to ``end``."""
    axes.annotate(
        name,
        xy=end,
        xytext=(1.0 + gap / (_width.get() * axes.get_position().width), at),
        xycoords="axes fraction",
        textcoords="axes fraction",
        color=colour,
        fontsize=LABEL,
        va="center",
        annotation_clip=False,
        arrowprops={
            "arrowstyle": "-",
            "color": colour,
            "linewidth": 0.7,
            "shrinkA": 2.0,
            "shrinkB": 1.0,
            "relpos": (0, 0.5),
        }
        | line,
    )


def spread(heights: Sequence[float], distance: float) -> list[float]:
    """Return the heights (sorted) moved as little as needed to stand at least ``distance`` apart.

    Each crowded group is centred on its mean; groups that come to touch are merged.
    """
    groups: list[tuple[float, int]] = []  # mean height, members
    for height in heights:
        groups.append((height, 1))
        while len(groups) > 1:
            (below, m), (above, n) = groups[-2:]
            if above - below >= distance * (m + n) / 2.0:
                break
            groups[-2:] = [((below * m + above * n) / (m + n), m + n)]
    return [mean + distance * (i - (n - 1) / 2.0) for mean, n in groups for i in range(n)]


def inside(heights: Sequence[float]) -> list[float]:
    """Return sorted heights moved together into 0 to 1."""
    if not heights:
        return []
    down = max(0.0, heights[-1] - 1.0)
    up = max(0.0, down - heights[0])
    return [height - down + up for height in heights]
