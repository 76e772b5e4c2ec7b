"""Figures over all scenes: performance profiles, and a map of times to a tolerance by method and scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from impactlab.bench.report.method_styles import (
    GREY,
    End,
    MethodStyles,
    distinct,
    name_ends,
    power,
    room_beside,
    shortened,
)
from impactlab.bench.report.ranking import (
    ABSENT,
    FAILED,
    MET,
    MISSED,
    REFUSED,
    MethodResults,
    comparable,
    profile,
    ranking,
)
from impactlab.bench.report.views import TOLERANCES, Norm, SceneRows
from impactlab.printing import counted
from impactlab.report.figures.style import GRID, INK, MUTED, PALETTE, WIDTH, Margins, drawn, grid, room_for

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_RATIO = 300.0  # the largest ratio that a profile shows
MAX_NAMED = 9  # methods that a profile names
SHADES = (
    (1.5, "#0b6e5d", "fastest to 1.5 times"),
    (3.0, "#36a48e", "to 3"),
    (10.0, "#8fcdbd", "to 10"),
    (30.0, "#c9e4dc", "to 30"),
    (float("inf"), "#e6f1ee", "more"),
)
"""Colours of the map by time over that of the fastest: darker is faster."""
MARKS = {MET: "+", MISSED: "·", REFUSED: "–", FAILED: "×", ABSENT: ""}


@drawn
def profiles(scenes: Sequence[SceneRows], norm: Norm, styles: MethodStyles, clock: str = "solve") -> Figure:
    """Return performance profiles, a panel per tolerance.

    They show how often a method is within a ratio of the fastest.

    References
    ----------
    DolanMore2002, section 2.
    """
    tables = [ranking(scenes, norm, tolerance, clock) for tolerance in TOLERANCES]
    named = [_named([standing.method for standing in table if standing.ratios], styles) for table in tables]
    every = list(dict.fromkeys(method for found in named for method in found))
    styles = distinct(every, styles)
    figure, rows = grid(len(TOLERANCES), 1, 2.15, Margins(right=room_beside(every), down=0.65))
    for (axes,), tolerance, table, found in zip(rows, TOLERANCES, tables, named, strict=True):
        count = len(comparable(scenes, norm, tolerance).scenes)
        axes.set_title(f"tolerance {power(tolerance)}, {counted(count, 'scene')}")
        axes.set_xscale("log")
        axes.set_xlim(1.0, MAX_RATIO)
        axes.set_ylim(0.0, 1.02)
        axes.set_ylabel("share of scenes")
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        _curves(axes, table, styles, found)
        others = sum(bool(standing.ratios) and standing.method not in found for standing in table)
        if others:
            words = f"grey: {counted(others, 'other method')}"
            axes.set_title(words, loc="right", fontsize=7.5, fontweight="normal", color=MUTED)
    rows[-1][0].set_xlabel("at most this many times the time of the fastest method that meets the tolerance")
    return figure


def _named(methods: Sequence[str], styles: MethodStyles) -> list[str]:
    """Return the best methods, and those without steps: a dark line always has its name."""
    return [method for place, method in enumerate(methods) if place < MAX_NAMED or styles[method].colour == INK]


def _curves(axes: Axes, table: Sequence[MethodResults], styles: MethodStyles, named: Sequence[str]) -> None:
    ends = []
    for standing in reversed(table):
        steps, known = profile(standing), standing.method in named
        if not steps:
            continue
        ratios, shares = zip(*steps, strict=True)
        colour, shape = styles[standing.method] if known else (GREY, "")
        width, alpha, order = (1.7, 1.0, 3) if known else (0.5, 0.7, 2)
        x, y = [1.0, *ratios, MAX_RATIO], [0.0, *shares, shares[-1]]
        axes.step(x, y, where="post", color=colour, linewidth=width, alpha=alpha, zorder=order)
        if known:
            marked = [step for step in steps if step[0] <= MAX_RATIO]
            axes.plot(*zip(*marked, strict=True), shape, color=colour, markersize=3.6, zorder=3)
            ends.append(End(MAX_RATIO, marked[-1][1] if marked else 0.0, standing.method, colour))
    name_ends(axes, ends)


@drawn
def chart(scenes: Sequence[SceneRows], norm: Norm, tolerance: float) -> Figure:
    """Return a map with a row per method, a column per scene.

    The darker a cell, the nearer is the method to the fastest that meets the tolerance.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    kept, table = comparable(scenes, norm, tolerance).scenes, ranking(scenes, norm, tolerance)
    names = [shortened(standing.method, 40) for standing in table]
    left, high = room_for(names), 0.19
    foot = 0.2 + 0.062 * max((len(scene.name) for scene in kept), default=4)
    height = 0.62 + high * len(table) + foot
    figure = Figure(figsize=(WIDTH, height))
    width = min(WIDTH - left - 0.9, 0.42 * max(1, len(kept)))
    axes = figure.add_axes((left / WIDTH, foot / height, width / WIDTH, high * len(table) / height))
    for row, standing in enumerate(table):
        for column, each in enumerate(standing.results):
            if each.ratio is not None:
                colour = next(colour for most, colour, _ in SHADES if each.ratio <= most)
                axes.add_patch(Rectangle((column + 0.04, row + 0.06), 0.92, 0.88, color=colour, linewidth=0))
                if each.ratio <= 1.0:
                    axes.plot([column + 0.5], [row + 0.5], "o", color="#ffffff", markersize=3.2)
            else:
                mark, tint = MARKS.get(each.outcome, "?"), PALETTE[1] if each.outcome == FAILED else MUTED
                axes.text(column + 0.5, row + 0.52, mark, ha="center", va="center", fontsize=8, color=tint)
        axes.text(len(kept) + 0.25, row + 0.52, f"{standing.count(MET)}", va="center", fontsize=7.5, color=INK)
        axes.axhline(row, color=GRID, linewidth=0.4, zorder=0.5)
    axes.axhline(len(table), color=GRID, linewidth=0.4, zorder=0.5)
    axes.set_xlim(0, max(1, len(kept)))
    axes.set_ylim(max(1, len(table)), 0)
    axes.set_yticks([i + 0.5 for i in range(len(table))], names, fontsize=7.5)
    axes.set_xticks([i + 0.5 for i in range(len(kept))], [scene.name for scene in kept], fontsize=7.5)
    for label in axes.get_xticklabels():
        label.set(
            rotation=90, ha="right", va="center", rotation_mode="anchor", fontsize=min(7.5, 72.0 * width / len(kept))
        )
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    axes.set_title("met in", loc="right", fontsize=7.5, fontweight="normal", color=MUTED, pad=3.0)
    _legend(figure, height)
    return figure


def _legend(figure: Figure, height: float) -> None:
    """Write the legend of a map above it."""
    from matplotlib.patches import Rectangle

    x, y = 0.1 / WIDTH, 1.0 - 0.24 / height
    for _, colour, words in SHADES:
        box = Rectangle((x, y - 0.055 / height), 0.11 / WIDTH, 0.11 / height, color=colour, linewidth=0)
        figure.add_artist(box)
        figure.text(x + 0.16 / WIDTH, y, words, fontsize=7.5, va="center")
        x += (0.33 + 0.055 * len(words)) / WIDTH
    text = "·  missed    –  refused    ×  failed    ?  no number"
    figure.text(x + 0.1 / WIDTH, y, text, fontsize=7.5, va="center", color=MUTED)
