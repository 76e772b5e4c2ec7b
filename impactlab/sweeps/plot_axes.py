"""Axes of the figures of a sweep: places of values, units, ticks and margins."""

from __future__ import annotations

import math
import re
import textwrap
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from impactlab.prefixes import Unit, scaled
from impactlab.report.figures.style import LETTER, log_axis
from impactlab.sweeps.result import unit_of
from impactlab.sweeps.value_names import words_of
from impactlab.types import Array

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

NAME_LETTERS = 45  # of the name of a quantity in a line beside a panel
PANEL_WIDTHS = {1: 6.4, 2: 2.5}  # inches, of one panel and of two side by side
TILT = 30.0  # degrees, of words below a panel that would touch each other
MAX_WORDS = 30  # below a panel; of more every second, third ... one


class Places(NamedTuple):
    """Where the values of an axis of a sweep stand in a figure."""

    x: Array  # (n,) in the unit of the title
    edges: Array  # (n + 1,) between them and around them
    title: str
    is_logarithmic: bool
    words: tuple[str, ...]  # that stand at the places of an axis without numbers


def in_order(found: xarray.Dataset) -> xarray.Dataset:
    """Return a sweep whose numbers increase along each axis, without values that are given twice."""
    for axis in map(str, found["status"].dims):
        if axis in found.coords and found[axis].dtype.kind in "iuf":
            found = found.isel({axis: np.unique(found[axis].values, return_index=True)[1]})
    return found


def places(coordinate: xarray.DataArray) -> Places:
    """Return the places of an axis's values: linear, logarithmic or words.

    The numbers of an axis increase, as those of `in_order`.
    """
    axis = str(coordinate.name)
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


def scale_of(values: Any) -> Unit:
    """Return the unit with the prefix that suits the largest of some values."""
    finite = np.abs(values.values[np.isfinite(values.values)])
    return fitted(unit_of(values), float(finite.max(initial=0.0)))


def fitted(unit: str, largest: float) -> Unit:
    """Return a unit with the prefix that suits a value.

    Kilograms, powers and s/m take no prefix.
    """
    takes_prefix = unit and not unit.startswith(("kg", "s/")) and not any(letter in unit for letter in "234²³⁴^*")
    return scaled(unit, largest) if takes_prefix else Unit(1.0, unit)


def _titled(name: str, unit: Unit) -> str:
    return f"{name} [{unit.label}]" if unit.label else name


def label_of(table: Any, unit: Unit, letters: int = NAME_LETTERS) -> str:
    """Return the first clause of the description of a quantity, with its unit."""
    clause = re.split("[;:,]", str(table.attrs.get("long_name", table.name)))[0]
    return textwrap.fill(_titled(clause, unit), letters)


def set_axis(axes: Axes, which: str, place: Places, columns: int = 1) -> None:
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
        shown = place.x.astype(int)[:: math.ceil(len(place.x) / MAX_WORDS)]
        getattr(axes, f"set_{which}ticks")(place.x[shown], [place.words[number] for number in shown])
        if which == "x" and _is_tilted(place, columns):
            axes.tick_params(axis="x", labelrotation=TILT)
            for label in axes.get_xticklabels():
                label.set(ha="right", rotation_mode="anchor")
    getattr(axes, f"set_{which}lim")(place.edges[0], place.edges[-1])


def longest(place: Places) -> int:
    """Return the letters of the longest line of the words of an axis."""
    return max((len(line) for word in place.words for line in word.split("\n")), default=0)


def _is_tilted(place: Places, columns: int) -> bool:
    """Return whether the words below a panel would touch each other if they stood level."""
    return LETTER * (longest(place) + 2) * min(len(place.words), MAX_WORDS) > PANEL_WIDTHS[columns]


def lower_margin(place: Places, columns: int) -> float:
    """Return the margin below a panel [inch].

    Words may take several lines, or be tilted.
    """
    lines = max((word.count("\n") for word in place.words), default=0)
    tilted = 0.5 * LETTER * longest(place) if _is_tilted(place, columns) else 0.0
    return 0.6 + 0.14 * lines + tilted


def left_margin(place: Places, columns: int, least: float) -> float:
    """Return the margin beside a panel [inch]: tilted words below it begin to the left of their tick."""
    if not _is_tilted(place, columns):
        return least
    reach = math.cos(math.radians(TILT)) * LETTER * longest(place)
    return max(least, 0.1 + reach - 0.5 * PANEL_WIDTHS[columns] / len(place.x))
