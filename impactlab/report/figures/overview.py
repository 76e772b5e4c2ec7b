"""Figures of methods side by side: contact periods, and errors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from impactlab.printing import counted
from impactlab.report.figures.named_contacts import with_figures
from impactlab.report.figures.signals import in_words, named
from impactlab.report.figures.style import (
    GRID,
    INK,
    MUTED,
    Margins,
    Trace,
    across,
    clock,
    drawn,
    exact_of,
    grid,
    is_narrow,
    log_axis,
    lower_margin,
    room_for,
    time_axis,
)
from impactlab.scene.problem import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ERRORS = {
    "mass_displacement": ("mass displacement", "%"),
    "face_displacement": ("face displacement", "%"),
    "impulse": ("impulse", "%"),
    "force_away_from_jumps": ("force off jumps", "%"),
    "force_graph": ("force graph", "% of peak, T"),
    "event_times": ("event times", "% of T"),
}
"""The errors drawn, with their titles and units; all are shares, shown in %."""
EXACT = 1e-7  # %, smaller values are rounding
FLOOR = 1e-4  # %, smaller values do not widen the scale


@drawn
def contacts(traces: Sequence[Trace], scene: Scene) -> Figure:
    """Return a figure of the contact periods of each method.

    It has a bar per period of contact, a tick per kick, a row per method. Links have no periods; of many contacts those
    are drawn that have figures of their own.
    """
    known = [contact for contact in with_figures([trace.history for trace in traces]) if not contact.linked]
    reference = exact_of(traces)
    rows = ([Trace(named(reference), reference, INK)] if reference else []) + list(traces)
    left = room_for(trace.name for trace in rows)
    right, top = 0.7 if is_narrow() else 0.95, 0.32 if len(known) > 1 else 0.1
    margins = Margins(left, right, top, lower_margin(trips=True))
    figure, axes = grid(len(known), 1, 0.27 * len(rows), margins)
    for (axis,), contact in zip(axes, known, strict=True):
        for row, trace in enumerate(rows):
            _spans(axis, trace, scene, contact.members, row)
        if reference is not None:
            time = clock(scene)
            for event in reference.events:
                if event.contact in contact.members:
                    axis.axvline(event.time / time.size, color=INK, linewidth=0.7, linestyle=(0, (1, 2)), zorder=0.8)
        axis.set_ylim(len(rows) - 0.4, -0.6)
        axis.set_yticks(range(len(rows)), [trace.name for trace in rows])
        for label, trace in zip(axis.get_yticklabels(), rows, strict=True):
            label.set_color(trace.colour)
            label.set_fontweight("bold" if trace.colour == INK else "normal")
        axis.grid(visible=False, axis="y")
        axis.tick_params(axis="y", length=0)
        axis.spines["left"].set_visible(False)
        if len(known) > 1:
            axis.set_title(in_words(contact.name))
        time_axis(axis, scene, trips=contact is known[-1])
    return figure


def _spans(axis: Axes, trace: Trace, scene: Scene, contacts: Sequence[str], row: int) -> None:
    """Draw one row of `contacts` and write how many contacts it holds at its end."""
    time = clock(scene)
    spans = trace.history.spans_of(contacts)
    kicks = [
        event.time / time.size
        for event in trace.history.events
        if event.contact in contacts and event.kind == "impulse"
    ]
    bars = [
        (span.start / time.size, (span.until(scene.duration) - span.start) / time.size)
        for span in spans
        if span.kicks is None
    ]
    axis.broken_barh(bars, (row - 0.31, 0.62), facecolors=trace.colour, linewidth=0)
    for start, length in bars:  # a bar thinner than a hair is still seen
        axis.plot([start, start + length], [row, row], color=trace.colour, linewidth=1.2, solid_capstyle="butt")
    impulsive = any(span.kicks is not None for span in spans) or not bars
    if kicks and impulsive:
        axis.vlines(kicks, row - 0.31, row + 0.31, color=trace.colour, linewidth=0.7)
    text = counted(len(kicks), "kick") if kicks and impulsive else counted(len(bars), "contact")
    axis.text(1.015, row, text, transform=axis.get_yaxis_transform(), va="center", fontsize=8, color=MUTED)


@drawn
def errors(rows: Sequence[Mapping[str, Any]], colours: Mapping[str, str]) -> Figure:
    """Return the errors of every method as a figure [%].

    It has one panel per norm that exists, with a logarithmic axis. Dots, not bars: on a logarithmic axis the length of
    a bar has no meaning. Panels share one scale.

    Parameters
    ----------
    rows : sequence of mapping
        The rows of a comparison: name and summary; failed ones are left out.
    colours : mapping
        Name of a method to its colour.
    """
    compared = [row for row in rows if row["summary"].get("errors")]
    shares = {name: [row["summary"]["errors"].get(name) for row in compared] for name in ERRORS}
    values = {name: [None if share is None else 100.0 * share for share in own] for name, own in shares.items()}
    values = {name: column for name, column in values.items() if any(v is not None for v in column)}
    known = [v for column in values.values() for v in column if v is not None and v > FLOOR]
    low = 10.0 ** math.floor(math.log10(min(known, default=1e-2)))
    high = 10.0 ** (math.ceil(math.log10(max(known, default=1.0))) + 0.75)
    columns = across(3)
    rows_of_panels = max(1, math.ceil(len(values) / columns))
    margins = Margins(left=room_for(row["name"] for row in compared), across=0.2, down=0.45)
    figure, panels = grid(rows_of_panels, columns, 0.25 * len(compared), margins, share=True)
    flat = [axis for row in panels for axis in row]
    for axis, (name, column) in zip(flat, values.items(), strict=False):
        _dots(axis, column, [colours[row["name"]] for row in compared], low, high)
        axis.set_title(ERRORS[name][0])
        axis.set_title(f"[{ERRORS[name][1]}]", loc="right", fontsize=8, fontweight="normal", color=MUTED)
    for axis in flat[len(values) :]:
        axis.set_visible(False)
    for axis in flat[max(0, len(values) - columns) : len(values)]:
        axis.tick_params(labelbottom=True)
    for row_of_panels in panels:
        row_of_panels[0].set_yticks(range(len(compared)), [row["name"] for row in compared])
        for label, row in zip(row_of_panels[0].get_yticklabels(), compared, strict=True):
            label.set_color(colours[row["name"]])
    return figure


def _dots(axis: Axes, values: Sequence[float | None], colours: Sequence[str], low: float, high: float) -> None:
    """Draw one panel of `errors`: a dot per method, the best in bold."""
    axis.set_xscale("log")
    axis.set_xlim(low / 1.6, high)
    axis.set_ylim(len(values) - 0.4, -0.6)
    log_axis(axis.xaxis)
    axis.grid(visible=False, axis="y")
    axis.tick_params(axis="y", length=0)
    axis.spines["left"].set_visible(False)
    best = min((v for v in values if v is not None and v >= low), default=None)  # an exact solution does not compete
    known = [(row, max(value, low), value) for row, value in enumerate(values) if value is not None]
    shades = [colours[row] for row, _, _ in known]
    rows, ends = [row for row, _, _ in known], [at for _, at, _ in known]
    axis.hlines(range(len(values)), low / 1.6, high, color=GRID, linewidth=0.6, zorder=0.5)
    axis.hlines(rows, low / 1.6, ends, colors=shades, linewidth=1.1, alpha=0.5)
    inside = [colour if value >= low else "none" for colour, (_, _, value) in zip(shades, known, strict=True)]
    axis.scatter(ends, rows, s=25, facecolors=inside, edgecolors=shades, linewidths=1.0, zorder=2)
    for row, value in enumerate(values):
        if value is None:
            axis.text(low, row, "–", va="center", fontsize=8, color=MUTED)
            continue
        text = f"{float(f'{value:.2g}'):g}" if value >= low else "0" if value < EXACT else f"< {low:g}"
        axis.annotate(
            text,
            (max(value, low), row),
            xytext=(6, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
            fontweight="bold" if value == best else "normal",
        )
