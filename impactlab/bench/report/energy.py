"""Figures of energy gains and losses, force oscillation and force error over the steps of each method."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from impactlab.bench.report.method_styles import (
    End,
    MethodStyles,
    counts,
    decades,
    distinct,
    draw_family,
    name_ends,
    room_beside,
)
from impactlab.bench.report.views import Clock, MethodRows, SceneRows
from impactlab.printing import counted
from impactlab.report.figures.style import MUTED, Margins, drawn, grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROUNDING = 1e-10  # shares of energy below it are rounding
MIN_NAMED = 1e-3  # a method whose finest level lies below is not named, where there are more than `MAX_NAMED`
MAX_NAMED = 7  # names per panel

Panel = tuple[str, str, Clock]
"""Title, label of the vertical axis, the number of a row that is drawn."""


@drawn
def energy(scene: SceneRows, styles: MethodStyles) -> Figure:
    """Return a figure of energy gain and loss against steps.

    They are the largest gain and loss of the energy balance of every family. Named are those that gain or lose most at
    their finest level: a part independent of the step is the method's own.
    """
    panels = (
        ("energy gained", "share of the reference energy", lambda row: row.energy_gain),
        ("energy lost that no formula explains", "share of the reference energy", lambda row: row.energy_loss),
    )
    return _against_steps(scene, styles, panels, 1e-6, 10.0)


@drawn
def oscillation(scene: SceneRows, styles: MethodStyles) -> Figure:
    """Return a figure of contact force oscillation and error against steps.

    The error is that away from jumps; every family is shown.
    """
    panels = (
        ("force oscillation", "total variation in excess, in peaks", lambda row: row.force_oscillation),
        ("force, error away from jumps", "relative L2", lambda row: row.force_away_from_jumps),
    )
    return _against_steps(scene, styles, panels, 1e-4, 1e5)


def _against_steps(scene: SceneRows, styles: MethodStyles, panels: Sequence[Panel], low: float, high: float) -> Figure:
    """Return a figure over steps per round trip, a panel per number.

    Names stand beside each panel; axes are within limits.
    """
    worst = [_worst(scene, of) for _, _, of in panels]
    named = list(dict.fromkeys(method for found in worst for method in found))
    styles = distinct(named, styles)
    figure, rows = grid(len(panels), 1, 2.0, Margins(right=room_beside(named), down=0.5))
    for (axes,), (title, label, of), found in zip(rows, panels, worst, strict=True):
        values = [value for row in scene.rows if row.completed and (value := of(row)) is not None and value > low]
        floor = max(low, 10.0 ** math.floor(math.log10(min(values, default=0.1))))
        top = min(high, 10.0 ** math.ceil(math.log10(max(values, default=1.0)) + 0.05))
        _panel(axes, scene, styles, of, found, floor, top)
        axes.set_title(title)
        axes.set_ylabel(label)
    trips = any(row.round_trips for row in scene.rows)
    rows[-1][0].set_xlabel("steps per round trip" if trips else "steps")
    return figure


def _worst(scene: SceneRows, of: Clock) -> list[str]:
    """Return the methods to name: those whose finest level is worst, from `MIN_NAMED` on; of few methods all."""
    ends = [(line[-1][1], family.method) for family in scene.families if (line := _line(family, of))]
    least = ROUNDING if len(ends) <= MAX_NAMED else MIN_NAMED
    return [method for value, method in sorted(ends, key=lambda pair: -pair[0])[:MAX_NAMED] if value > least]


def _line(family: MethodRows, of: Clock) -> list[tuple[float, float]]:
    """Return (steps per round trip, value) of the completed levels that took steps."""
    return [
        (row.steps / (row.round_trips or 1.0), value)
        for row in family.completed
        if row.steps and (value := of(row)) is not None and not row.stepless
    ]


def _panel(
    axes: Axes, scene: SceneRows, styles: MethodStyles, of: Clock, named: Sequence[str], floor: float, top: float
) -> None:
    ends, quiet, steps = [], 0, []
    for family in scene.families:
        line = _line(family, of)
        if not line:
            continue
        steps += [x for x, _ in line]
        quiet += all(value < ROUNDING for _, value in line)
        shown = [(x, min(max(value, floor), top)) for x, value in line]
        draw_family(axes, family, styles, family.method in named, shown, clip_on=False)
        if family.method in named:
            ends.append(End(*shown[-1], family.method, styles[family.method].colour))
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(floor / 1.6, top)
    decades(axes.yaxis)
    counts(axes.xaxis, min(steps, default=1.0), max(steps, default=1.0))
    if quiet:
        text = f"{counted(quiet, 'method')} at rounding, on the floor"
        axes.set_title(text, loc="right", fontsize=7.5, fontweight="normal", color=MUTED)
    name_ends(axes, ends)
