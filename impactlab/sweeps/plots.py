"""Figures of a sweep: a line over one axis, a map over two."""

from __future__ import annotations

import itertools
import re
import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from impactlab.casefile.text.words import listed, shown
from impactlab.errors import CaseError, closest
from impactlab.prefixes import Unit, scaled
from impactlab.report.figures.style import (
    INK,
    LETTER,
    MUTED,
    PALETTE,
    UNNAMED,
    Margins,
    drawn,
    grid,
    labelled,
    log_axis,
    panel_grid,
)
from impactlab.sweeps.chunks import STATUSES
from impactlab.sweeps.quantities import absent_words
from impactlab.sweeps.result import ABOUT, labels_in, unit_of
from impactlab.sweeps.value_names import words_of
from impactlab.types import Array

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ENDED = [STATUSES.index(name) for name in ("completed", "tolerance_not_met")]
PANEL = "panel"  # label of the axes that show points, beside those of colour bars
NAME_LETTERS = 45  # of the name of a quantity in a line beside a panel
HATCH = "/////"
EDGES = "other contacts on either side"  # of a line between two sequences of contacts
LEGEND_COLUMNS, LEGEND_ROW = 3, 0.155  # inches high
PANEL_WIDTHS = {1: 6.4, 2: 2.5}  # inches, of one panel and of two side by side
MAX_WORDS = 30  # below a panel; of more every second, third ... one


class Places(NamedTuple):
    """Where the values of an axis of a sweep stand in a figure."""

    x: Array  # (n,) in the unit of the title
    edges: Array  # (n + 1,) between them and around them
    title: str
    is_logarithmic: bool
    words: tuple[str, ...]  # that stand at the places of an axis without numbers


@drawn
def plot_sweep(found: xarray.Dataset, quantity: str) -> Figure:
    """Return a figure of one quantity: lines over one axis, maps over two.

    One panel, or one line, for each contact, pair or body with values; of many lines nine have names, those furthest
    apart. Points without values are hatched. Where the sweep has the numbers of periods of contact, lines are edges
    between their sequences.

    Parameters
    ----------
    found : Dataset
        Result of `impactlab.sweep`.
    quantity : str
        Name of a quantity in it.

    Raises
    ------
    CaseError
        If there is no such quantity, or the sweep has listed points or more than two axes.
    """
    names = [name for name in found.data_vars if name not in ABOUT]
    if quantity not in names:
        text = f"the sweep has no quantity {shown(quantity)}.{closest(quantity, map(str, names))}"
        raise CaseError(text, remedy=f"It has {listed(map(str, names))}.")
    found = in_order(found)
    axes = [str(dim) for dim in found["status"].dims]
    if axes == ["point"] or len(axes) > 2:
        text = "listed points" if axes == ["point"] else f"{len(axes)} axes"
        raise CaseError(f"a figure of a sweep with {text}", remedy="Select values of all but two axes: found.sel(...).")
    values = found[quantity]
    others = [str(dim) for dim in values.dims if dim not in axes]
    if not values.size:
        raise CaseError(f"{quantity} has no values: {absent_words(others[0])}", remedy="Draw another quantity.")
    labels = labels_in(values, axes)
    tables = [values.isel({others[0]: number}) if others else values for number in range(len(labels))]
    known = [number for number, table in enumerate(tables) if np.any(np.isfinite(table.values))] or [0]
    tables, labels = [tables[number] for number in known], [labels[number] for number in known]
    return _lines(found, tables, labels, axes[0]) if len(axes) == 1 else _maps(found, tables, labels, axes)


def in_order(found: xarray.Dataset) -> xarray.Dataset:
    """Return a sweep whose numbers increase along each axis, without values that are given twice."""
    for axis in map(str, found["status"].dims):
        if axis in found.coords and found[axis].dtype.kind in "iuf":
            found = found.isel({axis: np.unique(found[axis].values, return_index=True)[1]})
    return found


