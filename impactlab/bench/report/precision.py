"""Work-precision figures: error against time, steps and unknowns, with the front."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from impactlab.bench.report.fronts import Point, front_of, points
from impactlab.bench.report.method_styles import (
    GREY,
    End,
    MethodStyles,
    counts,
    decades,
    distinct,
    draw_family,
    leaders,
    name_ends,
    room_beside,
)
from impactlab.bench.report.views import AUTOMATIC, Clock, MethodRows, Norm, SceneRows, error
from impactlab.printing import counted
from impactlab.report.figures.style import INK, MUTED, PAPER, WIDTH, drawn

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_ERROR = 2.0  # relative; runs with larger errors are counted, not drawn
MIN_FLOOR = 1e-9  # the lowest error an axis goes down to
TALL, LOW = 3.3, 1.9  # inches, of the upper panel and of the two below
LEFT, BOTTOM, BETWEEN = 0.72, 0.48, 0.72  # inches: margins, and between the rows of panels


class Cost(NamedTuple):
    """The horizontal axis of a panel."""

    label: str
    of: Clock


def _in_ms(seconds: float | None) -> float | None:
    return None if seconds is None else 1e3 * seconds


TIME = Cost("time to solve  [ms]", lambda row: _in_ms(row.solve_s))
TOTAL = Cost("time with set-up  [ms]", lambda row: _in_ms(row.total_s))
STEPS = Cost("steps", lambda row: row.steps)
UNKNOWNS = Cost("unknowns", lambda row: row.unknowns)


class Limits(NamedTuple):
    """The lowest and the highest error of an axis."""

    floor: float
    top: float

    def shown(self, found: Sequence[Point]) -> list[Point]:
        """Return points as drawn: on the floor if below it, none above the top."""
        return [point._replace(error=max(point.error, self.floor)) for point in found if point.error <= self.top]


@drawn
def precision(scene: SceneRows, norm: Norm, styles: MethodStyles) -> Figure:
    """Return the work-precision figure of one scene in one norm.

    Time is above, steps and unknowns are below; without times, steps are above unknowns. The leaders of any panel are
    coloured and named, the others are grey.
    Methods without steps, whose errors are rounding, are dark and do not enter the front, which would hold nothing
    else.
    """
    named = leaders(scene, norm)
    styles, limits = distinct(named, styles), limits_of(scene, norm)
    exact = [family for family in scene.families if family.stepless and points(family.rows, norm, scene)]
    chosen = points(scene.automatic, norm, scene, TIME.of)
    room = room_beside([*named, *(family.method for family in exact), *([AUTOMATIC] if chosen else [])])
    figure, (upper, left, right) = _three_panels(room)
    is_timed = bool(points(scene.all_rows, norm, scene))
    costs = (TIME, STEPS, UNKNOWNS) if is_timed else (STEPS, UNKNOWNS)
    for axes, cost in zip((upper, left, right), costs, strict=False):
        _frame(axes, scene, norm, cost, limits)
        for own in scene.own:
            if cost is TIME or not own.stepless:
                for point in limits.shown(points(own.rows, norm, scene, cost.of)):
                    axes.plot([point.cost], [point.error], "x", color=GREY, markersize=3.5, mew=0.8, zorder=2.0)
        for family in scene.families:
            line = limits.shown(points(family.rows, norm, scene, cost.of))
            if line and not family.stepless:
                draw_family(axes, family, styles, family.method in named, [point[:2] for point in line])
    right.tick_params(labelleft=False)
    if not is_timed:
        right.remove()
        left.set_position((*left.get_position().p0, upper.get_position().width, left.get_position().height))
    left.set_ylabel("error")
    upper.set_ylabel(norm.axis)
    upper.set_title(f"{scene.name}: {norm.title}")
    _fronts(upper, scene, norm, limits, (TIME, TOTAL) if is_timed else (STEPS,))
    _notes(upper, scene, norm, limits)
    timed = [(family, points(family.rows, norm, scene, TIME.of)) for family in exact]
    ends = [_draw_exact(upper, family, found, limits) for family, found in timed if found]
    for point in chosen:
        upper.plot([point.cost], [max(point.error, limits.floor)], "*", color=INK, markersize=9, mfc="none", zorder=6)
    if chosen:
        closest = min(chosen, key=lambda point: point.error)
        ends.append(End(closest.cost, max(closest.error, limits.floor), AUTOMATIC, INK))
    families = [family for family in scene.families if family.method in named]
    ends += _named_ends(families, scene, norm, costs[0], styles, limits)
    name_ends(upper, ends)
    return figure


def _three_panels(room: float) -> tuple[Figure, tuple[Axes, Axes, Axes]]:
    """Return a figure with a wide panel above two others.

    ``room`` [inch] is left for names beside the first.
    """
    from matplotlib.figure import Figure

    height = BOTTOM + LOW + BETWEEN + TALL + 0.3
    figure, half = Figure(figsize=(WIDTH, height)), (WIDTH - LEFT - 0.3 - 0.35) / 2.0
    boxes = (
        (LEFT, BOTTOM + LOW + BETWEEN, WIDTH - LEFT - room, TALL),
        (LEFT, BOTTOM, half, LOW),
        (LEFT + half + 0.35, BOTTOM, half, LOW),
    )
    upper, left, right = (figure.add_axes((x / WIDTH, y / height, w / WIDTH, h / height)) for x, y, w, h in boxes)
    return figure, (upper, left, right)


def _draw_exact(axes: Axes, family: MethodRows, found: Sequence[Point], limits: Limits) -> End:
    """Draw a method without steps; return the place of its name, below the axis."""
    for point in found:
        below = point.error < limits.floor
        at = [max(point.error, limits.floor)]
        axes.plot([point.cost], at, "v" if below else "D", color=INK, markersize=7 if below else 6, zorder=5)
    return End(found[0].cost, max(found[0].error, limits.floor), family.method, INK)


def _named_ends(
    families: Sequence[MethodRows], scene: SceneRows, norm: Norm, cost: Cost, styles: MethodStyles, limits: Limits
) -> list[End]:
    """Return the names of families at their levels with the least error."""
    lines = [(family, limits.shown(points(family.rows, norm, scene, cost.of))) for family in families]
    ends = [(family, min(line, key=lambda point: (point.error, -point.cost))) for family, line in lines if line]
    return [End(end.cost, end.error, family.method, styles[family.method].colour) for family, end in ends]


def limits_of(scene: SceneRows, norm: Norm) -> Limits:
    """Return limits of a scene's error axes: whole decades around the methods with steps."""
    found = (error(row, norm, scene) for row in scene.stepped)
    known = [value for value in found if value is not None and MIN_FLOOR < value < MAX_ERROR] or [1e-3]
    floor = 10.0 ** math.floor(math.log10(min(known) / 1.5))  # an arrow at the floor keeps clear of the lowest dot
    return Limits(max(MIN_FLOOR, floor), min(MAX_ERROR, 10.0 ** math.ceil(math.log10(max(known)) + 0.05)))


