"""The figure of a mechanism: to scale at the start, where each contact begins, and at the end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.report.style import INK, MUTED, PALETTE, Margins, drawn, grid
from impactlab.scene.bodies import Mechanism
from impactlab.scene.problem import Scene
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_DRAWN = 6  # contacts whose beginning is drawn
ROOM = 0.12  # of the size of the mechanism, around it


def joints(history: AbstractHistory, mechanism: Mechanism, time: float) -> Array:
    """Return the places of ground hinge, joints and end, (n_links + 1, 2) [m]; links are drawn straight."""
    angles = [float(history.evaluate([time], f"angle:{link.name}")[0]) for link in mechanism.links]
    lengths = np.array([link.length for link in mechanism.links])
    steps = lengths[:, None] * np.column_stack((np.cos(angles), np.sin(angles)))
    return np.vstack((np.zeros((1, 2)), np.cumsum(steps, axis=0)))


@drawn
def positions(history: AbstractHistory, scene: Scene, name: str) -> Figure:
    """Return the mechanism at the start, where contacts begin, and at the end, with the path of its end between."""
    mechanism = scene.bodies[name]
    if not isinstance(mechanism, Mechanism):
        raise TypeError(f"{name} is no mechanism")
    path = np.array([joints(history, mechanism, t)[-1] for t in np.linspace(0.0, history.duration, 200)])
    begun = [span.start for span in history.contacts if name in _bodies(scene, span.contact)][:MAX_DRAWN]
    figure, ((axis,),) = grid(1, 1, 3.2, Margins())
    axis.plot(path[:, 0], path[:, 1], color=MUTED, linewidth=0.8, linestyle=":", label="path of the end")
    for time, colour, width, label in (
        (0.0, MUTED, 2.0, "start"),
        *((time, PALETTE[0], 1.2, "contact begins" if number == 0 else "_") for number, time in enumerate(begun)),
        (history.duration, INK, 2.0, "end"),
    ):
        places = joints(history, mechanism, time)
        axis.plot(places[:, 0], places[:, 1], color=colour, linewidth=width, marker="o", markersize=4, label=label)
    if mechanism.slide is not None:
        axis.axhline(mechanism.slide, color=MUTED, linewidth=0.6)
    axis.set_aspect("equal", adjustable="datalim")
    axis.margins(ROOM)
    axis.set_xlabel("x in m")
    axis.set_ylabel("y in m")
    axis.legend(loc="best", fontsize=8, frameon=False)
    return figure


def _bodies(scene: Scene, contact: str) -> tuple[str, str]:
    found = next(each for each in scene.contacts if each.name == contact)
    return found.left.body, found.right.body
