"""Figures of an uncertainty: histograms and distributions, bands of signals, probabilities, Sobol indices."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from impactlab.prefixes import Unit
from impactlab.report.figures.style import INK, MUTED, PALETTE, Margins, drawn, grid, panel_grid
from impactlab.sweeps.plot_axes import fitted
from impactlab.sweeps.result import clauses, labels_in
from impactlab.sweeps.sampled import is_sampled
from impactlab.types import Array
from impactlab.uncertainties.records import Estimate, Index, Share, Spread, least_certain

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_PANELS = 6  # values of a quantity, or of the indices, that have a panel
MAX_BARS = 16  # numbers of contacts that have a bar
BINS = 60
MIN_APART = 0.08  # of the width of a panel: percentiles that are nearer share the name of the first
SAMPLED, LINEAR = PALETTE[0], PALETTE[1]
WHISKER: dict[str, Any] = {"color": INK, "linewidth": 1.1}


@drawn
def plot_spreads(data: xarray.Dataset, spreads: Sequence[Spread], percents: Sequence[float]) -> Figure:
    """Return a figure of one quantity: histogram and distribution, or a band over time."""
    if is_sampled(spreads[0].quantity):
        return _band(spreads, percents)
    shown = [each for each in spreads if each.varies][:MAX_PANELS]
    margins = Margins(left=0.72, right=0.2, top=0.62, bottom=0.55, across=0.72, down=0.95)
    figure, rows = grid(max(1, len(shown)), 2, 2.5, margins)
    for (left, right), spread in zip(rows, shown, strict=False):
        values = _samples(data, spread)
        unit = fitted(spread.unit, float(np.abs(values).max()))
        name = clauses(data[spread.quantity])[0] + (f" [{unit.label}]" if unit.label else "")
        _histogram(left, values / unit.size, spread, percents, unit)
        _distribution(right, values / unit.size, spread, percents, unit)
        left.set_title(spread.label, color=MUTED, loc="left", pad=18.0)
        for axes in (left, right):
            axes.set_xlabel(name)
    if shown and math.isfinite(shown[0].linear_deviation):
        rows[0][1].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False, borderaxespad=0.2)
    return figure


def _samples(data: xarray.Dataset, spread: Spread) -> Array:
    """Return the samples of a value that are finite."""
    own = data[spread.quantity].isel(point=data["block"].values == 0)
    table = own.transpose("point", ...).values.reshape(own.sizes["point"], -1)
    values: Array = table[:, labels_in(own, ["point"]).index(spread.label)]
    return values[np.isfinite(values)]


def _histogram(axes: Axes, values: Array, spread: Spread, percents: Sequence[float], unit: Unit) -> None:
    bins = min(BINS, max(8, round(math.sqrt(values.size))))
    counts, edges = np.histogram(values, bins=bins, range=(values.min(), values.max()))
    heights = 100.0 * counts / values.size
    axes.stairs(heights, edges, fill=True, color=SAMPLED, alpha=0.3, linewidth=0.0)
    axes.stairs(heights, edges, color=SAMPLED, linewidth=1.2)
    x, line = _linear(axes, values, spread, unit)
    if x.size:
        width = edges[1] - edges[0]
        bell = np.exp(-0.5 * ((x - line[0]) / line[1]) ** 2) / (line[1] * math.sqrt(2.0 * math.pi))
        axes.plot(x, 100.0 * width * bell, color=LINEAR, linestyle=(0, (4, 2)), linewidth=1.3)
    axes.set_ylim(0.0, 1.18 * heights.max())
    axes.set_ylabel("samples in each bin [%]")
    before, room = -math.inf, MIN_APART * float(np.diff(axes.get_xlim())[0])
    for percent, each in zip(percents, spread.percentiles, strict=True):
        axes.axvline(each.value / unit.size, color=MUTED, linewidth=0.8)
        if each.value / unit.size - before < room:
            continue
        before = each.value / unit.size
        axes.annotate(f"{percent:g} %", (each.value / unit.size, 1.0), (0, 2), xycoords=("data", "axes fraction"),
                      textcoords="offset points", ha="center", va="bottom", fontsize=7, color=MUTED)  # fmt: skip


def _distribution(axes: Axes, values: Array, spread: Spread, percents: Sequence[float], unit: Unit) -> None:
    from scipy.stats import norm

    ordered = np.sort(values)
    shares = np.arange(1, ordered.size + 1) / ordered.size
    thin = np.unique(np.linspace(0, ordered.size - 1, min(ordered.size, 400)).round().astype(int))
    axes.plot(ordered[thin], shares[thin], color=SAMPLED, drawstyle="steps-post", label="samples")
    x, line = _linear(axes, values, spread, unit)
    if x.size:
        axes.plot(x, norm.cdf(x, *line), color=LINEAR, linestyle=(0, (4, 2)), linewidth=1.3, label="linear estimate")
    for percent, each in zip(percents, spread.percentiles, strict=True):
        _whisker(axes, each, unit.size, 0.01 * percent)
        axes.plot(each.value / unit.size, 0.01 * percent, "o", color=INK, markersize=3.5)
    axes.set_ylim(0.0, 1.02)
    axes.set_ylabel("probability of less")


def _linear(axes: Axes, values: Array, spread: Spread, unit: Unit) -> tuple[Array, tuple[float, float]]:
    """Return places on the axis, and the linear estimate's mean and deviation, or none."""
    mean, deviation = spread.linear_mean / unit.size, spread.linear_deviation / unit.size
    low, high = float(values.min()), float(values.max())
    if math.isfinite(deviation) and deviation > 0.0:
        low, high = min(low, mean - 2.5 * deviation), max(high, mean + 2.5 * deviation)
        axes.set_xlim(low - 0.02 * (high - low), high + 0.02 * (high - low))
        return np.linspace(low, high, 200), (mean, deviation)
    return np.empty(0), (0.0, 0.0)


