"""Work-precision figures: the error of every method against its time, its steps and its unknowns, and the front."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from impactlab.bench.report.fronts import Point, front_of, points, stepped
from impactlab.bench.report.looks import (
    GREY,
    End,
    Look,
    decades,
    is_special,
    is_stepless,
    leaders,
    name_ends,
    shortened,
    told_apart,
)
from impactlab.bench.report.views import Family, Norm, SceneRows, error
from impactlab.bench.schema import Row
from impactlab.report.style import INK, LETTER, MUTED, PAPER, WIDTH, drawn

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CEILING = 2.0  # relative error; who is further off is told, not drawn
DEEPEST = 1e-9  # the lowest error an axis goes down to
TALL, LOW = 3.3, 1.9  # inches, of the upper panel and of the two below


class Cost(NamedTuple):
    """What an error is set against."""

    label: str
    of: Callable[[Row], float | None]


TIME = Cost("time to solve  [ms]", lambda row: None if row.solve_s is None else 1e3 * row.solve_s)
TOTAL = Cost("time with set-up  [ms]", lambda row: None if (t := row.total_s) is None else 1e3 * t)
STEPS = Cost("steps", lambda row: row.steps)
UNKNOWNS = Cost("unknowns", lambda row: row.unknowns)


@drawn
def precision(scene: SceneRows, norm: Norm, look: Mapping[str, Look]) -> Figure:
    """Return the work-precision figure of one scene in one norm: time above, steps and unknowns below.

    Who leads in any of the panels is coloured and named, the others are grey. Methods without steps, whose errors are
    rounding, are dark and do not enter the front, for beside them nothing else would be on it.
    """
    from matplotlib.figure import Figure

    named = leaders(scene, norm)
    look = {**look, **told_apart(named, look)}
    exact = [family for family in scene.families if is_stepless(family) and points(family.rows, norm, scene)]
    chosen = points(scene.automatic, norm, scene, TIME.of)
    written = [*named, *(family.method for family in exact), *(["automatic"] if chosen else [])]
    room = 0.3 + LETTER * max((len(shortened(name)) for name in written), default=10)
    height = 0.3 + TALL + 0.72 + LOW + 0.48
    figure = Figure(figsize=(WIDTH, height))
    floor, top = limits(scene, norm)
    upper = _axes(figure, 0.72, 0.48 + LOW + 0.72, WIDTH - 0.72 - room, TALL)
    half = (WIDTH - 0.72 - 0.3 - 0.35) / 2.0
    lower = [_axes(figure, 0.72 + column * (half + 0.35), 0.48, half, LOW) for column in (0, 1)]
    for axis, cost in ((upper, TIME), (lower[0], STEPS), (lower[1], UNKNOWNS)):
        _frame(axis, scene, norm, cost, floor, top)
        _families(axis, scene, norm, cost, look, named, floor)
    lower[1].tick_params(labelleft=False)
    for axis in (upper, lower[0]):
        axis.set_ylabel(norm.axis if axis is upper else "error")
    upper.set_title(f"{scene.name}: {norm.title}")
    if not points(scene.all_rows, norm, scene):
        upper.text(0.5, 0.5, "no times in this table", transform=upper.transAxes, color=MUTED, ha="center")
    _fronts(upper, scene, norm, floor)
    _uncertainty(upper, scene, norm, floor)
    _without_steps(upper, exact, scene, norm, floor)
    for point in chosen:
        upper.plot([point.cost], [max(point.error, floor)], "*", color=INK, markersize=9, mfc="none", zorder=6)
    _beyond(upper, scene, norm, top)
    ends = []
    for family in scene.families:
        if family.method in named and (line := _line(family, norm, scene, TIME, floor, top)):
            end = min(line, key=lambda point: (point.error, -point.cost))
            ends.append(End(end.cost, end.error, family.method, look[family.method].colour))
    for family in exact:
        point = points(family.rows, norm, scene, TIME.of)[0]
        ends.append(End(point.cost, max(point.error, floor), family.method, INK))
    if chosen:
        best = min(chosen, key=lambda point: point.error)
        ends.append(End(best.cost, max(best.error, floor), "automatic", INK))
    name_ends(upper, ends)
    return figure


def limits(scene: SceneRows, norm: Norm) -> tuple[float, float]:
    """Return the lowest and the highest error of an axis: whole decades around the methods with steps."""
    found = (error(row, norm, scene) for row in stepped(scene))
    known = [value for value in found if value is not None and DEEPEST < value < CEILING] or [1e-3]
    floor = 10.0 ** math.floor(math.log10(min(known) / 1.5))  # an arrow at the floor keeps clear of the lowest dot
    return max(DEEPEST, floor), min(CEILING, 10.0 ** math.ceil(math.log10(max(known)) + 0.05))


def _axes(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    wide, high = figure.get_size_inches()
    return figure.add_axes((left / wide, bottom / high, width / wide, height / high))


def _frame(axis: Axes, scene: SceneRows, norm: Norm, cost: Cost, floor: float, top: float) -> None:
    """Set up the scales: all panels show the same errors, each the costs of all that is drawn in it."""
    from matplotlib.ticker import LogLocator, NullLocator

    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_ylim(floor / 1.5, top)
    decades(axis.yaxis)
    axis.set_xlabel(cost.label)
    rows = [row for row in scene.all_rows if cost is TIME or not row.stepless]
    costs = [point.cost for point in points(rows, norm, scene, cost.of) if point.error <= top]
    if cost is TIME:
        costs += [point.cost for point in front_of(stepped(scene), norm, scene, TOTAL.of) if point.error <= top]
    low, high = min(costs, default=1.0), max(costs, default=1.0)
    axis.set_xlim(low / (high / low * 2.0) ** 0.04, high * (high / low * 2.0) ** 0.04)
    axis.xaxis.set_major_locator(LogLocator(10.0, subs=(1.0, 2.0, 5.0) if high / low < 300.0 else (1.0,), numticks=12))
    axis.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.xaxis.set_minor_locator(NullLocator())


def _line(family: Family, norm: Norm, scene: SceneRows, cost: Cost, floor: float, top: float) -> list[Point]:
    """Return a family as it is drawn: through its levels, the too deep at the floor, the too high left out."""
    found = points(family.rows, norm, scene, cost.of)
    return [point._replace(error=max(point.error, floor)) for point in found if point.error <= top]


def _families(
    axis: Axes,
    scene: SceneRows,
    norm: Norm,
    cost: Cost,
    look: Mapping[str, Look],
    named: Sequence[str],
    floor: float,
) -> None:
    """Draw a line per family through its levels, dashed on the special grid dt = h/c; the case's own are crosses."""
    top = limits(scene, norm)[1]
    for own in scene.own:
        for point in _line(own, norm, scene, cost, floor, top) if cost is TIME or not is_stepless(own) else ():
            axis.plot([point.cost], [point.error], "x", color=GREY, markersize=3.5, markeredgewidth=0.8, zorder=2.0)
    for family in scene.families:
        line = _line(family, norm, scene, cost, floor, top)
        if not line or is_stepless(family):
            continue
        leads = family.method in named
        axis.plot(
            [point.cost for point in line],
            [point.error for point in line],
            color=look[family.method].colour if leads else GREY,
            marker=look[family.method].shape if leads else ".",
            markersize=4.2 if leads else 3.0,
            linewidth=1.6 if leads else 0.7,
            linestyle=(0, (4, 1.5)) if is_special(family) else "-",
            alpha=1.0 if leads else 0.75,
            zorder=3.0 if leads else 2.0,
        )


