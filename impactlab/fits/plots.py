"""Figures of a fit: its signals with their residuals, autocorrelations, profiles and correlations."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from scipy.interpolate import PchipInterpolator

from impactlab.errors import CaseError
from impactlab.fits.bootstrap import autocorrelations
from impactlab.fits.identifiable import short_names
from impactlab.fits.result import JACOBIAN, PROFILE, WIDENED, Curve, Fit, Shown
from impactlab.history.units import UNITS
from impactlab.prefixes import Unit, scaled
from impactlab.printing import counted
from impactlab.report.figures.style import (
    GRID,
    INK,
    MUTED,
    PALETTE,
    PAPER,
    Margins,
    across,
    drawn,
    grid,
    log_axis,
    panel_grid,
)
from impactlab.sweeps.plot_axes import fitted as prefixed
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURED, FITTED = MUTED, PALETTE[0]
NOISE = 2.0  # standard deviations that a band of residuals shows
BETWEEN = 0.18  # inches, a signal and its residuals
DECADE, MANY_DECADES = 10.0, 100.0  # of values: their axis is logarithmic, and shows decades alone
MIN_CORRELATED = 2  # numbers
MAX_DOTS = 3000  # of a signal that are drawn one by one; more of them as a picture
MAX_LAGS = 40
HEADROOM = 2.0  # of a profile over the rise at the ends of its interval
ENDS = PALETTE[1]
MAX_NUMBERS = 12  # parameters of a matrix whose cells have numbers
DARK, LIGHT, DARK_CELL = "#10151c", "#fbfcfd", 0.55  # numbers in cells, and the correlation from which they are light


def plot(fit: Fit, name: str = "signals") -> Figure:
    """Return a figure of a fit by its name: signals, autocorrelation, profiles or correlations.

    Raises
    ------
    CaseError
        If there is no such figure of it.
    """
    if name not in FIGURES:
        raise CaseError(f"a fit has no figure {name!r}", remedy=f"Allowed: {', '.join(FIGURES)}.")
    if name == "correlations" and len(determined(fit)) < MIN_CORRELATED:
        found = counted(len(determined(fit)), "number")
        text = f"the signals determine {found}, and correlations are between two or more"
        raise CaseError(text, remedy="Fit more numbers, or measure more channels.")
    if name == "profiles" and not fit.profiles:
        raise CaseError("this fit has no profiles to draw", remedy='Fit with intervals="profile".')
    return FIGURES[name](fit)


def determined(fit: Fit) -> list[int]:
    """Return which parameters the signals determine."""
    return [number for number, each in enumerate(fit.parameters) if "not determined" not in each.note]


def name_of(fit: Fit, path: str) -> str:
    """Return the last words of a path that distinguish it from other parameters.

    A contact with a name goes by it: ``shaft.capacity``.
    """
    paths = named = [each.path for each in fit.parameters]
    for number, block in enumerate(fit.case.checked.contacts):
        if block.name:
            named = [each.replace(f"contacts.{number}.law.", f"{block.name}.") for each in named]
    return short_names(named)[paths.index(path)]


def unit_of(unit: str, value: float) -> Unit:
    """Return the unit with the prefix that suits a value."""
    return prefixed("" if unit == "1" else unit, abs(value))


@drawn
def plot_signals(fit: Fit) -> Figure:
    """Return a figure of measured and fitted signals, each above its scaled residuals.

    Residuals are over their standard deviation.
    """
    count = len(fit.signals)
    figure, panels = grid(2 * count, 1, 1.6, Margins(top=0.45))
    for number, (shown, residuals) in enumerate(zip(fit.signals, fit.residuals, strict=True)):
        upper, lower = panels[2 * number][0], panels[2 * number + 1][0]
        _taller(upper, lower)
        clock = scaled("s", float(np.max(np.abs(shown.time))))
        _signal(upper, shown, clock, has_legend=number == 0)
        times = np.linspace(shown.time[0], shown.time[-1], len(residuals)) / clock.size
        is_long = len(residuals) > MAX_DOTS
        lower.axhspan(-NOISE, NOISE, color=GRID, linewidth=0.0)
        kept = np.where(residuals == 0.0, np.nan, residuals) / (fit.noise or 1.0)  # without those left out
        lower.plot(times, kept, ".", color=FITTED, markersize=3.0, rasterized=is_long)
        lower.axhline(0.0, color=INK, linewidth=0.7)
        lower.set_ylabel("residual / noise")
        lower.set_xlim(upper.get_xlim())
        lower.set_xlabel(f"time  t  [{clock.label}]" if number == count - 1 else "")
    return figure


def _taller(upper: Axes, lower: Axes) -> None:
    """Give the signal two thirds of both panels' height, with the residuals close below."""
    top, bottom = upper.get_position(), lower.get_position()
    both, apart = top.y1 - bottom.y0, BETWEEN / cast("Figure", upper.get_figure()).get_figheight()
    small = 0.34 * (both - apart)
    lower.set_position((bottom.x0, bottom.y0, bottom.width, small))
    upper.set_position((top.x0, bottom.y0 + small + apart, top.width, both - small - apart))


