"""Figures over time of one contact or of a whole run: probes, force, displacements, gap.

Every function takes traces (histories with name, colour and reference) and returns a figure. The exact solution is
dark.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple, cast

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.history.sampling import page_times
from impactlab.prefixes import Unit, scaled
from impactlab.report.figures.named_contacts import force_of, gap_of, members_of, view_of
from impactlab.report.figures.signals import Line, Panel, in_words, with_short_peaks
from impactlab.report.figures.style import (
    INK,
    MARGINS,
    MAX_LABELS,
    MUTED,
    PALETTE,
    PAPER,
    UNNAMED,
    Margins,
    Trace,
    across,
    clock,
    drawn,
    exact_of,
    grid,
    key,
    label_lines,
    labelled,
    lower_margin,
    room_beside,
    thinned,
    time_axis,
    upper_margin,
)
from impactlab.scene.problem import Scene
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

COLUMNS = 400  # of time over the width of a figure; in each a curve keeps its extremes
ROW_SPACING = 0.8  # inches between rows of panels that each have a title and an axis of time
MAX_LETTERS = 33  # letters of a name and its note that fit above a panel of three
HEADROOM = 1.3  # of the axis of forces over the exact peak; higher values are cut, and their height is written
MAX_INSIDE = 6  # names inside a panel of more lines than `MAX_LABELS`
HEADING = 0.2  # inches above panels of several methods for the name of the contact
FORCE_TOL = 1e-3  # share of the largest force, below which a negative one is rounding
KICK_WINDOW = 1.0 / 60.0  # of the time drawn, over which the kicks of an impulse law are averaged to a force
GAP_TOL = 0.01  # share of the widest gap below which the exact gap is no scale: faces that stay together


class Scale(NamedTuple):
    """Units of a figure of forces, and its limits in them."""

    view: tuple[float, float]  # s
    time: Unit
    force: Unit
    bottom: float
    top: float


@drawn
def force(traces: Sequence[Trace], scene: Scene, contact: str, notes: Mapping[str, str] | None = None) -> Figure:
    """Return the force of the contacts of one name over time.

    The figure has one panel per trace on common axes. A contact that is short in a long run is drawn large
    (`named_contacts.view_of`).

    Parameters
    ----------
    contact : str
        Name of the contact, ``hammer|rod.left``, or of its pieces, ``shaft``.
    notes : mapping, optional
        Name of a trace to a few words written at the right above its panel.
    """
    columns = across(1 if len(traces) == 1 else 2 if len(traces) <= 4 else 3)
    rows, trips = math.ceil(len(traces) / columns), len(traces) > 1
    headed = trips and len({each.shared_name for each in traces[0].history.scene.contacts}) > 1
    margins = Margins(across=0.28, down=0.42, top=0.32 + HEADING * headed, bottom=lower_margin(trips=trips))
    figure, axes = grid(
        rows, columns, {1: 2.6 if len(traces) == 1 else 1.2, 2: 1.8, 3: 1.5}[columns], margins, share=True
    )
    if headed:
        inch = 1.0 / figure.get_figheight()
        figure.text(
            margins.left / figure.get_figwidth(),
            1.0 - 0.06 * inch,
            in_words(contact),
            va="top",
            fontsize=9.5,
            weight="bold",
        )
    known = [trace.history for trace in traces] + [each.reference for each in traces if each.reference is not None]
    view = view_of(known, contact, scene.duration)
    lines = [force_line(trace.history, contact, view, columns) for trace in traces]
    exact = [force_line(t.reference, contact, view, columns) if t.reference else (np.empty(0),) * 2 for t in traces]
    low, high = _extent([v for _, v in exact if v.size]) or _extent([v for _, v in lines if v.size]) or (0.0, 1.0)
    unit = scaled("N", max(high, -low))
    top = HEADROOM * high / unit.size
    bottom = HEADROOM * low / unit.size if low < -FORCE_TOL * high else -0.04 * top
    scale = Scale(view, scaled("s", view[1]), unit, bottom, top)
    panels = [axis for row in axes for axis in row]
    for axis, trace, line, line_exact in zip(panels, traces, lines, exact, strict=False):
        note = (notes or {}).get(trace.name, "")
        kicks = _draw_force(axis, trace, members_of(trace.history.scene, contact), line, scale)
        if kicks:
            note = kicks if trips else f"{note}, {kicks}" if note else kicks
        axis.plot(line_exact[0] / scale.time.size, line_exact[1] / unit.size, color=INK, linewidth=0.9)
        if not trips:
            note = f"{trace.name}, {note}" if note else trace.name
        axis.set_title(trace.name if trips else in_words(contact), color=trace.colour)
        if columns < 3 or len(trace.name) + len(note) < MAX_LETTERS:
            axis.set_title(note, loc="right", fontsize=7.5, fontweight="normal", color=MUTED)
        else:
            axis.text(0.985, 0.8, note, fontsize=7.5, color=MUTED, transform=axis.transAxes, ha="right", va="top")
        if bottom < 0.0 and low < 0.0:
            axis.axhline(0.0, color=MUTED, linewidth=0.8, zorder=0.9)
        axis.set_ylim(bottom, top or -0.04 * bottom)
    for axis in panels[len(traces) :]:
        axis.set_visible(False)
    for axis in panels[max(0, len(traces) - columns) : len(traces)]:
        axis.tick_params(labelbottom=True)
        time_axis(axis, scene, trips=trips, view=view)
    for row in axes:
        row[0].set_ylabel(f"force  F  [{unit.label}]")
    return figure


def _draw_force(axis: Axes, trace: Trace, contacts: Sequence[str], line: tuple[Array, Array], scale: Scale) -> str:
    """Draw the force of one name's contacts; return words on impulses."""
    t, values = line
    if not t.size:
        return _kicks(axis, trace, contacts, scale.view, scale.force)
    size = scale.force.size
    axis.plot(t / scale.time.size, values / size, color=trace.colour, linewidth=2.0)
    peaks = [span.peak_force or 0.0 for span in trace.history.spans(contacts[0])] if len(contacts) == 1 else []
    highest, lowest = max([float(values.max()), *peaks]) / size, float(values.min()) / size
    if highest > scale.top:
        _write_cut(axis, f"spikes up to {highest:.3g} {scale.force.label}", 0.97, "top")
    if lowest < scale.bottom:
        _write_cut(axis, f"down to {lowest:.3g} {scale.force.label}".replace("-", "\N{MINUS SIGN}"), 0.03, "bottom")
    return ""