def places(found: xarray.Dataset, axis: str) -> Places:
    """Return the places of an axis's values: linear, logarithmic or words.

    The numbers of an axis increase, as those of `in_order`.
    """
    coordinate = found[axis]
    if coordinate.dtype.kind not in "iuf":
        x = np.arange(coordinate.size, dtype=float)
        return Places(x, _around(x), axis, False, words_of(coordinate.values.tolist()))
    unit = str(coordinate.attrs.get("units", ""))
    size = fitted(unit, float(np.abs(coordinate.values).max()))
    x = coordinate.values.astype(float) / size.size
    if x.size > 2 and np.all(x > 0.0):
        steps, ratios = np.diff(x), np.diff(np.log(x))
        if np.allclose(ratios, ratios[0], rtol=1e-6) and not np.allclose(steps, steps[0], rtol=1e-6):
            return Places(x, np.exp(_around(np.log(x))), _titled(axis, size), True, ())
    return Places(x, _around(x), _titled(axis, size), False, ())


def _around(x: Array) -> Array:
    """Return the middles between places, and an edge outside the first and the last."""
    if x.size == 1:
        return np.array([x[0] - 0.5, x[0] + 0.5])
    middles = 0.5 * (x[1:] + x[:-1])
    return np.concatenate(([2.0 * x[0] - middles[0]], middles, [2.0 * x[-1] - middles[-1]]))


def _scale(values: Any) -> Unit:
    finite = np.abs(values.values[np.isfinite(values.values)])
    return fitted(unit_of(values), float(finite.max(initial=0.0)))


def fitted(unit: str, largest: float) -> Unit:
    """Return a unit with the prefix that suits a value.

    Kilograms and powers take no prefix.
    """
    takes_prefix = unit and not unit.startswith("kg") and not any(letter in unit for letter in "234²³⁴^*")
    return scaled(unit, largest) if takes_prefix else Unit(1.0, unit)


def _titled(name: str, unit: Unit) -> str:
    return f"{name} [{unit.label}]" if unit.label else name


def _named(table: Any, unit: Unit) -> str:
    """Return the first clause of the description of a quantity, with its unit."""
    clause = re.split("[;:,]", str(table.attrs.get("long_name", table.name)))[0]
    return textwrap.fill(_titled(clause, unit), NAME_LETTERS)


