"""Figures of energy: balances of methods, and shares in one run."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from impactlab.prefixes import scaled
from impactlab.report.figures.drawn_part import energy_parts
from impactlab.report.figures.signals import ROUNDING
from impactlab.report.figures.style import (
    INK,
    MAX_LABELS,
    PALETTE,
    Margins,
    Trace,
    clock,
    drawn,
    grid,
    label_lines,
    log_axis,
    lower_margin,
    room_beside,
    time_axis,
    upper_margin,
)
from impactlab.scene.problem import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_LINEAR = 0.5  # %, up to which a linear axis shows the balance; beyond, it is linear near zero and then logarithmic


@drawn
def energy_balance(traces: Sequence[Trace], scene: Scene) -> Figure:
    """Return the energy balance of each trace [%] as a figure.

    It is in % of the reference energy: above zero was gained, below was lost.
    """
    names = [trace.name for trace in traces]
    left = 0.95  # rounding has long numbers on its axis
    margins = Margins(left, room_beside(names), upper_margin(names), lower_margin(trips=True))
    figure, ((axis,),) = grid(1, 1, 2.6, margins)
    time, ends, extent = clock(scene), [], 0.0
    for trace in traces:
        book = trace.history.energy
        share = 100.0 * book.balance / book.scale
        axis.plot(book.time / time.size, share, color=trace.colour, linestyle=trace.dash)
        ends.append((float(share[-1]), trace.name, trace.colour))
        extent = max(extent, float(np.max(np.abs(share))))
    axis.axhline(0.0, color=INK, linewidth=0.9)
    if extent > MAX_LINEAR:
        axis.set_yscale("symlog", linthresh=0.1, linscale=0.7)
        log_axis(axis.yaxis)
    elif extent < ROUNDING:
        axis.set_ylim(-1e-3, 1e-3)
    axis.set_ylabel("energy balance  [% of the reference energy]")
    time_axis(axis, scene, trips=True)
    if len(ends) > 1:
        label_lines(axis, ends)
    return figure


@drawn
def energy_shares(trace: Trace, scene: Scene) -> Figure:
    """Return the energy of a run by place as stacked areas.

    They are each body, contacts, and booked losses. A dashed line is the energy at the start and the work since then.
    """
    book, time = trace.history.energy, clock(scene)
    parts = energy_parts(book)
    names = sorted(parts, key=lambda name: -float(np.max(np.abs(parts[name]))))[:MAX_LABELS]
    figure, ((axis,),) = grid(1, 1, 2.6, Margins(right=room_beside(names), top=upper_margin(names)))
    unit = scaled("J", float(np.max(book.total)))
    below, ends = np.zeros_like(book.time), []
    for (name, values), colour in zip(parts.items(), itertools.cycle(PALETTE)):
        above = below + values / unit.size
        axis.fill_between(book.time / time.size, below, above, color=colour, alpha=0.45, linewidth=0)
        axis.plot(book.time / time.size, above, color=colour, linewidth=1.1)
        ends.append((float(below[-1] + above[-1]) / 2.0, name, colour))
        below = above
    given = (book.total[0] + book.work) / unit.size
    axis.plot(book.time / time.size, given, color=INK, linewidth=0.9, linestyle=(0, (4, 2)))
    axis.set_ylim(0.0, 1.12 * max(float(below.max()), float(given.max()), 1e-30))
    axis.set_ylabel(f"energy  [{unit.label}]")
    time_axis(axis, scene)
    label_lines(axis, [end for end in ends if end[1] in names])
    return figure