def _extent(curves: Sequence[Array]) -> tuple[float, float] | None:
    """Return the least and largest value with 0; None where all are 0."""
    low = min((float(values.min()) for values in curves), default=0.0)
    high = max((float(values.max()) for values in curves), default=0.0)
    return None if low >= 0.0 >= high else (min(low, 0.0), max(high, 0.0))


def force_line(history: AbstractHistory, contact: str, view: tuple[float, float], panels: int) -> tuple[Array, Array]:
    """Return thinned times [s] and force [N] of a contact; possibly empty."""
    start, end = view
    times = start + page_times(end - start)
    force = with_short_peaks(history, contact, times, force_of(history, contact, np.minimum(times, end)))
    return thinned(times, force, COLUMNS // panels)


def _write_cut(axis: Axes, text: str, at: float, side: Literal["top", "bottom"]) -> None:
    """Write how far a force reaches where the axis cuts it."""
    behind = {"facecolor": PAPER, "edgecolor": "none", "pad": 2.0}
    axis.text(0.985, at, text, fontsize=7.5, bbox=behind, transform=axis.transAxes, ha="right", va=side)


def _kicks(axis: Axes, trace: Trace, contacts: Sequence[str], view: tuple[float, float], unit: Unit) -> str:
    """Draw the mean forces of an impulse law's kicks; return the caption."""
    events = [event for event in trace.history.events if event.contact in contacts and event.kind == "impulse"]
    kicks = [(event.time, event.impulse or 0.0) for event in events]
    start, end = view
    size, window = scaled("s", end).size, KICK_WINDOW * (end - start)
    edges = np.arange(start, end + window, window)
    total, _ = np.histogram([t for t, _ in kicks], edges, weights=[j for _, j in kicks])
    axis.stairs(total / window / unit.size, edges / size, fill=True, color=trace.colour, alpha=0.5, linewidth=0)
    if len(kicks) == 1:
        impulse = scaled("N s", abs(kicks[0][1]))
        return f"one kick of {kicks[0][1] / impulse.size:.3g} {impulse.label}"
    return f"mean of {len(kicks)} kicks"


@drawn
def signals(
    panels: Sequence[Panel],
    histories: Sequence[Trace],
    scene: Scene,
    *,
    compared: bool,
    view: tuple[float, float] | None = None,
) -> Figure:
    """Return panels of signals in rows of three as a figure.

    The names of methods stand beside them, those of places inside each. Of many places some have names, those of curves
    far apart.

    Parameters
    ----------
    view : pair of float, optional
        Times [s] between which the panels have their values; the whole run if not given.
    """
    columns = across(min(len(panels), 3))
    rows = math.ceil(len(panels) / columns)
    names = [trace.name for trace in histories] if compared else [line.name for line in panels[0].lines]
    beside = len(names) > 1 and (compared or len(panels) == 1)
    if beside and not compared:
        names = [names[number] for number in labelled([line.values for line in panels[0].lines])]
    margins = Margins(
        right=room_beside(names) if beside else 0.12,
        top=upper_margin(names if beside else ()),
        bottom=lower_margin(trips=compared),
        across=MARGINS.left,  # as beside the first column: room for ticks such as -1000
        down=ROW_SPACING,
    )
    figure, axes = grid(rows, columns, 1.7 if rows > 1 else 2.2, margins)
    start, end = view or (0.0, scene.duration)
    flat, time, t = [axis for row in axes for axis in row], scaled("s", end), start + page_times(end - start)
    for axis, panel in zip(flat, panels, strict=False):
        unit = _frame(axis, panel, histories)
        most = MAX_LABELS if beside or len(panel.lines) <= MAX_LABELS else MAX_INSIDE
        places = range(len(panel.lines)) if compared else labelled([line.values for line in panel.lines], most)
        named = []
        for number, colour in _in_drawing_order(panel, histories, places, compared=compared):
            line, has_name = panel.lines[number], colour != UNNAMED
            x, y = thinned(t, line.values, COLUMNS // columns)
            width, dash = 1.2 if has_name else 0.5, histories[line.trace].dash
            (curve,) = axis.plot(x / time.size, y / unit.size, color=colour, linestyle=dash, linewidth=width)
            if has_name:
                named.append((number, curve, y / unit.size, colour))
        trips = compared and axis in flat[max(0, len(panels) - columns) : len(panels)]
        time_axis(axis, scene, trips=trips, view=view)
        if beside and not compared:
            ends = [(float(y[-1]), panel.lines[number].name, colour) for number, _, y, colour in named if y.size]
            label_lines(axis, ends)
        elif not compared and len(panel.lines) > 1:
            in_order = sorted(named, key=lambda each: each[0])
            _legend(axis, {panel.lines[number].name: curve for number, curve, *_ in in_order}, len(panel.lines))
    for axis in flat[len(panels) :]:
        axis.set_visible(False)
    if beside and compared:
        key(axes[0][-1], histories)
    return figure


def _is_ink(line: Line, histories: Sequence[Trace]) -> bool:
    """Return whether a line is drawn in ink: that of the reference."""
    return histories[line.trace].colour == INK


def _frame(axis: Axes, panel: Panel, histories: Sequence[Trace]) -> Unit:
    """Set the scale and names of a panel; return its unit."""
    frame = [line for line in panel.lines if _is_ink(line, histories)] or panel.lines
    low = min(float(np.nanmin(line.values)) for line in frame)
    high = max(float(np.nanmax(line.values)) for line in frame)
    unit, span = scaled(panel.unit, max(abs(low), abs(high))), (high - low) or 1.0
    axis.set_ylim((low - 0.12 * span) / unit.size, (high + 0.12 * span) / unit.size)
    quantity, _, where = panel.title.partition(", ")
    axis.set_title(where or quantity)
    label = unit.label.replace("strain", "ε")
    axis.set_ylabel(f"{quantity.lower()}  [{label}]")
    return unit


def _in_drawing_order(
    panel: Panel, histories: Sequence[Trace], places: Sequence[int], *, compared: bool
) -> list[tuple[int, str]]:
    """Return numbers and colours of lines, unnamed first, the reference last."""
    colours = {number: PALETTE[place % len(PALETTE)] for place, number in enumerate(places)}
    found = []
    for number, line in enumerate(panel.lines):
        in_ink = _is_ink(line, histories)
        colour = INK if in_ink else histories[line.trace].colour if compared else colours.get(number, UNNAMED)
        found.append(((in_ink, number in colours), number, colour))
    return [(number, colour) for _, number, colour in sorted(found, key=lambda each: each[0])]


def _legend(axis: Axes, lines: Mapping[str, Line2D], count: int) -> None:
    """Write the names of lines above them in a panel, and how many others exist."""
    from matplotlib.lines import Line2D

    handles, names = list(lines.values()), list(lines)
    if count > len(names):
        handles.append(Line2D([], [], color=UNNAMED, linewidth=0.5))
        names.append(f"... {count - len(names)} more")
    box, figure = axis.get_position(), cast("Figure", axis.get_figure())
    columns = max(1, int(box.width * figure.get_figwidth() / (0.4 + 0.06 * max(map(len, names)))))
    room = (0.1 + 0.14 * math.ceil(len(names) / columns)) / (box.height * figure.get_figheight())  # share of the panel
    low, high = axis.get_ylim()
    axis.set_ylim(low, low + (high - low) / (1.0 - min(room, 0.5)))
    axis.legend(handles, names, loc="upper right", fontsize=7, ncols=columns, columnspacing=1.0, borderaxespad=0.2)


@drawn
def gap(traces: Sequence[Trace], scene: Scene, contact: str) -> Figure:
    """Return the least gap of one name's contacts over time.

    Beside it, the figure shows the same large near zero. The closer view shows penetration in contact, and touches that
    are nearly missed.
    """
    time, reference, times = clock(scene), exact_of(traces), page_times(scene.duration)
    lines = [thinned(times, gap_of(trace.history, contact, times), COLUMNS // 2) for trace in traces]
    exact = thinned(times, gap_of(reference, contact, times), COLUMNS // 2) if reference else lines[0]
    low, high = float(exact[1].min()), float(exact[1].max())
    widest = (min(float(v.min()) for _, v in lines), max(float(v.max()) for _, v in lines))
    if high - low < GAP_TOL * (widest[1] - widest[0]):
        low, high = widest
    span = (high - low) or 1.0
    trips = len(traces) > 1
    names = [trace.name for trace in traces] if trips else []
    columns, right = across(2), room_beside(names) if names else 0.12
    margins = Margins(right=right, top=upper_margin(names), bottom=lower_margin(trips=trips), down=ROW_SPACING)
    figure, axes = grid(2 // columns, columns, 2.4, margins)
    views = ((in_words(contact), low - 0.08 * span, high + 0.08 * span), ("near zero", -0.025 * span, 0.08 * span))
    flat = [axis for row in axes for axis in row]
    for axis, (title, bottom, top) in zip(flat, views, strict=True):
        unit = scaled("m", max(abs(bottom), abs(top)))
        axis.axhline(0.0, color=MUTED, linewidth=0.8)
        for trace, (t, values) in zip(traces, lines, strict=True):
            axis.plot(t / time.size, values / unit.size, color=trace.colour, linestyle=trace.dash, linewidth=1.3)
        if reference is not None:
            axis.plot(exact[0] / time.size, exact[1] / unit.size, color=INK, linewidth=1.0)
        axis.set_ylim(bottom / unit.size, top / unit.size)
        axis.set_title(title)
        axis.set_ylabel(f"gap  g  [{unit.label}]")
        time_axis(axis, scene, trips=trips and axis in axes[-1])
    if trips:
        key(axes[0][-1], traces)
    return figure
