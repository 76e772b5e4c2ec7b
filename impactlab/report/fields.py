"""Figures of fields along rods and beams: snapshots, and the waves in the plane of place and time."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from impactlab.history.base import AbstractHistory, Field
from impactlab.metrics.norms import midpoints
from impactlab.report.style import GRID, INK, MUTED, Margins, Trace, clock, drawn, exact_of, grid, scaled, time_axis
from impactlab.scene.bodies import ElasticBody, Rod
from impactlab.scene.problem import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UNITS = {"displacement": "m", "velocity": "m/s", "strain": "", "stress": "Pa", "force": "N", "rotation": "rad"}
UNITS |= {"bending_moment": "N m", "shear_force": "N", "twist": "rad", "twist_rate": "rad/s", "torque": "N m"}
INSTANTS, PLACES = 720, 121  # of the image of the waves
LETTERS = {"displacement": "u", "velocity": "v", "strain": "ε", "stress": "σ", "force": "N", "rotation": "θ"}
LETTERS |= {"bending_moment": "M", "shear_force": "V", "twist": "θ", "twist_rate": "θ'", "torque": "T"}
LOADS = {"rod": "stress", "shaft": "torque"}  # of other bodies the bending moment


def rods(scene: Scene) -> dict[str, Rod]:
    """Return the rods of a scene by name."""
    return {name: body for name, body in scene.bodies.items() if isinstance(body, Rod)}


def load_of(body: ElasticBody) -> str:
    """Return the quantity that shows the load of a body: stress, torque or bending moment."""
    return LOADS.get(body.kind, "bending_moment")


@drawn
def snapshots(traces: Sequence[Trace], scene: Scene, body: str) -> Figure:
    """Return the load along a body at the times of ``scene.snapshots``: a row per trace, a column per time."""
    shown = scene.elastic[body]
    length, time, quantity = shown.length, clock(scene), load_of(shown)
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
            axis.plot(field.x / length, field.values / unit.size, color=trace.colour, linewidth=1.8)
            if trace.reference is not None and trace.reference.dt is None:  # a converged one has no fields
                exact = field_of(trace.reference, t)
                axis.plot(exact.x / length, exact.values / unit.size, color=INK, linewidth=0.9)
            axis.set_xlim(0.0, 1.0)
            axis.set_ylim((low - 0.25 * span) / unit.size, (high + 0.3 * span) / unit.size)
        row[0].set_title(trace.name, color=trace.colour)
        row[0].set_ylabel(f"{LETTERS[quantity]}  [{unit.label}]".replace("  []", ""))
    for axis, t in zip(axes[0], scene.snapshots, strict=True):
        axis.set_title(f"t = {t / time.size:.3g} {time.label}", loc="right", fontweight="normal", color=MUTED)
    for axis in axes[-1]:
        axis.set_xlabel("place  x / L")
    return figure


@drawn
def waves(exact: AbstractHistory, scene: Scene, body: str, quantity: str = "stress") -> Figure:
    """Return a quantity over the whole rod and the whole run as an image: time to the right, place upwards.

    For an exact history, which answers at any place.
    """
    time, length = clock(scene), rods(scene)[body].length
    t, x = midpoints(scene.duration, INSTANTS), np.linspace(0.0, length, PLACES)
    image = np.stack([exact.evaluate(t, f"{quantity}:{body}@{place:.6g}") for place in x])
    unit = scaled(UNITS[quantity], float(np.max(np.abs(image))))
    limit = float(np.max(np.abs(image))) / unit.size or 1.0
    figure, ((axis,),) = grid(1, 1, 2.1, Margins(top=0.1, right=1.0))
    shown = axis.imshow(
        image / unit.size,
        origin="lower",
        aspect="auto",
        extent=(0.0, scene.duration / time.size, 0.0, 1.0),
        cmap="RdBu_r",
        vmin=-limit,
        vmax=limit,
    )
    axis.grid(visible=False)
    bar = figure.colorbar(shown, cax=axis.inset_axes((1.02, 0.0, 0.014, 1.0)))
    bar.set_label(f"{quantity}  {LETTERS[quantity]}  [{unit.label}]".replace("  []", ""))
    axis.set_ylabel("place  x / L")
    time_axis(axis, scene)
    return figure
