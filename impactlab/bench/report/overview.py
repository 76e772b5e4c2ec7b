"""Figures over all scenes: performance profiles, and a map of who meets a tolerance where at which price."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from impactlab.bench.report.looks import GREY, End, Look, name_ends, power, shortened, told_apart
from impactlab.bench.report.ranking import ABSENT, FAILED, MET, MISSED, REFUSED, Standing, judged, profile, ranking
from impactlab.bench.report.views import TOLERANCES, Norm, SceneRows
from impactlab.report.style import GRID, INK, LETTER, MUTED, PALETTE, WIDTH, Margins, drawn, grid, room_for

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FURTHEST = 300.0  # the largest ratio a profile shows
NAMED = 9  # methods that a profile names
STEPS = ((1.5, "#0b6e5d"), (3.0, "#36a48e"), (10.0, "#8fcdbd"), (30.0, "#c9e4dc"), (float("inf"), "#e6f1ee"))
"""Colours of the map by time over the best: darker is faster."""


@drawn
def profiles(scenes: Sequence[SceneRows], norm: Norm, look: Mapping[str, Look], clock: str = "solve") -> Figure:
    """Return performance profiles, a panel per tolerance: how often a method is within a ratio of the best.

    References
    ----------
    DolanMore2002, section 2.
    """
    tables = [ranking(scenes, norm, tolerance, clock) for tolerance in TOLERANCES]
    told = list(dict.fromkeys(s.method for table in tables for s in table[:NAMED] if s.ratios))
    look, names = {**look, **told_apart(told, look)}, [shortened(method, 30) for method in told]
    room = 0.35 + LETTER * max(map(len, names), default=8)
    figure, rows = grid(len(TOLERANCES), 1, 2.15, Margins(right=room, down=0.65))
    for (axis,), tolerance, table in zip(rows, TOLERANCES, tables, strict=True):
        kept = judged(scenes, norm, tolerance).scenes
        axis.set_title(f"tolerance {power(tolerance)}, {len(kept)} scene{'s' if len(kept) != 1 else ''}")
        axis.set_xscale("log")
        axis.set_xlim(1.0, FURTHEST)
        axis.set_ylim(0.0, 1.02)
        axis.set_ylabel("share of scenes")
        axis.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        named = [standing.method for standing in table if standing.ratios][:NAMED]
        _curves(axis, table, look, named)
    rows[-1][0].set_xlabel("at most this many times the time of the fastest method that meets the tolerance")
    return figure


def _curves(axis: Axes, table: Sequence[Standing], look: Mapping[str, Look], named: Sequence[str]) -> None:
    ends = []
    for standing in reversed(table):
        steps = profile(standing)
        if not steps:
            continue
        told = standing.method in named
        colour = look[standing.method].colour if told else GREY
        x = [1.0, *(ratio for ratio, _ in steps), FURTHEST]
        y = [0.0, *(share for _, share in steps), steps[-1][1]]
        width = 1.7 if told else 0.5
        axis.step(
            x, y, where="post", color=colour, linewidth=width, alpha=1.0 if told else 0.7, zorder=3 if told else 2
        )
        if told:
            marked = [(r, s) for r, s in steps if r <= FURTHEST]
            axis.plot(*zip(*marked, strict=True), look[standing.method].shape, color=colour, markersize=3.6, zorder=3)
            reached = max((s for r, s in marked), default=0.0)
            ends.append(End(FURTHEST, reached, shortened(standing.method, 30), colour))
    name_ends(axis, ends)


@drawn
def chart(scenes: Sequence[SceneRows], norm: Norm, tolerance: float, clock: str = "solve") -> Figure:
    """Return a map: a row per method, a column per scene; the darker, the nearer to the fastest that meets it."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    kept, table = judged(scenes, norm, tolerance).scenes, ranking(scenes, norm, tolerance, clock)
    left = room_for([*(shortened(standing.method, 40) for standing in table)])
    longest = max((len(scene.name) for scene in kept), default=4)
    high, foot = 0.19, 0.2 + 0.062 * longest
    height = 0.62 + high * len(table) + foot
    figure = Figure(figsize=(WIDTH, height))
    width = min(WIDTH - left - 0.9, 0.42 * max(1, len(kept)))
    axis = figure.add_axes((left / WIDTH, foot / height, width / WIDTH, high * len(table) / height))
    for row, standing in enumerate(table):
        for column, each in enumerate(standing.results):
            if each.outcome == MET and each.ratio is not None:
                colour = next(colour for most, colour in STEPS if each.ratio <= most)
                axis.add_patch(Rectangle((column + 0.04, row + 0.06), 0.92, 0.88, color=colour, linewidth=0))
                if each.ratio <= 1.0:
                    axis.plot([column + 0.5], [row + 0.5], "o", color="#ffffff", markersize=3.2)
            else:
                mark = {MET: "+", MISSED: "·", REFUSED: "–", FAILED: "×", ABSENT: ""}.get(each.outcome, "?")
                tint = PALETTE[1] if each.outcome == FAILED else MUTED
                axis.text(column + 0.5, row + 0.52, mark, ha="center", va="center", fontsize=8, color=tint)
        axis.text(len(kept) + 0.25, row + 0.52, f"{standing.count(MET)}", va="center", fontsize=7.5, color=INK)
    axis.set_xlim(0, max(1, len(kept)))
    axis.set_ylim(max(1, len(table)), 0)
    axis.set_yticks([i + 0.5 for i in range(len(table))], [shortened(s.method, 40) for s in table], fontsize=7.5)
    axis.set_xticks([i + 0.5 for i in range(len(kept))], [scene.name for scene in kept], fontsize=7.5)
    for label in axis.get_xticklabels():
        label.set(rotation=50, ha="right", rotation_mode="anchor")
    axis.tick_params(length=0)
    axis.grid(visible=False)
    for spine in axis.spines.values():
        spine.set_visible(False)
    for row in range(len(table) + 1):
        axis.axhline(row, color=GRID, linewidth=0.4, zorder=0.5)
    _scale(figure, axis, height)
    return figure


def _scale(figure: Figure, axis: Axes, height: float) -> None:
    """Write the legend of a map above it."""
    from matplotlib.patches import Rectangle

    x, y = 0.1 / WIDTH, 1.0 - 0.24 / height
    words = ("fastest to 1.5 times", "to 3", "to 10", "to 30", "more")
    for (_, colour), word in zip(STEPS, words, strict=True):
        box = Rectangle((x, y - 0.055 / height), 0.11 / WIDTH, 0.11 / height, color=colour, linewidth=0)
        figure.add_artist(box)
        figure.text(x + 0.16 / WIDTH, y, word, fontsize=7.5, va="center")
        x += (0.33 + 0.055 * len(word)) / WIDTH
    figure.text(
        x + 0.1 / WIDTH,
        y,
        "·  missed    –  refused    ×  failed    ?  no number",
        fontsize=7.5,
        va="center",
        color=MUTED,
    )
    axis.set_title("met in", loc="right", fontsize=7.5, fontweight="normal", color=MUTED, pad=3.0)
