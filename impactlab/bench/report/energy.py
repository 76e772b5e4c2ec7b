"""What methods do to energy and force as their steps shrink: gain, loss, and forces that swing where none should."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from impactlab.bench.report.looks import GREY, End, Look, decades, is_special, name_ends, shortened, told_apart
from impactlab.bench.report.views import Family, SceneRows
from impactlab.bench.schema import Row
from impactlab.report.style import LETTER, MUTED, Margins, drawn, grid, log_axis

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROUNDING = 1e-10  # shares of energy below it are rounding
SHOWN = 1e-6  # where an axis of energy begins
TELLING = 1e-3  # from which on a gain or loss is worth a name
NAMED = 7  # names per panel
HIGH = 10.0  # where an axis of energy ends


@drawn
def energy(scene: SceneRows, look: Mapping[str, Look]) -> Figure:
    """Return the largest gain and the largest loss of the energy balance of every family, against its steps.

    Named are those that gain or lose most at their finest level: what does not fall with the step is the method's own.
    """
    panels = (
        ("energy gained", "share of the reference energy", lambda row: row.energy_gain),
        ("energy lost without a booking", "share of the reference energy", lambda row: row.energy_loss),
    )
    return _against_steps(scene, look, panels, SHOWN, HIGH)


@drawn
def oscillation(scene: SceneRows, look: Mapping[str, Look]) -> Figure:
    """Return how much the contact force of every family swings, and its error away from jumps, against its steps."""
    panels = (
        ("force oscillation", "ups and downs too many, in peaks", lambda row: row.force_oscillation),
        ("force, error away from jumps", "relative L2", lambda row: row.force_away_from_jumps),
    )
    return _against_steps(scene, look, panels, 1e-4, 1e5)


Panel = tuple[str, str, Callable[[Row], float | None]]


def _against_steps(
    scene: SceneRows, look: Mapping[str, Look], panels: Sequence[Panel], low: float, high: float
) -> Figure:
    """Return a figure of some measures over steps per round trip, a panel each, names beside each."""
    worst = [_worst(scene, of) for _, _, of in panels]
    told = list(dict.fromkeys(family.method for found in worst for family in found))
    look, names = {**look, **told_apart(told, look)}, [shortened(method, 34) for method in told]
    room = 0.3 + LETTER * max(map(len, names), default=8)
    figure, rows = grid(len(panels), 1, 2.0, Margins(right=room, down=0.5))
    trips = any(row.round_trips for row in scene.rows)
    for (axis,), (title, label, of), named in zip(rows, panels, worst, strict=True):
        values = [value for row in scene.rows if row.completed and (value := of(row)) is not None and value > low]
        floor = max(low, 10.0 ** math.floor(math.log10(min(values, default=0.1))))
        top = min(high, 10.0 ** math.ceil(math.log10(max(values, default=1.0)) + 0.05))
        _panel(axis, scene, look, of, [family.method for family in named], floor, top)
        axis.set_title(title)
        axis.set_ylabel(label)
    rows[-1][0].set_xlabel("steps per round trip" if trips else "steps")
    return figure


def _worst(scene: SceneRows, of: Callable[[Row], float | None]) -> list[Family]:
    """Return the families to name: those whose finest level is worst, from `TELLING` on."""
    ends = [(values[-1][1], family) for family in scene.families if (values := _line(family, of))]
    ends = [(value, family) for value, family in ends if value > TELLING]
    return [family for _, family in sorted(ends, key=lambda pair: -pair[0])[:NAMED]]


def _line(family: Family, of: Callable[[Row], float | None]) -> list[tuple[float, float]]:
    """Return (steps per round trip, value) of the completed levels that took steps."""
    found = []
    for row in family.completed:
        value = of(row)
        if row.steps and value is not None and not row.stepless:
            found.append((row.steps / (row.round_trips or 1.0), value))
    return found


def _panel(
    axis: Axes,
    scene: SceneRows,
    look: Mapping[str, Look],
    of: Callable[[Row], float | None],
    named: Sequence[str],
    floor: float,
    top: float,
) -> None:
    ends, quiet = [], 0
    for family in scene.families:
        line = _line(family, of)
        if not line:
            continue
        quiet += all(value < ROUNDING for _, value in line)
        told = family.method in named
        x, y = [x for x, _ in line], [min(max(value, floor), top) for _, value in line]
        axis.plot(
            x,
            y,
            color=look[family.method].colour if told else GREY,
            marker=look[family.method].shape if told else ".",
            markersize=4.2 if told else 3.0,
            linewidth=1.5 if told else 0.7,
            linestyle=(0, (4, 1.5)) if is_special(family) else "-",
            alpha=1.0 if told else 0.75,
            zorder=3.0 if told else 2.0,
            clip_on=False,
        )
        if told:
            ends.append(End(x[-1], y[-1], shortened(family.method, 34), look[family.method].colour))
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_ylim(floor / 1.6, top)
    decades(axis.yaxis)
    log_axis(axis.xaxis)
    if quiet:
        text = f"{quiet} method{'s' if quiet > 1 else ''} at rounding, on the floor"
        axis.set_title(text, loc="right", fontsize=7.5, fontweight="normal", color=MUTED)
    name_ends(axis, ends)