def _fronts(axis: Axes, scene: SceneRows, norm: Norm, floor: float) -> None:
    """Draw the front of the methods with steps as a staircase with rings, and dotted the one with set-up."""
    rows, top = stepped(scene), axis.get_ylim()[1]
    for cost, style in ((TIME, "-"), (TOTAL, ":")):
        best = [point for point in front_of(rows, norm, scene, cost.of) if point.error <= top]
        if not best:
            continue
        high = axis.get_xlim()[1]
        errors = [max(point.error, floor) for point in best]
        xs, ys = [best[0].cost, *(p.cost for p in best), high], [top, *errors, errors[-1]]
        axis.step(xs, ys, where="post", color=MUTED, linewidth=0.9, linestyle=style, zorder=2.5)
        if cost is TIME:
            costs = [point.cost for point in best]
            axis.plot(costs, errors, "o", color=INK, mfc="none", markersize=7.5, markeredgewidth=0.9, zorder=5)
    for x, style, text in ((0.56, "-", "front"), (0.7, ":", "front, set-up included")):
        place, y = axis.transAxes, 1.035
        axis.plot([x, x + 0.04], [y, y], style, color=MUTED, linewidth=0.9, transform=place, clip_on=False)
        axis.text(x + 0.05, y, text, color=MUTED, fontsize=7.5, va="center", transform=place)


def _uncertainty(axis: Axes, scene: SceneRows, norm: Norm, floor: float) -> None:
    """Shade errors below the uncertainty of the reference."""
    if norm.relative and scene.uncertainty > floor:
        axis.axhspan(axis.get_ylim()[0], scene.uncertainty, color=GREY, alpha=0.2, linewidth=0)
        text = "below the uncertainty of the reference"
        axis.text(
            0.01, scene.uncertainty, text, transform=axis.get_yaxis_transform(), fontsize=7.5, color=MUTED, va="top"
        )


def _without_steps(axis: Axes, exact: Sequence[Family], scene: SceneRows, norm: Norm, floor: float) -> None:
    """Draw the methods without steps; an arrow where their error lies below the axis."""
    for family in exact:
        for point in points(family.rows, norm, scene, TIME.of):
            deep = point.error < floor
            y = max(point.error, floor)
            axis.plot([point.cost], [y], "v" if deep else "D", color=INK, markersize=7 if deep else 6, zorder=5)


def _beyond(axis: Axes, scene: SceneRows, norm: Norm, top: float) -> None:
    """Say how many runs are further off than the axis reaches."""
    count = sum((error(row, norm, scene) or 0.0) > top for row in scene.rows)
    if count:
        text = f"{count} run{'s' if count > 1 else ''} further off than {100 * top:.0f} % not drawn"
        behind = {"facecolor": PAPER, "edgecolor": "none", "pad": 1.5}
        axis.text(0.01, 0.985, text, transform=axis.transAxes, fontsize=7.5, color=MUTED, va="top", bbox=behind)
