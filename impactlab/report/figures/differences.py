"""Figure of the differences of the methods of a run from its reference, over time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from impactlab.history.sampling import page_times
from impactlab.metrics.norms import face_channels, mass_channels
from impactlab.report.figures.plots import COLUMNS, ROW_SPACING
from impactlab.report.figures.signals import place_in_words
from impactlab.report.figures.style import (
    Margins,
    Trace,
    across,
    clock,
    drawn,
    grid,
    label_lines,
    log_axis,
    lower_margin,
    room_beside,
    thinned,
    time_axis,
    upper_margin,
)
from impactlab.scene.problem import Scene
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FLOOR = 1e-4  # %, differences below it are drawn there
HARDLY_MOVES = 1e-3  # of the largest displacement of all: of a face that moves less it is the scale of differences
MAX_PANELS = 12  # of more masses and faces those with the largest are drawn


def differences(traces: Sequence[Trace]) -> list[Trace]:
    """Return the traces that a step could take away from their reference."""
    return [trace for trace in traces if trace.reference is not None and trace.history.dt is not None]


def _shares(traces: Sequence[Trace], channels: Sequence[str], t: Array) -> dict[str, list[Array]]:
    """Return the largest differences from the references up to times t, by channel [% of their largest values]."""
    found: dict[str, list[Array]] = {channel: [] for channel in channels}
    for trace in traces:
        assert trace.reference is not None  # noqa: S101 - `differences` leaves only such traces
        exact, own = trace.reference.evaluate_each(t, channels), trace.history.evaluate_each(t, channels)
        largest = np.abs(exact).max(axis=1)
        scale = np.maximum(largest, HARDLY_MOVES * largest.max(initial=0.0))[:, None]
        rows = np.maximum.accumulate(np.abs(own - exact), axis=1) / np.where(scale > 0.0, scale, 1.0) * 100.0
        for channel, row in zip(channels, np.maximum(rows, FLOOR), strict=True):
            found[channel].append(row)
    return found


@drawn
def difference(traces: Sequence[Trace], scene: Scene) -> Figure:
    """Return the largest difference from the reference so far as a figure.

    It is that of displacements, with a panel per mass and face, at most `MAX_PANELS`. In % of the largest reference
    value, on one logarithmic scale: a curve that only rises, so that methods stay apart.
    """
    compared, t = differences(traces), page_times(scene.duration)
    shares = _shares(compared, mass_channels(scene) + face_channels(scene), t)
    most = sorted(shares, key=lambda channel: -max(share[-1] for share in shares[channel]))[:MAX_PANELS]
    channels = [channel for channel in shares if channel in most]
    columns = across(min(len(channels), 3))
    rows, trips = math.ceil(len(channels) / columns), len(traces) > 1
    names = [trace.name for trace in compared] if len(compared) > 1 else []
    right = room_beside(names) if names else 0.12
    margins = Margins(right=right, top=upper_margin(names), bottom=lower_margin(trips=trips), down=ROW_SPACING)
    figure, axes = grid(rows, columns, 1.9, margins)
    flat, highest = [axis for row in axes for axis in row], 1.0
    ends: list[list[tuple[float, str, str]]] = []  # of the lines in each panel
    for axis, channel in zip(flat, channels, strict=False):
        ends.append([])
        for trace, share in zip(compared, shares[channel], strict=True):
            x, y = thinned(t, share, COLUMNS // columns)
            axis.plot(x / clock(scene).size, y, color=trace.colour, linestyle=trace.dash)
            ends[-1].append((float(share[-1]), trace.name, trace.colour))
            highest = max(highest, float(share[-1]))
        axis.set_yscale("log")
        log_axis(axis.yaxis)
        axis.set_title(place_in_words(channel))
        time_axis(axis, scene, trips=trips and axis in flat[max(0, len(channels) - columns) : len(channels)])
    for axis in flat[: len(channels)]:
        axis.set_ylim(FLOOR / 1.5, 2.0 * highest)
    for axis in flat[len(channels) :]:
        axis.set_visible(False)
    axes[0][0].set_ylabel("largest difference so far  [%]")
    if len(names) > 1:
        beside = min(columns, len(channels)) - 1
        label_lines(flat[beside], ends[beside])
    return figure
