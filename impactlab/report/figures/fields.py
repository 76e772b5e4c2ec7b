"""Figures of fields along rods and beams at the snapshots of a case."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from impactlab.history.base import AbstractHistory, Field
from impactlab.prefixes import scaled
from impactlab.report.figures.signals import UNITS
from impactlab.report.figures.style import INK, MUTED, Margins, Trace, clock, drawn, exact_of, grid, is_narrow
from impactlab.scene.bodies import ElasticBody
from impactlab.scene.problem import Scene
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_POINTS = 120  # of a curve along a body
LETTERS = {"stress": "σ", "bending_moment": "M", "torque": "T"}
LOADS = {"rod": "stress", "shaft": "torque"}  # of other bodies the bending moment


def load_of(body: ElasticBody) -> str:
    """Return the quantity that shows the load of a body: stress, torque or bending moment."""
    return LOADS.get(body.kind, "bending_moment")


@drawn
def snapshots(traces: Sequence[Trace], scene: Scene, body: str) -> Figure:
    """Return the load along a body at the snapshots as a figure.

    It has a row per trace, and a column per time of ``scene.snapshots``.
    """
    shown = scene.elastic[body]
    place, time, quantity = scaled("m", shown.length), clock(scene), load_of(shown)
    rows, columns = len(traces), len(scene.snapshots)
    # The rows of a column stand above each other in one axes: that draws in a third of the time of one for each.
    figure, (axes,) = grid(1, columns, 2.0 if rows == 1 else 0.85 * rows, Margins(across=0.22), share=True)

    @cache  # traces share their reference, and an exact field takes its time
    def field_of(history: AbstractHistory, t: float) -> Field:
        return history.field(body, t, quantity)

    exact_one = exact_of(traces)
    reference = exact_one if exact_one is not None and exact_one.dt is None else traces[0].history
    frame = [field_of(reference, t).values for t in scene.snapshots]
    low, high = min(float(v.min()) for v in frame), max(float(v.max()) for v in frame)
    unit, span = scaled(UNITS[quantity], max(abs(low), abs(high))), (high - low) or 1.0
    bottom, top = (low - 0.25 * span) / unit.size, (high + (0.3 if rows == 1 else 0.6) * span) / unit.size
    bases = [(rows - 1 - row) * (top - bottom) for row in range(rows)]  # where the zero of each row stands
    for axis, t in zip(axes, scene.snapshots, strict=True):
        for base, trace in zip(bases, traces, strict=True):
            axis.axhline(base, color=MUTED, linewidth=0.5, zorder=0.5)
            lines = [(trace.history, trace.colour, 1.8)]
            if trace.reference is not None and trace.reference.dt is None:  # a converged one has no fields
                lines.append((trace.reference, INK, 0.9))
            for history, colour, width in lines:
                x, values = few(field_of(history, t).x / place.size, field_of(history, t).values / unit.size)
                axis.plot(x, np.clip(values, bottom, top) + base, color=colour, linewidth=width)
        axis.set_xlim(0.0, shown.length / place.size)
        words = f"t = {t / time.size:.3g} {time.label}"
        if is_narrow():
            axis.text(0.97, 1.0, words, transform=axis.transAxes, ha="right", va="bottom", fontsize=6.0, color=MUTED)
        else:
            axis.set_title(words, loc="right", fontweight="normal", color=MUTED)
    axes[0].set_ylim(bottom, bases[0] + top)
    axes[0].set_ylabel(f"{LETTERS[quantity]}  [{unit.label}]")
    if rows == 1:
        axes[0].set_title(traces[0].name, color=traces[0].colour)
    else:
        _row_scales(axes[0], traces, bases, (low / unit.size, high / unit.size), top)
    for axis in axes[columns // 2 : columns // 2 + 1] if is_narrow() else axes:
        axis.set_xlabel(f"place  x  [{place.label}]")
    return figure


def _row_scales(
    axis: Axes, traces: Sequence[Trace], bases: Sequence[float], extent: tuple[float, float], top: float
) -> None:
    """Label zero and a round value of each row at the left; name the rows."""
    largest = max(extent, key=abs) or 1.0
    leading = 10.0 ** math.floor(math.log10(abs(largest)))
    tick = math.copysign(max(n for n in (1, 2, 4, 5, 6, 8) if n * leading <= abs(largest) * 1.0001) * leading, largest)
    marks = [base + value for base in bases for value in (0.0, tick)]
    axis.set_yticks(marks, [f"{value:g}" for _ in bases for value in (0.0, tick)])
    for base, trace in zip(bases, traces, strict=True):
        place = axis.get_yaxis_transform()
        axis.text(0.01, base + top, trace.name, transform=place, va="top", fontweight="bold", color=trace.colour)


def few(x: Array, values: Array) -> tuple[Array, Array]:
    """Return a curve along a body at `MAX_POINTS` places at most, both ends included."""
    kept = np.unique(np.linspace(0, x.size - 1, min(x.size, MAX_POINTS)).round().astype(int))
    return x[kept], values[kept]
