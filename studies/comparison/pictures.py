"""The figures of the page on the periodic and bouncing bars.

They are the periodic bar under four methods, and the energy of the bouncing bar.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from impactlab import metrics
from impactlab.report.figures.style import GRID, INK, MUTED, PALETTE, Margins, curve, grid, label_lines
from studies.comparison.bouncing import BOUNCES, EVERY, FIRST, LAST, bounced, mechanical
from studies.comparison.periodic import PRESSURE, exact
from studies.comparison.schemes import (
    BATHE,
    CONSERVING,
    EXPLICIT,
    MASSLESS,
    MOREAU,
    SPRING,
    STABILISED,
    TRAP,
    TRAP_MIDDLE,
    ran,
    scene_of,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ELEMENTS = 80
TELLING = (
    (TRAP, "Hard constraint, textbook Newmark", PALETTE[1]),
    (MOREAU, "Velocity complementarity, Moreau-Jean", PALETTE[4]),
    (MASSLESS, "Redistributed mass, midpoint", PALETTE[2]),
    (BATHE, "Penalty, Bathe", PALETTE[0]),
)
TOP = 2.3  # of the pressure axes, over the exact pressure


def periodic_bar() -> Figure:
    """Return tip displacement and pressure of four methods against the exact solution."""
    figure, axes = grid(len(TELLING), 2, 1.15, Margins(left=0.62, across=0.62, down=0.52, top=0.34))
    for (scheme, title, colour), (tip, force) in zip(TELLING, axes, strict=True):
        scene = scene_of("periodic_bar", scheme, ELEMENTS)
        history = ran(scene).history
        assert history is not None
        [face], [pressure] = metrics.face_channels(scene.scene), metrics.force_channels(scene.scene)
        for panel, channel, size in ((tip, face, 1.0), (force, pressure, PRESSURE)):
            for one, shade, width in ((history, colour, 1.3), (exact(), INK, 0.9)):
                t, values = curve(one, channel, scene.scene.duration)
                panel.plot(t, values / size, color=shade, linewidth=width, zorder=3 if one is not history else 2)
            panel.set_xlim(0.0, scene.scene.duration)
            panel.set_xticks(range(0, 13, 3))
        peak = float(history.evaluate(metrics.midpoints(scene.scene.duration, 40_000), pressure).max()) / PRESSURE
        tip.set_ylim(-0.1, 0.95 if scheme is TRAP else 0.65)
        force.set_ylim(-0.15, TOP)
        tip.set_title(title, color=colour)
        if peak > TOP:
            force.set_title(f"peaks up to {peak:.0f} are cut off", color=MUTED, fontweight="normal", fontsize=8.0)
        tip.set_ylabel("tip  u")
        force.set_ylabel("pressure  / 0.5")
    axes[0][0].text(0.99, 0.97, "dark: exact", color=INK, transform=axes[0][0].transAxes, ha="right", va="top")
    for panel in axes[-1]:
        panel.set_xlabel("time  t  [s], a period is 3 s")
    return figure


LINES = (  # with widths: three of them lie on top of each other
    (TRAP_MIDDLE, "addition_deletion, newmark (grows)", PALETTE[1], 1.6),
    (SPRING, "penalty, midpoint", PALETTE[0], 4.5),
    (CONSERVING, "energy_conserving, midpoint", PALETTE[3], 2.7),
    (MASSLESS, "redistributed mass, midpoint", PALETTE[2], 1.2),
    (MOREAU, "velocity_complementarity, moreau_jean", PALETTE[4], 1.6),
    (EXPLICIT, "addition_deletion, central_difference", PALETTE[5], 1.6),
    (BATHE, "penalty, bathe", PALETTE[7], 1.6),
    (STABILISED, "addition_deletion, contact_stabilised", PALETTE[8], 1.6),
)


def bouncing_bar() -> Figure:
    """Return the energy of the bouncing bar against the number of exact bounces."""
    figure, [[axes]] = grid(1, 1, 3.3, Margins(right=2.65))
    axes.axhline(0.0, color=GRID, linewidth=1.0)
    axes.set_xlim(0.0, BOUNCES)
    axes.set_ylim(-0.08, 1.6)
    ends = []
    for scheme, name, colour, width in LINES:
        history = bounced(scheme, 100).history
        assert history is not None
        bounce = (history.energy.time - FIRST - LAST) / EVERY + 1.0
        energy = mechanical(history)
        axes.plot(np.maximum(bounce, 0.0), energy, color=colour, linewidth=width)
        ends.append((float(min(energy[-1], 1.58)), name, colour))
    axes.set_xlabel("time, in bounces of the exact solution")
    axes.set_ylabel("mechanical energy  /  500 J")
    label_lines(axes, ends)
    return figure