def _signal(axes: Axes, shown: Shown, clock: Unit, *, has_legend: bool) -> None:
    quantity, _, place = shown.channel.partition(":")
    unit = unit_of("ε" if quantity == "strain" else UNITS.get(quantity, "1"), float(np.max(np.abs(shown.measured))))
    times = shown.time / clock.size
    is_long = len(times) > MAX_DOTS
    axes.plot(
        times, shown.measured / unit.size, ".", color=MEASURED, markersize=4.0, label="measured", rasterized=is_long
    )
    axes.plot(times, shown.fitted / unit.size, color=FITTED, label="fitted")
    axes.set_ylabel(f"{quantity}  [{unit.label}]" if unit.label else quantity)
    axes.set_title(place.replace("|", " | "), loc="right", color=MUTED, fontweight="normal")
    axes.tick_params(labelbottom=False)
    axes.margins(x=0.01)
    if has_legend:
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False, borderaxespad=0.2)


def _panels(count: int, height: float, margins: Margins) -> tuple[Figure, list[Axes]]:
    return panel_grid(count, min(count, across(2 if count == 4 else 3)), height, margins)


@drawn
def plot_autocorrelations(fit: Fit) -> Figure:
    """Return a figure of residuals' autocorrelations with the 95 % band of white noise."""
    figure, panels = _panels(len(fit.residuals), 1.7, Margins())
    for axes, shown, residuals in zip(panels, fit.signals, fit.residuals, strict=True):
        lags = min(MAX_LAGS, len(residuals) // 3)
        found, band = autocorrelations(residuals, lags), 1.96 / math.sqrt(len(residuals))
        axes.axhspan(-band, band, color=GRID, linewidth=0.0)
        axes.vlines(np.arange(lags + 1), 0.0, found, color=FITTED, linewidth=2.0)
        axes.axhline(0.0, color=INK, linewidth=0.7)
        axes.set_ylim(min(-0.3, 1.1 * float(found.min())), 1.05)
        axes.set_xlabel("lag  [samples]")
        axes.set_title(shown.channel.replace("|", " | "), color=MUTED, fontweight="normal")
    panels[0].set_ylabel("autocorrelation")
    return figure


@drawn
def plot_profiles(fit: Fit) -> Figure:
    """Return a figure of the parameters' profiles with the derivatives' parabola and 95 % intervals."""
    figure, panels = _panels(len(fit.profiles), 1.9, Margins(top=0.55, down=1.0))
    for number, (axes, curve) in enumerate(zip(panels, fit.profiles, strict=True)):
        _profile(axes, curve, fit)
        if number == 0:
            axes.legend(loc="lower left", bbox_to_anchor=(-0.02, 1.12), ncols=3, frameon=False, borderaxespad=0.0)
    panels[0].set_ylabel("rise of the loss / variance")
    return figure


def _profile(axes: Axes, curve: Curve, fit: Fit) -> None:
    from matplotlib.ticker import LogLocator

    parameter = fit[curve.path]
    top = HEADROOM * curve.limit
    scale = np.log if curve.is_logarithmic else np.asarray
    kept = np.unique(scale(curve.values), return_index=True)[1]
    values, rise = curve.values[kept], np.maximum(curve.rise[kept], 0.0)
    values, root = values[rise <= 4.0 * top], np.sqrt(rise[rise <= 4.0 * top])
    unit = unit_of(curve.unit, parameter.value if curve.is_logarithmic else float(np.max(np.abs(values))))
    root[: int(np.argmin(np.abs(values - parameter.value)))] *= -1.0
    is_wide = curve.is_logarithmic and values[-1] > DECADE * values[0]
    spaced = np.geomspace if is_wide else np.linspace
    places = spaced(values[0], values[-1], 300)
    line = PchipInterpolator(scale(values), root)(scale(places)) if len(values) > 2 else np.interp(places, values, root)
    axes.plot(places / unit.size, line**2, color=FITTED, label="profile")
    axes.plot(values / unit.size, root**2, "o", color=FITTED, markersize=3.5)
    lower, upper = parameter.intervals.get(WIDENED, parameter.intervals[JACOBIAN])
    if math.isfinite(upper):
        half = 0.5 * (scale(upper) - scale(lower))
        parabola = curve.limit * ((scale(places) - scale(parameter.value)) / half) ** 2
        axes.plot(places / unit.size, parabola, color=MUTED, linewidth=1.0, linestyle=(0, (4, 2)), label="parabola")
    axes.axhline(curve.limit, color=ENDS, linewidth=0.8, label="95 %")
    for end in parameter.intervals[PROFILE]:
        if values[0] <= end <= values[-1]:
            axes.plot([end / unit.size] * 2, [0.0, curve.limit], color=ENDS, linewidth=0.8)
    inside = scale(values[root**2 <= top] / unit.size)
    reach = 0.06 * (inside[-1] - inside[0])
    ends = inside[0] - reach, inside[-1] + reach
    axes.set_ylim(0.0, top)
    if is_wide:
        axes.set_xscale("log")
        log_axis(axes.xaxis)
        if values[-1] < MANY_DECADES * values[0]:
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    else:
        axes.locator_params(axis="x", nbins=5)
    axes.set_xlim(*(np.exp(ends) if curve.is_logarithmic else ends))
    name = name_of(fit, curve.path)
    axes.set_xlabel(f"{name}  [{unit.label}]" if unit.label else name)


@drawn
def plot_correlations(fit: Fit) -> Figure:
    """Return a figure of the correlation matrix of the determined parameters."""
    names = [name_of(fit, each.path).replace("|", " | ") for each in fit.parameters]
    rows = determined(fit)
    values: Array = fit.correlations[np.ix_(rows, rows)]
    shown, letters = [names[row] for row in rows], 0.075 * max(len(names[row]) for row in rows)
    side = min(0.75, 6.0 / len(rows)) * len(rows)
    whole = 8.6
    left = min(letters + 0.3, 3.2)
    margins = Margins(left=left, right=max(0.9, whole - left - 1.45 * side), top=0.1, bottom=0.2 + 0.72 * letters)
    figure, [[axes]] = grid(1, 1, side, margins)
    image = axes.pcolormesh(values[::-1], cmap="RdBu_r", vmin=-1.0, vmax=1.0, edgecolor=PAPER, linewidth=2.0)
    axes.grid(visible=False)
    places = np.arange(len(rows)) + 0.5
    axes.set_xticks(places, shown, rotation=35, ha="right", rotation_mode="anchor")
    axes.set_yticks(places, shown[::-1])
    axes.tick_params(length=0.0)
    for side_line in axes.spines.values():
        side_line.set_visible(False)
    if len(rows) <= MAX_NUMBERS:
        for (row, column), value in np.ndenumerate(values[::-1]):
            colour = LIGHT if abs(value) > DARK_CELL else DARK
            text = f"{value:.2f}".replace("-", "\N{MINUS SIGN}")
            axes.text(column + 0.5, row + 0.5, text, ha="center", va="center", color=colour, fontsize=8.5)
    bar: Any = figure.colorbar(image, ax=axes, fraction=0.05, pad=0.03, label="correlation")
    bar.set_ticks([-1.0, -0.5, 0.0, 0.5, 1.0])
    bar.outline.set_visible(False)
    return figure


FIGURES: dict[str, Callable[[Fit], Figure]] = {
    "signals": plot_signals,
    "autocorrelation": plot_autocorrelations,
    "profiles": plot_profiles,
    "correlations": plot_correlations,
}