def _set_axis(axes: Axes, which: str, place: Places, columns: int = 1) -> None:
    """Set label, scale, ticks and limits of an axis of a panel.

    The panel is one of ``columns``.
    """
    from matplotlib.ticker import LogLocator

    getattr(axes, f"set_{which}label")(place.title)
    if place.is_logarithmic:
        getattr(axes, f"set_{which}scale")("log")
        log_axis(getattr(axes, f"{which}axis"))
        if place.edges[-1] < 100.0 * place.edges[0]:
            getattr(axes, f"{which}axis").set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    if place.words:
        shown = place.x.astype(int)[:: -(-len(place.x) // MAX_WORDS)]
        getattr(axes, f"set_{which}ticks")(place.x[shown], [place.words[number] for number in shown])
        if which == "x" and _is_tilted(place, columns):
            axes.tick_params(axis="x", labelrotation=30.0)
            for label in axes.get_xticklabels():
                label.set(ha="right", rotation_mode="anchor")
    getattr(axes, f"set_{which}lim")(place.edges[0], place.edges[-1])


def _longest(place: Places) -> int:
    return max((len(line) for word in place.words for line in word.split("\n")), default=0)


def _is_tilted(place: Places, columns: int) -> bool:
    """Return whether the words below a panel would touch each other if they stood level."""
    return LETTER * (_longest(place) + 2) * min(len(place.words), MAX_WORDS) > PANEL_WIDTHS[columns]


def _lower_margin(place: Places, columns: int) -> float:
    """Return the margin below a panel [inch].

    Words may take several lines, or be tilted.
    """
    lines = max((word.count("\n") for word in place.words), default=0)
    tilted = 0.5 * LETTER * _longest(place) if _is_tilted(place, columns) else 0.0
    return 0.6 + 0.14 * lines + tilted


def _sequences(found: xarray.Dataset, names: list[str]) -> NDArray[np.int64]:
    """Return a number for each sequence of contacts at the points.

    It is of the shape of the axes, and 0 everywhere without counts.
    """
    shape = tuple(found.sizes[name] for name in names)
    if "contacts" not in found or not found["contacts"].size:
        return np.zeros(shape, dtype=int)
    counts = found["contacts"].transpose(*names, ...).values.reshape(-1, found["contacts"].sizes["contact"])
    counts = np.nan_to_num(counts, nan=-1.0)  # of contacts that a point does not have
    return np.unique(counts, axis=0, return_inverse=True)[1].reshape(shape).astype(int)


def _lines(found: xarray.Dataset, tables: list[Any], labels: list[str], axis: str) -> Figure:
    from matplotlib.ticker import MaxNLocator

    place, named = places(found, axis), labelled([table.values for table in tables], len(PALETTE))
    missing, sequences = ~np.isin(found["status"].values, ENDED), _sequences(found, [axis])
    edges = place.edges[1:-1][(np.diff(sequences) != 0) & ~missing[1:] & ~missing[:-1]]
    entries = (edges.size > 0) + (len(named) + (len(named) < len(tables)) if labels[0] else 0)
    top = 0.15 + LEGEND_ROW * max(1, -(-entries // LEGEND_COLUMNS))
    margins = Margins(left=0.9, right=0.2, top=top, bottom=_lower_margin(place, 1))
    figure, [[axes]] = grid(1, 1, 3.2, margins)
    axes.set_label(PANEL)
    unit = _scale(max(tables, key=lambda table: float(np.nanmax(np.abs(table.values), initial=0.0))))
    counts = _whole(np.concatenate([table.values for table in tables])) if not unit.label else np.array([])
    is_counted = counts.size > 0
    if is_counted:
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
        if np.ptp(counts) < 2:  # ticks of a narrower axis would not be whole
            axes.set_ylim(counts.min() - (1.0 if counts.min() > 0.0 else 0.2), counts.max() + 1.0)
    handles = []
    for number in sorted(range(len(tables)), key=lambda number: number in named):
        has_name = number in named
        marker = "o" if len(place.x) <= 60 and has_name else ""
        colour = PALETTE[named.index(number) % len(PALETTE)] if has_name else UNNAMED
        (line,) = axes.plot(place.x, tables[number].values / unit.size, marker=marker, markersize=3.5, color=colour,
                            linewidth=1.5 if has_name else 0.5, drawstyle="steps-mid" if is_counted else "default",
                            label=labels[number] if has_name else f"... {len(tables) - len(named)} more")  # fmt: skip
        handles.append(line)
    handles = handles[-len(named) :] + handles[: -len(named)][:1] if labels[0] else []
    _set_axis(axes, "x", place)
    axes.set_ylabel(_named(tables[0], unit))
    empty = missing | ~np.any([np.isfinite(table.values) for table in tables], axis=0)
    for first, last in _runs(empty):
        axes.axvspan(place.edges[first], place.edges[last], facecolor="none", edgecolor=MUTED, hatch=HATCH, linewidth=0)
    for edge in edges:
        line = axes.axvline(edge, color=MUTED, linewidth=0.8, linestyle=(0, (4, 2)), zorder=0.5, label=EDGES)
    if edges.size:
        handles.append(line)
    if labels[0] or edges.size:
        axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=LEGEND_COLUMNS, fontsize=8,
                    frameon=False, borderaxespad=0.2, labelspacing=0.3)  # fmt: skip
    return figure


def _maps(found: xarray.Dataset, tables: list[Any], labels: list[str], names: list[str]) -> Figure:
    across, up = (places(found, name) for name in names)
    columns = min(2, len(tables))
    below = _lower_margin(across, columns)
    left = max(0.8, 0.35 + LETTER * _longest(up))
    margins = Margins(left=left, right=0.75, top=0.4, bottom=below, across=0.7 + left, down=0.35 + below)
    figure, flat = panel_grid(len(tables), columns, 3.2 if columns > 1 else 4.6, margins)
    missing = ~np.isin(found["status"].transpose(*names).values, ENDED)
    sequences = np.where(missing, -1, _sequences(found, names))
    whole = _whole(np.concatenate([table.values.ravel() for table in tables]))
    for axes, table, label in zip(flat, tables, labels, strict=True):
        axes.set_label(PANEL)
        axes.grid(visible=False)
        _picture(axes, table, table.transpose(*names).values, across, up, whole)
        _outline(axes, _edges(sequences), across, up, {"edgecolor": INK, "facecolor": "none", "linewidth": 0.7})
        empty = missing | ~np.isfinite(table.transpose(*names).values)
        _hatch(axes, [(i, k, j, k) for k in range(len(up.x)) for i, j in _runs(empty[:, k])], across, up)
        axes.set_title(label, color=MUTED)
        _set_axis(axes, "x", across, columns)
        _set_axis(axes, "y", up)
    return figure


def _whole(values: Array) -> Array:
    """Return the different values where they are few whole numbers; else none."""
    found = np.unique(values[np.isfinite(values)])
    return found if found.size <= len(PALETTE) and np.all(found == np.round(found)) else np.zeros(0)


def _picture(axes: Axes, table: Any, values: Array, across: Places, up: Places, whole: Array) -> None:
    """Draw the values of a map with its colour bar.

    Counts have a colour each, the same in all panels.
    """
    from matplotlib import colormaps
    from matplotlib.colors import BoundaryNorm, ListedColormap

    unit = _scale(table)
    is_counted = whole.size > 0 and not unit.label
    shown = values / unit.size
    options: dict[str, Any] = {"cmap": ListedColormap(colormaps["cividis"](np.linspace(0.25, 1.0, 192)))}
    if is_counted:
        shown = np.where(np.isfinite(values), np.searchsorted(whole, values), np.nan)
        norm = BoundaryNorm(np.arange(whole.size + 1) - 0.5, whole.size)
        options = {"cmap": ListedColormap(PALETTE[: whole.size]), "norm": norm}
    image = axes.pcolormesh(across.edges, up.edges, np.ma.masked_invalid(shown.T), rasterized=True, **options)
    bar = axes.figure.colorbar(image, ax=axes, fraction=0.06, pad=0.03, label=_named(table, unit))
    if bar.solids is not None:
        bar.solids.set_rasterized(True)  # its colours stay those of the picture on a dark page
    if is_counted:
        bar.set_ticks(list(range(whole.size)), labels=[f"{number:g}" for number in whole])


def _runs(marked: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield the first and the place after the last of each row of marked places."""
    ends = np.flatnonzero(np.diff(np.concatenate(([0], marked.astype(int), [0]))))
    yield from zip(ends[::2].tolist(), ends[1::2].tolist(), strict=True)


Line = tuple[int, int, int, int]
"""Numbers of the edges (across, up) where a straight line begins and ends."""


def _edges(sequences: NDArray[np.int64]) -> list[Line]:
    """Return the lines between neighbours of different sequences of contacts.

    Points without one (-1) have no edge.
    """
    found: list[Line] = []
    for turned, table in enumerate((sequences, sequences.T)):
        differ = (table[1:] != table[:-1]) & (table[1:] >= 0) & (table[:-1] >= 0)
        for number in np.flatnonzero(differ.any(axis=1)).tolist():
            for first, last in _runs(differ[number]):
                line = (number + 1, first, number + 1, last)
                found.append((line[1], line[0], line[3], line[2]) if turned else line)
    return found


def _outline(axes: Axes, lines: list[Line], across: Places, up: Places, look: dict[str, Any]) -> None:
    """Draw lines as one path."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    if lines:
        ends = np.array([((across.edges[i], up.edges[k]), (across.edges[j], up.edges[m])) for i, k, j, m in lines])
        codes = np.tile([Path.MOVETO, Path.LINETO], len(lines))
        axes.add_patch(PathPatch(Path(ends.reshape(-1, 2), codes), capstyle="projecting", **look))


def _hatch(axes: Axes, rows: list[Line], across: Places, up: Places) -> None:
    """Hatch the cells of rows of points without values."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    if not rows:
        return
    corners, codes = [], []
    for first, row, last, _ in rows:
        x, y = across.edges[[first, last]], up.edges[[row, row + 1]]
        corners += list(itertools.chain([(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1]), (x[0], y[0])]))
        codes += [Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY]
    path = Path(corners, codes)
    axes.add_patch(PathPatch(path, facecolor="none", edgecolor=MUTED, hatch=HATCH, linewidth=0.0))
