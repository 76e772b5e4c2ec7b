"""Figures of a sweep: a line over one axis, a map over two."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from impactlab.casefile.words import closest, listed, shown
from impactlab.errors import CaseError
from impactlab.report.style import INK, MUTED, PALETTE, Margins, Unit, drawn, grid, log_axis, scaled
from impactlab.sweeps.chunks import STATUSES
from impactlab.types import Array

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_COUNTS = 12  # different whole numbers that a map shows with a colour each
ENDED = [STATUSES.index(name) for name in ("completed", "tolerance_not_met")]


@drawn
def plot_sweep(found: xarray.Dataset, quantity: str) -> Figure:
    """Return a figure of one quantity of a sweep: a line over one axis, a map over two.

    One panel, or one line, for each contact, pair or body. Points without values leave a gap in a line and are hatched
    in a map; in a map, black lines are edges between numbers of periods of contact where the sweep has them.

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
    names = [name for name in found.data_vars if name not in ("status", "reason", "engine")]
    if quantity not in names:
        text = f"the sweep has no quantity {shown(quantity)}.{closest(quantity, map(str, names))}"
        raise CaseError(text, remedy=f"It has {listed(map(str, names))}.")
    axes = [str(dim) for dim in found["status"].dims]
    if axes == ["point"] or len(axes) > 2:
        text = "listed points" if axes == ["point"] else f"{len(axes)} axes"
        raise CaseError(f"a figure of a sweep with {text}", remedy="Select values of all but two axes: found.sel(...).")
    values = found[quantity]
    others = [str(dim) for dim in values.dims if dim not in axes]
    labels = [str(label) for label in values[others[0]].values] if others else [""]
    tables = [values.isel({others[0]: number}) if others else values for number in range(len(labels))]
    return _lines(found, tables, labels, axes[0]) if len(axes) == 1 else _maps(found, tables, labels, axes)


def _scale(values: Any) -> Unit:
    unit = str(values.attrs.get("units", "1"))
    finite = np.abs(values.values[np.isfinite(values.values)])
    return Unit(1.0, "") if unit == "1" else scaled(unit, float(finite.max(initial=0.0)))


def _titled(name: str, unit: Unit) -> str:
    return f"{name} [{unit.label}]" if unit.label else name


def _named(table: Any, unit: Unit) -> str:
    """Return the first clause of the description of a quantity, with its unit."""
    return _titled(str(table.attrs.get("long_name", table.name)).partition(";")[0], unit)


def _places(found: xarray.Dataset, axis: str) -> tuple[Array, str, bool, list[str]]:
    """Return places along an axis, its title, whether it is logarithmic, and the words that stand at the places."""
    coordinate = found[axis]
    if coordinate.dtype.kind not in "iuf":
        return np.arange(coordinate.size, dtype=float), axis, False, [str(word) for word in coordinate.values]
    unit = str(coordinate.attrs.get("units", ""))
    size = scaled(unit, float(np.abs(coordinate.values).max())) if unit else Unit(1.0, "")
    x = coordinate.values.astype(float) / size.size
    even = x.size > 2 and bool(np.all(x > 0.0)) and np.allclose(np.diff(np.log(x)), np.log(x[1] / x[0]), rtol=1e-6)
    return x, _titled(axis, size), even and not np.allclose(np.diff(x), x[1] - x[0], rtol=1e-6), []


def _set_axis(axes: Axes, which: str, place: tuple[Array, str, bool, list[str]]) -> None:
    x, title, logarithmic, words = place
    getattr(axes, f"set_{which}label")(title)
    if logarithmic:
        getattr(axes, f"set_{which}scale")("log")
        log_axis(getattr(axes, f"{which}axis"))
    if words:
        getattr(axes, f"set_{which}ticks")(x, words)


def _lines(found: xarray.Dataset, tables: list[Any], labels: list[str], axis: str) -> Figure:
    place = _places(found, axis)
    figure, [[axes]] = grid(1, 1, 3.2, Margins(left=0.9, right=0.2, top=0.45, bottom=0.6))
    unit = _scale(max(tables, key=lambda table: float(np.nanmax(np.abs(table.values), initial=0.0))))
    for number, (table, label) in enumerate(zip(tables, labels, strict=True)):
        marker = "o" if len(place[0]) <= 60 else ""
        colour = PALETTE[number % len(PALETTE)]
        axes.plot(place[0], table.values / unit.size, marker=marker, markersize=3.5, color=colour, label=label)
    _set_axis(axes, "x", place)
    axes.set_ylabel(_named(tables[0], unit))
    if len(labels) > 1:
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, frameon=False, borderaxespad=0.0)
    return figure


def _maps(found: xarray.Dataset, tables: list[Any], labels: list[str], axes_names: list[str]) -> Figure:
    from matplotlib.colors import BoundaryNorm, ListedColormap

    across, up = (_places(found, name) for name in axes_names)
    columns = min(2, len(tables))
    rows = -(-len(tables) // columns)
    margins = Margins(left=0.8, right=0.55, top=0.4, bottom=0.6, across=1.35, down=0.95)
    figure, panels = grid(rows, columns, 3.2 if columns > 1 else 4.6, margins)
    flat = [panel for row in panels for panel in row]
    missing = ~np.isin(found["status"].transpose(*axes_names).values, ENDED)
    for axes, table, label in zip(flat, tables, labels, strict=False):
        values = table.transpose(*axes_names).values
        unit = _scale(table)
        whole = np.unique(values[np.isfinite(values)])
        options: dict[str, Any] = {"cmap": "cividis"}
        counted = 0 < whole.size <= MAX_COUNTS and bool(np.all(whole == np.round(whole)))
        if counted:
            steps = np.arange(whole[0], whole[-1] + 2) - 0.5
            colours = [PALETTE[int(number) % len(PALETTE)] for number in steps[:-1] + 0.5]
            options = {"cmap": ListedColormap(colours), "norm": BoundaryNorm(steps, len(colours))}
        image = axes.pcolormesh(across[0], up[0], values.T / unit.size, shading="nearest", rasterized=True, **options)
        bar = figure.colorbar(image, ax=axes, fraction=0.06, pad=0.03, label=_named(table, unit))
        if counted:
            bar.set_ticks(list(range(int(whole[0]), int(whole[-1]) + 1)))
        else:
            _edges(axes, found, axes_names, across[0], up[0])
        if missing.any():
            marked = np.where(missing.T, 1.0, np.nan)
            axes.contourf(across[0], up[0], marked, levels=[0.5, 1.5], hatches=["////"], colors="none")
        axes.set_title(label, color=MUTED)
        _set_axis(axes, "x", across)
        _set_axis(axes, "y", up)
    for axes in flat[len(tables) :]:
        axes.set_visible(False)
    return figure


def _edges(axes: Axes, found: xarray.Dataset, names: list[str], across: Array, up: Array) -> None:
    """Draw lines between points of different numbers of periods of contact."""
    if "contacts" not in found or min(len(across), len(up)) < 2:
        return
    counts = found["contacts"].transpose(..., *names).values
    for table in counts.reshape(-1, len(across), len(up)):
        levels = np.unique(table[np.isfinite(table)])
        if levels.size > 1:
            axes.contour(across, up, table.T, levels=0.5 * (levels[1:] + levels[:-1]), colors=INK, linewidths=0.4)
