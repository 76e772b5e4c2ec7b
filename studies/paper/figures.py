"""Figures 2 and 4 to 11 of the paper, drawn again from runs.

Dark lines are the exact solution of the continuous rod, coloured ones are computed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from impactlab.history import AbstractHistory
from impactlab.report.figures.style import GRID, INK, MUTED, PALETTE, Margins, curve, grid
from studies.paper.by_hand import face_flight, paper_flight
from studies.paper.problem import (
    FACE,
    FORCE,
    MASS,
    PLAIN,
    REACTION,
    SEGMENT,
    SNAPSHOTS,
    SPEED,
    STRESS,
    WAVE,
    Method,
    T,
    Z,
    at,
    computed,
    event,
    exact,
    modal,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BLUE, RED = PALETTE[0], PALETTE[1]
COMPUTED, EXACT = 2.0, 0.9  # line widths: the exact line stays visible on top of a computed one
PANEL = 2.9  # inches


class Drawing(NamedTuple):
    """A figure of the paper."""

    number: int
    title: str
    see: str  # observation that it supports
    draw: Callable[[], Figure]


def line(axes: Axes, history: AbstractHistory, channel: str, size: float, colour: str, width: float) -> None:
    """Draw a channel over the whole run, time in T, values divided by ``size``."""
    t, values = curve(history, channel, history.duration)
    axes.plot(t / T, values / size, color=colour, linewidth=width, solid_capstyle="butt")


def legend(axes: Axes, names: Sequence[tuple[str, str]], x: float = 0.985, y: float = 0.95, right: bool = True) -> None:
    """Write the names of lines, each in its colour.

    They are one below the other; places are shares of the axes.
    """
    height = 11.5 / 72.0 / PANEL
    for place, (name, colour) in enumerate(names):
        axes.text(
            x,
            y - place * height,
            name,
            color=colour,
            transform=axes.transAxes,
            ha="right" if right else "left",
            va="top",
        )


def over_time(axes: Axes, label: str) -> None:
    axes.set_xlim(0.0, 3.0)
    axes.set_xlabel("time  t / T")
    axes.set_ylabel(label)
    axes.axhline(0.0, color=GRID, linewidth=0.9, zorder=0.5)


def flight() -> Figure:
    """Return Fig. 2: mass and free face after the first contact."""
    figure, [[whole, close]] = grid(1, 2, PANEL, Margins(across=0.7))
    opening, speed = event(exact(), 1), -at(exact(), SPEED, 1.8)
    start = exact().evaluate(opening * T, MASS)
    t = np.linspace(opening, 2.5, 2001)
    for channel, colour in ((MASS, RED), (FACE, INK)):
        whole.plot(t, -(exact().evaluate(t * T, channel) - start) / T, color=colour, linewidth=1.8)
    whole.axvspan(event(exact(), 2), event(exact(), 3), color=GRID, linewidth=0)
    whole.set_xlim(1.5, 2.5)
    whole.set_xlabel("time  t / T")
    whole.set_ylabel("way back since the opening  /  v0 T")
    legend(whole, (("concentrated mass", RED), ("free section of the rod", INK)), x=0.03, right=False)
    whole.text(2.10, 0.05, "second\ncontact", color=MUTED, ha="right", fontsize=8.0)
    # The distance between both, as if there were no second contact: its zeros are the touch.
    t = np.linspace(2.0, 2.36, 1501)
    gap = [speed * (value - opening) - face_flight(float(value), opening) for value in t]
    printed = [0.688 * (value - 1.534) - paper_flight(float(value - 1.534)) for value in t]
    close.axhline(0.0, color=MUTED, linewidth=0.7)
    close.plot(t, 1e3 * np.array(printed), color=BLUE, linewidth=1.8, linestyle=(0, (4, 1.5)))
    close.plot(t, 1e3 * np.array(gap), color=INK, linewidth=1.4)
    for place, colour, (dx, dy), side in (
        (event(exact(), 2), INK, (-0.02, -3.3), "right"),
        (2.1284, BLUE, (0.02, 2.4), "left"),
    ):
        close.plot([place], [0.0], "o", color=colour, markersize=4.5, zorder=5)
        close.annotate(
            f"{place:.4f}", (place, 0.0), (place + dx, dy), color=colour, ha=side, va="center",
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.7, "shrinkB": 3.0},
        )  # fmt: skip
    close.set_xlim(2.0, 2.36)
    close.set_ylim(-11.0, 21.0)
    close.set_xlabel("time  t / T")
    close.set_ylabel("distance of mass and free face  /  0.001 v0 T")
    legend(close, (("exact", INK), ("printed constants (Eqs. 11, 12)", BLUE)), x=0.97, y=0.19)
    return figure


def displacements(modes: int) -> Figure:
    """Return Figs 4 and 5: displacement of the free section and of the mass."""
    figure, [[axes]] = grid(1, 1, PANEL)
    history = computed(modal(modes, modes, PLAIN))
    for channel, colour in ((MASS, RED), (FACE, BLUE)):
        line(axes, history, channel, T, colour, COMPUTED)
        line(axes, exact(), channel, T, INK, EXACT)
    over_time(axes, "displacement  u / v0 T")
    axes.set_ylim(-1.0, 0.6)
    legend(
        axes,
        ((f"free section, {modes} modes", BLUE), (f"concentrated mass, {modes} modes", RED), ("exact, both", INK)),
    )
    return figure


def contact_stress(modes: int) -> Figure:
    """Return Figs 6 and 7: the contact stress."""
    figure, [[axes]] = grid(1, 1, PANEL)
    line(axes, computed(modal(modes, modes, PLAIN)), FORCE, Z, BLUE, COMPUTED)
    line(axes, exact(), FORCE, Z, INK, EXACT)
    over_time(axes, "contact stress  σ / ρ c v0")
    axes.set_ylim(-0.08, 2.3)
    legend(axes, ((f"{modes} modes of {modes} elements", BLUE), ("exact", INK)))
    return figure


def wave(t: float) -> Figure:
    """Return Figs 8 to 10: stress along the rod.

    It is shown as printed and with the stress of the modes left out.
    """
    figure, [panels] = grid(1, 2, PANEL, Margins(across=0.3), share=True)
    field = exact().field("rod", t, "stress")
    sides = [round(front(t) * SEGMENT.length, 6) + side for side in (-2e-6, 2e-6)]
    beside = [float(exact().evaluate(t, f"stress:rod@{x:.6g}")) for x in sides]
    order = np.argsort(np.append(field.x, sides))
    x_exact = np.append(field.x, sides)[order] / SEGMENT.length
    true = np.append(field.values, beside)[order] / STRESS
    named = ((PLAIN, BLUE, "70 of 100 modes, as printed"), (WAVE, RED, "70 of 100 modes, with residual"))
    for axes, (law, colour, name) in zip(panels, named, strict=True):
        field = computed(modal(100, 70, law)).field("rod", t, "stress")
        # The stress of an element is constant: a step from node to node.
        axes.step(field.x / SEGMENT.length, field.values / STRESS, where="post", color=colour, linewidth=1.6)
        axes.plot(x_exact, true, color=INK, linewidth=EXACT)
        axes.axhline(0.0, color=GRID, linewidth=0.9, zorder=0.5)
        axes.set_xlim(0.0, 1.0)
        axes.set_xlabel("place  x / L")
        axes.set_title(name, color=colour)
    panels[1].set_title("exact", loc="right", color=INK)
    panels[0].set_title("exact", loc="right", color=INK)
    panels[0].set_ylabel("stress  σ / ρ c v0")
    panels[0].set_ylim(*((-0.06, 1.75) if t > 0.5 * T else (-0.32, 1.2)))
    panels[1].text(
        0.985, 0.94, f"t = {t * 1e6:.4g} µs = {t / T:.4g} T", color=MUTED, ha="right", va="top",
        transform=panels[1].transAxes,
    )  # fmt: skip
    return figure


def front(t: float) -> float:
    """Return where the first front is [L]."""
    way = t * SEGMENT.wave_speed / SEGMENT.length
    return way if way < 1.0 else 2.0 - way


def clamp() -> Figure:
    """Return Fig. 11: the stress at the clamped end."""
    figure, [[axes]] = grid(1, 1, PANEL)
    line(axes, computed(Method(modal(40, 40, PLAIN).model, PLAIN)), REACTION, STRESS, BLUE, 1.4)
    line(axes, exact(), REACTION, STRESS, INK, EXACT)
    over_time(axes, "stress at the clamped end  σ / ρ c v0")
    legend(axes, (("40 modes of 40 elements", BLUE), ("exact", INK)))
    return figure


FIGURES = (
    Drawing(
        2,
        "Mass and free face after the first contact",
        "Left: the face swings back and catches the mass once more (grey). Right: their distance, had there been no "
        "second contact, enlarged. It dips only 0.006 v0 T below zero, so constants rounded to four digits move the "
        "touch from 2.1246 T to 2.1284 T.",
        flight,
    ),
    Drawing(
        4,
        "Displacements, 10 modes of 10 elements",
        "The mass is right to the eye and leaves a little too fast; the second contact, near 2.13 T, does not happen.",
        lambda: displacements(10),
    ),
    Drawing(
        5,
        "Displacements, 40 modes of 40 elements",
        "Both curves lie on the exact ones.",
        lambda: displacements(40),
    ),
    Drawing(
        6,
        "Contact stress, 10 modes of 10 elements",
        "The contact is interrupted before the reflection arrives at T, the peak of 2.135 is not reached, and the end "
        "near 1.53 T is right. The small exact pulse at 2.12 T is the second contact.",
        lambda: contact_stress(10),
    ),
    Drawing(
        7,
        "Contact stress, 40 modes of 40 elements",
        "The same with more modes: a ripple of short waves runs ahead of the reflection, the peak is nearer, and a "
        "second contact appears, later and weaker than the exact one.",
        lambda: contact_stress(40),
    ),
    Drawing(
        8,
        "Stress along the rod before the reflection, 70 of 100 modes",
        "Left: through 70 of 100 free-end modes the messenger misses a part of the stress, and the wave comes out too "
        "low. Right: with the stress of the modes left out it has the right height.",
        lambda: wave(SNAPSHOTS[0]),
    ),
    Drawing(
        9,
        "The same, later",
        "The front stands where it should, with ripples ahead of it: short waves of a consistent mass run faster than "
        "c.",
        lambda: wave(SNAPSHOTS[1]),
    ),
    Drawing(
        10,
        "The same, after the reflection at the clamped end",
        "The caption in the paper repeats the time of Fig. 9, at which the wave has not yet reached the end; this is "
        "at 80 µs, when the reflected front is back at 0.625 L.",
        lambda: wave(SNAPSHOTS[2]),
    ),
    Drawing(
        11,
        "Stress at the clamped end, 40 modes of 40 elements",
        "Exactly nothing until the wave arrives at T/2. The modes shake the clamp before that, by up to 0.4 and "
        "without mean, and the peaks are too low, as those of the contact stress.",
        clamp,
    ),
)

PAGE = """\
# The paper's figures, drawn again

<!-- Written by `python -m studies paper`; edit studies/paper/figures.py, not this page. -->

Figures 2 and 4 to 11 of EscalonaMayoDominguez1999 (Section 3, p. 770, and Section 6, p. 775-778) from runs of this
package. The exact solution of the continuous rod is dark, what was computed is coloured. T = 2L/c = 116.37 µs,
v0 = 1 m/s. The scheme is Newmark with ten points in the shortest period. What each claim comes to in numbers:
[the ledger](../ledger.md).
Figures 1 and 3 of the paper are sketches.
"""


def captions(_: str) -> str:
    """Return the page of the figures."""
    lines = [PAGE]
    for item in FIGURES:
        lines.append(
            f"## Fig. {item.number}. {item.title}\n\n![{item.title}](figure_{item.number:02d}.svg)\n\n{item.see}\n"
        )
    return "\n".join(lines)