def _frame(axes: Axes, scene: SceneRows, norm: Norm, cost: Cost, limits: Limits) -> None:
    """Set up the scales of a panel.

    All panels show the same errors, each the costs of all that is drawn in it.
    """
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(limits.floor / 1.5, limits.top)
    decades(axes.yaxis)
    axes.set_xlabel(cost.label)
    shown = points([row for row in scene.all_rows if cost is TIME or not row.stepless], norm, scene, cost.of)
    if cost is TIME:
        shown += front_of(scene.stepped, norm, scene, TOTAL.of)
    costs = [point.cost for point in limits.shown(shown)]
    low, high = min(costs, default=1.0), max(costs, default=1.0)
    axes.set_xlim(low / (high / low * 2.0) ** 0.04, high * (high / low * 2.0) ** 0.04)
    counts(axes.xaxis, low, high)


def _fronts(axes: Axes, scene: SceneRows, norm: Norm, limits: Limits, costs: Sequence[Cost]) -> None:
    """Draw the front of the methods with steps as a staircase.

    It has rings; the one with set-up is dotted.
    """
    kinds = (("-", 0.56, "front"), (":", 0.7, "front, set-up included"))
    for cost, (style, x, text) in zip(costs, kinds, strict=False):
        axes.plot([x, x + 0.04], [1.035] * 2, style, color=MUTED, lw=0.9, transform=axes.transAxes, clip_on=False)
        axes.text(x + 0.05, 1.035, text, color=MUTED, fontsize=7.5, va="center", transform=axes.transAxes)
        front = limits.shown(front_of(scene.stepped, norm, scene, cost.of))
        if front:
            places, errors = [point.cost for point in front], [point.error for point in front]
            xs, ys = [places[0], *places, axes.get_xlim()[1]], [limits.top, *errors, errors[-1]]
            axes.step(xs, ys, where="post", color=MUTED, linewidth=0.9, linestyle=style, zorder=2.5)
            if cost is not TOTAL:
                axes.plot(places, errors, "o", color=INK, mfc="none", markersize=7.5, markeredgewidth=0.9, zorder=5)


def _notes(axes: Axes, scene: SceneRows, norm: Norm, limits: Limits) -> None:
    """Shade errors below the uncertainty of the reference, and count runs above the axis."""
    if norm.relative and scene.uncertainty > limits.floor:
        axes.axhspan(axes.get_ylim()[0], scene.uncertainty, color=GREY, alpha=0.2, linewidth=0)
        place, text = axes.get_yaxis_transform(), "below the uncertainty of the reference"
        axes.text(0.01, scene.uncertainty, text, transform=place, fontsize=7.5, color=MUTED, va="top")
    count = sum((error(row, norm, scene) or 0.0) > limits.top for row in scene.rows)
    if count:
        text = f"{counted(count, 'run')} with errors above {100 * limits.top:.0f} % not drawn"
        behind = {"facecolor": PAPER, "edgecolor": "none", "pad": 1.5}
        axes.text(0.01, 0.985, text, transform=axes.transAxes, fontsize=7.5, color=MUTED, va="top", bbox=behind)
