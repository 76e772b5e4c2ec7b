"""Figures of fields along rods and beams at the snapshots of a case."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from impactlab.history.base import AbstractHistory, Field
from impactlab.report.style import GRID, INK, MUTED, Margins, Trace, clock, drawn, exact_of, grid, is_narrow, scaled
from impactlab.scene.bodies import ElasticBody
from impactlab.scene.problem import Scene
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_POINTS = 120  # of a curve along a body
UNITS = {"stress": "Pa", "bending_moment": "N·m", "torque": "N·m"}
LETTERS = {"stress": "σ", "bending_moment": "M", "torque": "T"}
LOADS = {"rod": "stress", "shaft": "torque"}  # of other bodies the bending moment


def load_of(body: ElasticBody) -> str:
    """Return the quantity that shows the load of a body: stress, torque or bending moment."""
    return LOADS.get(body.kind, "bending_moment")


@drawn
def snapshots(traces: Sequence[Trace], scene: Scene, body: str) -> Figure:
    """Return the load along a body at the times of ``scene.snapshots``: a row per trace, a column per time."""
    shown = scene.elastic[body]
    place, time, quantity = scaled("m", shown.length), clock(scene), load_of(shown)
    rows, columns = len(traces), len(scene.snapshots)
    margins = Margins(across=0.22, down=0.34)
    figure, axes = grid(rows, columns, 2.0 if rows == 1 else 0.85, margins, share=True)

    @cache  # traces share their reference, and an exact field takes its time
    def field_of(history: AbstractHistory, t: float) -> Field:
        return history.field(body, t, quantity)

    exact_one = exact_of(traces)
    reference = exact_one if exact_one is not None and exact_one.dt is None else traces[0].history
    frame = [field_of(reference, t).values for t in scene.snapshots]
    low, high = min(float(v.min()) for v in frame), max(float(v.max()) for v in frame)
    unit, span = scaled(UNITS[quantity], max(abs(low), abs(high))), (high - low) or 1.0
    for row, trace in zip(axes, traces, strict=True):
        for axis, t in zip(row, scene.snapshots, strict=True):
            field = field_of(trace.history, t)
            axis.axhline(0.0, color=GRID, linewidth=0.9, zorder=0.5)
            axis.plot(*few(field.x / place.size, field.values / unit.size), color=trace.colour, linewidth=1.8)
            if trace.reference is not None and trace.reference.dt is None:  # a converged one has no fields
                exact = field_of(trace.reference, t)
                axis.plot(*few(exact.x / place.size, exact.values / unit.size), color=INK, linewidth=0.9)
            axis.set_xlim(0.0, shown.length / place.size)
            axis.set_ylim((low - 0.25 * span) / unit.size, (high + 0.3 * span) / unit.size)
        row[0].set_title(trace.name, color=trace.colour)
        row[0].set_ylabel(f"{LETTERS[quantity]}  [{unit.label}]")
    for axis, t in zip(axes[0], scene.snapshots, strict=True):
        words = f"t = {t / time.size:.3g} {time.label}"
        if is_narrow():
            axis.text(0.97, 0.97, words, transform=axis.transAxes, ha="right", va="top", fontsize=6.0, color=MUTED)
        else:
            axis.set_title(words, loc="right", fontweight="normal", color=MUTED)
    for axis in axes[-1][columns // 2 : columns // 2 + 1] if is_narrow() else axes[-1]:
        axis.set_xlabel(f"place  x  [{place.label}]")
    return figure


def few(x: Array, values: Array) -> tuple[Array, Array]:
    """Return a curve along a body at no more than `MAX_POINTS` places, first and last included."""
    kept = np.unique(np.linspace(0, x.size - 1, min(x.size, MAX_POINTS)).round().astype(int))
    return x[kept], values[kept]
