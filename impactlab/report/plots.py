"""Figures over time of one contact or of a whole run: force, displacements, gap.

Every function takes traces (histories with name, colour and reference) and returns a figure. The exact answer is dark.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from impactlab.metrics.norms import face_channels, mass_channels, midpoints
from impactlab.report.style import (
    INK,
    MUTED,
    NAMES,
    PAPER,
    Margins,
    Trace,
    Unit,
    clock,
    curve,
    drawn,
    exact_of,
    grid,
    key,
    label_lines,
    log_axis,
    scaled,
    time_axis,
)
from impactlab.scene.problem import Scene
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CROWDED = 33  # letters of a name and its note that fit above a panel of three
HEADROOM = 1.3  # of the axis of forces over the exact peak; higher values are cut, and their height is written
KICK_WINDOW = 0.05  # T over which the kicks of an impulse law are averaged to a force
STILL = 0.01  # share of the widest gap below which the exact gap is no scale: faces that stay together
FLOOR = 1e-4  # %, differences below it are drawn there


@drawn
def force(traces: Sequence[Trace], scene: Scene, contact: str, notes: Mapping[str, str] | None = None) -> Figure:
    """Return the force of one contact over time, one panel per trace on common axes.

    Parameters
    ----------
    contact : str
        Name of the contact, ``hammer|rod.left``.
    notes : mapping, optional
        Name of a trace to a few words written at the right above its panel.
    """
    channel, time = f"force:{contact}", clock(scene)
    columns = 1 if len(traces) == 1 else 2 if len(traces) <= 4 else 3
    rows = -(-len(traces) // columns)
    margins = Margins(across=0.28, down=0.42)
    figure, axes = grid(rows, columns, {1: 2.6, 2: 1.8, 3: 1.5}[columns], margins, share=True)
    lines = [curve(trace.history, channel, scene.duration) for trace in traces]
    exact = [curve(t.reference, channel, scene.duration) if t.reference else (np.empty(0),) * 2 for t in traces]
    tallest = max((float(v.max()) for _, v in exact if v.size), default=0.0) or max(
        (float(v.max()) for _, v in lines if v.size), default=1.0
    )
    unit = scaled("N", tallest)
    top = (tallest or 1.0) * HEADROOM / unit.size
    panels = [axis for row in axes for axis in row]
    for axis, trace, (t, values), (t_exact, values_exact) in zip(panels, traces, lines, exact, strict=False):
        note = (notes or {}).get(trace.name, "")
        if t.size:
            axis.plot(t / time.size, values / unit.size, color=trace.colour, linewidth=2.0)
            _write_height_of_cut(axis, float(values.max()) / unit.size, top, unit)
        else:
            note = _kicks(axis, trace, scene, contact, unit)
        axis.plot(t_exact / time.size, values_exact / unit.size, color=INK, linewidth=0.9)
        axis.set_title(trace.name, color=trace.colour)
        if columns < 3 or len(trace.name) + len(note) < CROWDED:
            axis.set_title(note, loc="right", fontsize=7.5, fontweight="normal", color=MUTED)
        else:
            axis.text(0.985, 0.8, note, fontsize=7.5, color=MUTED, transform=axis.transAxes, ha="right", va="top")
        axis.set_ylim(-0.04 * top, top)
    for axis in panels[len(traces) :]:
        axis.set_visible(False)
    for axis in panels[max(0, len(traces) - columns) : len(traces)]:
        time_axis(axis, scene)
        axis.tick_params(labelbottom=True)
    for row in axes:
        row[0].set_ylabel(f"force  F  [{unit.label}]")
    return figure


def _write_height_of_cut(axis: Axes, highest: float, top: float, unit: Unit) -> None:
    """Write how high the highest spike reaches where the axis cuts it."""
    if highest > top:
        behind = {"facecolor": PAPER, "edgecolor": "none", "pad": 2.0}
        text = f"spikes up to {highest:.3g} {unit.label}"
        axis.text(0.985, 0.97, text, fontsize=7.5, bbox=behind, transform=axis.transAxes, ha="right", va="top")


def _kicks(axis: Axes, trace: Trace, scene: Scene, contact: str, unit: Unit) -> str:
    """Draw the kicks of an impulse law as their mean force over short windows, and say so: it has no force."""
    kicks = [(e.time, e.impulse or 0.0) for e in trace.history.events if (e.contact, e.kind) == (contact, "impulse")]
    time = clock(scene)
    window = KICK_WINDOW * time.size if time.label == "T" else scene.duration / 60.0
    edges = np.arange(0.0, scene.duration + window, window)
    total, _ = np.histogram([t for t, _ in kicks], edges, weights=[j for _, j in kicks])
    axis.stairs(total / window / unit.size, edges / time.size, fill=True, color=trace.colour, alpha=0.5, linewidth=0)
    return f"mean of {len(kicks)} kicks"


@drawn
def displacement(traces: Sequence[Trace], scene: Scene) -> Figure:
    """Return the displacements of masses and faces in contact, and below how far each trace has strayed so far.

    The lower row, drawn where there is a reference, shows the largest difference from it up to each instant, in % of
    its largest displacement: a curve that only rises, so that methods stay apart.
    """
    channels = mass_channels(scene) + face_channels(scene)
    judged = [trace for trace in traces if trace.reference is not None]
    margins = Margins(right=NAMES) if len(traces) > 1 else Margins()
    figure, axes = grid(2 if judged else 1, len(channels), 2.2, margins)
    t, time = midpoints(scene.duration, 1200), clock(scene)
    for column, channel in enumerate(channels):
        axis, reference = axes[0][column], exact_of(traces)
        lines = [trace.history.evaluate(t, channel) for trace in traces]
        frame = lines if reference is None else [reference.evaluate(t, channel)]
        low, high = min(float(v.min()) for v in frame), max(float(v.max()) for v in frame)
        unit = scaled("m", max(abs(low), abs(high)))
        for trace, values in zip(traces, lines, strict=True):
            axis.plot(t / time.size, values / unit.size, color=trace.colour, linestyle=trace.dash)
        if reference is not None:
            axis.plot(t / time.size, frame[0] / unit.size, color=INK, linewidth=1.0)
        margin = 0.12 * ((high - low) or 1.0)
        axis.set_ylim((low - margin) / unit.size, (high + margin) / unit.size)
        axis.set_title(_channel_title(channel))
        axis.set_ylabel(f"displacement  u  [{unit.label}]")
        time_axis(axis, scene)
    if judged:
        _strayed(axes[1], channels, judged, t, scene)
    elif len(traces) > 1:
        last = axes[0][-1]
        label_lines(
            last, [(v[-1] / unit.size, trace.name, trace.colour) for trace, v in zip(traces, lines, strict=True)]
        )
    return figure


def _strayed(axes: Sequence[Axes], channels: Sequence[str], judged: Sequence[Trace], t: Array, scene: Scene) -> None:
    """Draw the largest difference so far [% of the largest exact value], one axes per channel, on one log scale."""
    ends: list[tuple[float, str, str]] = []
    highest = 1.0
    for axis, channel in zip(axes, channels, strict=True):
        ends = []
        for trace in judged:
            assert trace.reference is not None  # noqa: S101 - only such traces come here
            exact = trace.reference.evaluate(t, channel)
            largest = float(np.max(np.abs(exact))) or 1.0
            share = np.maximum.accumulate(np.abs(trace.history.evaluate(t, channel) - exact)) / largest * 100.0
            share = np.maximum(share, FLOOR)
            axis.plot(t / clock(scene).size, share, color=trace.colour, linestyle=trace.dash)
            ends.append((float(share[-1]), trace.name, trace.colour))
            highest = max(highest, float(share[-1]))
        axis.set_yscale("log")
        log_axis(axis.yaxis)
        time_axis(axis, scene)
    for axis in axes:
        axis.set_ylim(FLOOR / 1.5, 2.0 * highest)
    axes[0].set_ylabel("largest difference so far  [%]")
    if len(ends) > 1:
        label_lines(axes[-1], ends)


def _channel_title(channel: str) -> str:
    quantity, place = channel.split(":")
    return place if quantity == "position" else f"face of {place.replace('@', ' at x = ')} m"


@drawn
def gap(traces: Sequence[Trace], scene: Scene, contact: str) -> Figure:
    """Return the gap of one contact over time, and beside it the same drawn large near zero.

    The closer view shows penetration in contact, and touches that are nearly missed.
    """
    channel, time, reference = f"gap:{contact}", clock(scene), exact_of(traces)
    lines = [curve(trace.history, channel, scene.duration) for trace in traces]
    exact = curve(reference, channel, scene.duration) if reference else lines[0]
    low, high = float(exact[1].min()), float(exact[1].max())
    widest = (min(float(v.min()) for _, v in lines), max(float(v.max()) for _, v in lines))
    if high - low < STILL * (widest[1] - widest[0]):
        low, high = widest
    span = (high - low) or 1.0
    figure, axes = grid(1, 2, 2.4, Margins(right=NAMES) if len(traces) > 1 else Margins())
    views = (("gap", low - 0.08 * span, high + 0.08 * span), ("gap near zero", -0.025 * span, 0.08 * span))
    for axis, (title, bottom, top) in zip(axes[0], views, strict=True):
        unit = scaled("m", max(abs(bottom), abs(top)))
        axis.axhline(0.0, color=MUTED, linewidth=0.8)
        for trace, (t, values) in zip(traces, lines, strict=True):
            axis.plot(t / time.size, values / unit.size, color=trace.colour, linestyle=trace.dash, linewidth=1.3)
        if reference is not None:
            axis.plot(exact[0] / time.size, exact[1] / unit.size, color=INK, linewidth=1.0)
        axis.set_ylim(bottom / unit.size, top / unit.size)
        axis.set_title(title)
        axis.set_ylabel(f"gap  g  [{unit.label}]")
        time_axis(axis, scene)
    if len(traces) > 1:
        key(axes[0][-1], traces)
    return figure