def _whisker(axes: Axes, of: Estimate, size: float, at: float) -> None:
    """Draw an interval; an open end reaches the edge of the panel."""
    limits = axes.get_xlim()
    ends = np.array([of.lower, of.upper]) / size
    if math.isinf(of.error):
        ends = np.clip(ends, *limits)
    axes.plot(ends, [at, at], **WHISKER, solid_capstyle="butt")
    if math.isinf(of.error):
        axes.set_xlim(limits)


def _band(spreads: Sequence[Spread], percents: Sequence[float]) -> Figure:
    """Return the band of a sampled channel over time: mean, and between the outer percentiles."""
    figure, [[axes]] = grid(1, 1, 3.2, Margins(left=0.9, right=0.2, top=0.45, bottom=0.6))
    times = np.array([float(each.label) for each in spreads])
    clock = fitted("s", float(np.abs(times).max()))
    unit = fitted(spreads[0].unit, max(abs(each.mean.value) for each in spreads))

    def line(number: int) -> list[float]:
        return [each.percentiles[number].value / unit.size for each in spreads]

    words = f"{percents[0]:g} to {percents[-1]:g} %"
    axes.fill_between(times / clock.size, line(0), line(-1), color=SAMPLED, alpha=0.25, linewidth=0.0, label=words)
    axes.plot(times / clock.size, [each.mean.value / unit.size for each in spreads], color=SAMPLED, label="mean")
    linear = [each.linear_mean / unit.size for each in spreads]
    axes.plot(times / clock.size, linear, color=LINEAR, linestyle=(0, (4, 2)), linewidth=1.1, label="at the means")
    axes.set_xlabel(f"time [{clock.label}]")
    axes.set_ylabel(f"{spreads[0].quantity} [{unit.label or '1'}]")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, frameon=False, borderaxespad=0.2)
    return figure


@drawn
def plot_counts(shares: Sequence[Share]) -> Figure:
    """Return a figure of the probability of each number of periods of contact."""
    shown = sorted(least_certain(shares)[:MAX_BARS], key=lambda each: each[:2])
    names = [f"{each.contact}: {each.number}" for each in shown]
    left = 0.4 + 0.078 * max(map(len, names))
    figure, [[axes]] = grid(1, 1, 0.3 * len(shown) + 0.3, Margins(left=left, right=0.75, top=0.2, bottom=0.55))
    for place, each in enumerate(shown):
        _bar(axes, each.probability, place, 0.62, SAMPLED)
        axes.annotate(f"{each.probability.value:.4g}", (each.probability.upper, place), (6, 0), va="center",
                      textcoords="offset points", fontsize=8, annotation_clip=False)  # fmt: skip
    axes.set_yticks(range(len(shown)), names)
    axes.set_ylim(len(shown) - 0.4, -0.6)
    axes.set_xlim(0.0, 1.0)
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("probability of so many periods of contact")
    return figure


@drawn
def plot_indices(found: Sequence[Index]) -> Figure:
    """Return a figure of Sobol indices with intervals; diamonds are linear estimates."""
    names = list(dict.fromkeys((each.quantity, each.label) for each in found))[:MAX_PANELS]
    paths = list(dict.fromkeys(each.parameter for each in found))
    left = 0.3 + 0.078 * max(map(len, paths))
    margins = Margins(left=left, right=0.2, top=0.65, bottom=0.5, across=0.35, down=0.65)
    columns = min(2, len(names))
    figure, flat = panel_grid(len(names), columns, 0.42 * len(paths) + 0.25, margins)
    for number, (axes, name) in enumerate(zip(flat, names, strict=True)):
        own = [each for each in found if (each.quantity, each.label) == name]
        for place, each in enumerate(own):
            _bar(axes, each.first, place - 0.17, 0.3, PALETTE[0], "first")
            _bar(axes, each.total, place + 0.17, 0.3, PALETTE[2], "total")
            axes.plot(
                each.linear,
                place,
                "D",
                color=LINEAR,
                markersize=4.5,
                label="linear estimate",
                linestyle="none",
                clip_on=False,
            )
        axes.set_title(" ".join(name), color=MUTED, loc="left")
        axes.set_yticks(range(len(paths)), paths if number % columns == 0 else [""] * len(paths))
        axes.set_ylim(len(paths) - 0.4, -0.6)
        axes.set_xlim(0.0, min(1.5, max(1.05, *(1.02 * each.total.upper for each in own))))
        axes.grid(visible=False, axis="y")
        axes.set_xlabel("Sobol index" if number + columns >= len(names) else "")
    handles: dict[str, Any] = dict(zip(*reversed(flat[0].get_legend_handles_labels()), strict=True))
    figure.legend(handles.values(), handles.keys(), loc="upper right", ncols=3, frameon=False, borderaxespad=0.3)
    return figure


def _bar(axes: Axes, of: Estimate, at: float, height: float, colour: str, label: str = "") -> None:
    axes.barh(at, max(0.0, of.value), height, color=colour, alpha=0.75, label=label)
    _whisker(axes, of, 1.0, at)
