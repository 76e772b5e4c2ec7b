"""Figures of a sweep: a line over one axis, a map over two, points over each of several."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from impactlab.casefile.text.words import listed, shown
from impactlab.errors import CaseError, closest
from impactlab.prefixes import Unit
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
    panel_grid,
)
from impactlab.sweeps.chunks import STATUSES
from impactlab.sweeps.plot_axes import (
    Places,
    in_order,
    label_of,
    left_margin,
    longest,
    lower_margin,
    places,
    scale_of,
    set_axis,
)
from impactlab.sweeps.quantities import absent_words
from impactlab.sweeps.result import ABOUT, labels_in
from impactlab.types import Array

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ENDED = [STATUSES.index(name) for name in ("completed", "tolerance_not_met")]
PANEL = "panel"  # label of the axes that show points, beside those of colour bars
HATCH = "/////"
EDGES = "other contacts on either side"  # of a line between two sequences of contacts
MAX_EDGES = 20  # such lines; more would hide the curve, where contacts differ nearly everywhere
MAX_DOTS = 20_000  # of one colour in a panel; of more points every second, third ... one
LEGEND_COLUMNS, LEGEND_ROW = 3, 0.155  # inches high
LEGEND: dict[str, Any] = {
    "loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": LEGEND_COLUMNS, "fontsize": 8, "frameon": False,
    "borderaxespad": 0.2, "labelspacing": 0.3,
}  # fmt: skip
PANEL_LETTERS = 30  # of the name of a quantity in a line beside a low panel


@drawn
def plot_sweep(found: xarray.Dataset, quantity: str) -> Figure:
    """Return a figure of one quantity: lines over one axis, maps over two, points over each of several.

    One panel, line or colour for each contact, pair or body with values; of many nine have names, those furthest
    apart. Points without values are hatched. Where the sweep has the numbers of periods of contact, lines are edges
    between their sequences. Over three axes or more, and of listed points, each axis has a panel with all points, and
    in a grid the line of the means over all other axes.

    Parameters
    ----------
    found : Dataset
        Result of `impactlab.sweep`.
    quantity : str
        Name of a quantity in it.

    Raises
    ------
    CaseError
        If there is no such quantity, or it has no values.
    """
    if not hasattr(found, "data_vars"):
        text = f"plot_sweep() takes the result of a sweep, not {type(found).__name__}"
        raise CaseError(text, remedy="Give that of il.sweep(...) or il.open_sweep(DIR).")
    names = [name for name in found.data_vars if name not in ABOUT]
    if quantity not in names:
        text = f"the sweep has no quantity {shown(quantity)}.{closest(quantity, map(str, names))}"
        raise CaseError(text, remedy=f"It has {listed(map(str, names))}.")
    found = in_order(found)
    axes = [str(dim) for dim in found["status"].dims]
    values = found[quantity]
    others = [str(dim) for dim in values.dims if dim not in axes]
    if not values.size:
        raise CaseError(f"{quantity} has no values: {absent_words(others[0])}", remedy="Draw another quantity.")
    labels = labels_in(values, axes)
    tables = [values.isel({others[0]: number}) if others else values for number in range(len(labels))]
    known = [number for number, table in enumerate(tables) if np.any(np.isfinite(table.values))] or [0]
    tables, labels = [tables[number] for number in known], [labels[number] for number in known]
    if axes == ["point"] or len(axes) > 2:
        return _scatters(found, tables, labels, axes)
    return _lines(found, tables, labels, axes[0]) if len(axes) == 1 else _maps(found, tables, labels, axes)


def axes_of(found: xarray.Dataset) -> list[str]:
    """Return the paths of the axes, which are columns where points are listed."""
    return [str(name) for name in found.coords if "path" in found[name].attrs]


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

    place, named = places(found[axis]), labelled([table.values for table in tables], len(PALETTE))
    missing, sequences = ~np.isin(found["status"].values, ENDED), _sequences(found, [axis])
    edges = place.edges[1:-1][(np.diff(sequences) != 0) & ~missing[1:] & ~missing[:-1]]
    edges = edges if edges.size <= MAX_EDGES else edges[:0]
    entries = 1 if edges.size else 0
    if labels[0]:
        entries += len(named) + (1 if len(named) < len(tables) else 0)  # all curves without a name are one entry
    top = 0.15 + LEGEND_ROW * max(1, math.ceil(entries / LEGEND_COLUMNS))
    margins = Margins(left=left_margin(place, 1, 0.9), right=0.2, top=top, bottom=lower_margin(place, 1))
    figure, [[axes]] = grid(1, 1, 3.2, margins)
    axes.set_label(PANEL)
    unit = _common_unit(tables)
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
    without_name, with_name = handles[: -len(named)], handles[-len(named) :]  # as they were drawn
    handles = [*with_name, *without_name[:1]] if labels[0] else []
    set_axis(axes, "x", place)
    axes.set_ylabel(label_of(tables[0], unit))
    empty = missing | ~np.any([np.isfinite(table.values) for table in tables], axis=0)
    for first, last in _runs(empty):
        axes.axvspan(place.edges[first], place.edges[last], facecolor="none", edgecolor=MUTED, hatch=HATCH, linewidth=0)
    for edge in edges:
        line = axes.axvline(edge, color=MUTED, linewidth=0.8, linestyle=(0, (4, 2)), zorder=0.5, label=EDGES)
    if edges.size:
        handles.append(line)
    if labels[0] or edges.size:
        axes.legend(handles=handles, **LEGEND)
    return figure


def _scatters(found: xarray.Dataset, tables: list[Any], labels: list[str], dims: list[str]) -> Figure:
    """Draw all points over each axis, and in a grid the means over all other axes."""
    listed_points, paths = dims == ["point"], axes_of(found)
    unit = _common_unit(tables)
    every, columns = math.ceil(found["status"].size / MAX_DOTS), min(2, len(paths))
    drawn_tables = labelled([table.values.ravel() for table in tables], len(PALETTE))
    across, numbers = zip(*(_places_of_points(found, path) for path in paths), strict=True)
    rows = math.ceil(len(drawn_tables) / LEGEND_COLUMNS) if labels[0] else 0
    below = max(lower_margin(each, columns) for each in across)
    top = 0.15 + LEGEND_ROW * max(1, rows)
    margins = Margins(left=0.9, right=0.2, top=top, bottom=below, across=0.8, down=0.15 + below)
    figure, flat = panel_grid(len(paths), columns, 2.2, margins)
    dots: list[Any] = []
    for axes, path, place, which in zip(flat, paths, across, numbers, strict=True):
        others = [dim for dim in dims if dim != path]
        shape = which.shape if listed_points else [-1 if dim == path else 1 for dim in dims]
        x = np.broadcast_to(place.x[which].reshape(shape), found["status"].shape).ravel()[::every]
        dots.clear()
        for colour, number in zip(PALETTE, drawn_tables, strict=False):
            values = tables[number].transpose(*dims) / unit.size
            look: dict[str, Any] = {"color": colour, "alpha": 0.5, "markersize": 4.0, "rasterized": True}
            dots += axes.plot(x, values.values.ravel()[::every], ".", label=labels[number], **look)
            if not listed_points:
                axes.plot(place.x, values.mean(others).values[np.unique(which, return_index=True)[1]], color=colour)
        set_axis(axes, "x", place, columns)
    for axes in flat[::columns]:
        axes.set_ylabel(label_of(tables[0], unit, PANEL_LETTERS))
    if labels[0]:
        flat[0].legend(handles=dots, **LEGEND)
    return figure


def _common_unit(tables: list[Any]) -> Unit:
    return scale_of(max(tables, key=lambda table: float(np.nanmax(np.abs(table.values), initial=0.0))))


def _places_of_points(found: xarray.Dataset, path: str) -> tuple[Places, NDArray[np.int64]]:
    """Return the places of the different values of an axis, and the number of each value among them."""
    _, first, which = np.unique(found[path].values, return_index=True, return_inverse=True)
    return places(found[path][first]), which


def _maps(found: xarray.Dataset, tables: list[Any], labels: list[str], names: list[str]) -> Figure:
    across, up = (places(found[name]) for name in names)
    columns = min(2, len(tables))
    below = lower_margin(across, columns)
    left = max(0.8, 0.35 + LETTER * longest(up))
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
        set_axis(axes, "x", across, columns)
        set_axis(axes, "y", up)
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

    unit = scale_of(table)
    is_counted = whole.size > 0 and not unit.label
    shown = values / unit.size
    options: dict[str, Any] = {"cmap": ListedColormap(colormaps["cividis"](np.linspace(0.25, 1.0, 192)))}
    if is_counted:
        shown = np.where(np.isfinite(values), np.searchsorted(whole, values), np.nan)
        norm = BoundaryNorm(np.arange(whole.size + 1) - 0.5, whole.size)
        options = {"cmap": ListedColormap(PALETTE[: whole.size]), "norm": norm}
    image = axes.pcolormesh(across.edges, up.edges, np.ma.masked_invalid(shown.T), rasterized=True, **options)
    bar = axes.figure.colorbar(image, ax=axes, fraction=0.06, pad=0.03, label=label_of(table, unit))
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
