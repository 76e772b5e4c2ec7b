"""A mechanism to scale, in figures and on a page.

Figures show it at the start, where contacts begin and at the end; a page shows its motion.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.report.figures.style import INK, MUTED, PALETTE, PAPER, Margins, drawn, grid
from impactlab.scene.bodies import Mechanism
from impactlab.scene.problem import Scene
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_DRAWN = 6  # contacts whose beginning is drawn
MARGIN = 0.12  # of the size of the mechanism, around it
SQUARE = 12.0  # points, the side of a body that a link meets


def joints(history: AbstractHistory, mechanism: Mechanism, times: Array) -> Array:
    """Return places [m] of hinge, joints and end, (n_times, n_links + 1, 2), of straight links."""
    angles = np.array([history.evaluate(times, f"angle:{link.name}") for link in mechanism.links])
    lengths = np.array([link.length for link in mechanism.links])
    steps = lengths[:, None, None] * np.stack((np.cos(angles), np.sin(angles)), axis=2)
    return np.concatenate((np.zeros((1, len(times), 2)), np.cumsum(steps, axis=0))).transpose(1, 0, 2)


def chains(scene: Scene) -> list[Mechanism]:
    """Return the mechanisms of a scene that can be drawn: chains of links."""
    return [body for body in scene.bodies.values() if isinstance(body, Mechanism)]


def met(scene: Scene) -> list[dict[str, Any]]:
    """Return contacts of chains as page.js draws them.

    An entry has the place on a link, the direction, and the other body.
    """
    found = []
    for number, contact in enumerate(scene.contacts):
        for here, there, sign in ((contact.left, contact.right, 1), (contact.right, contact.left, -1)):
            body, other = scene.bodies[here.body], scene.bodies[there.body]
            if isinstance(body, Mechanism):
                mark = body.marks[int(here.x)]
                share = mark.x / body.links[mark.link].length
                found.append(
                    {"contact": number, "chain": body.name, "link": mark.link, "share": share, "along": mark.along}
                    | {"sign": sign, "kind": other.kind, "name": other.name}
                )
    return found


def moving(
    axis: Axes, history: AbstractHistory, mechanisms: Sequence[Mechanism], times: Array, mark: str
) -> Callable[[int], None]:
    """Draw mechanisms to scale; return the function that moves them.

    Lines are marked as moving; the function moves them to one of the times.
    """
    drawn_at = []
    for mechanism in mechanisms:
        places = joints(history, mechanism, times)
        if mechanism.slide is not None:
            axis.axhline(mechanism.slide, color=MUTED, linewidth=0.6)
        axis.plot(places[:, -1, 0], places[:, -1, 1], color=MUTED, linewidth=0.8, linestyle=":")
        (line,) = axis.plot([], [], color=INK, linewidth=2.5, marker="o", markersize=5, gid=mark)
        drawn_at.append((line, places))
    every = np.concatenate([places.reshape(-1, 2) for _, places in drawn_at])
    low, high = every.min(axis=0), every.max(axis=0)
    room = MARGIN * float((high - low).max())
    axis.set_xlim(low[0] - room, high[0] + room)
    axis.set_ylim(low[1] - room, high[1] + room)
    axis.set_aspect("equal")
    axis.axis("off")

    steps = [
        _beside(axis, history, places, entry, times, mark)
        for mechanism, (_, places) in zip(mechanisms, drawn_at, strict=True)
        for entry in met(history.scene)
        if entry["chain"] == mechanism.name
    ]

    def step(number: int) -> None:
        for line, places in drawn_at:
            line.set_data(places[number].T)
        for each in steps:
            each(number)

    return step


def _beside(
    axis: Axes, history: AbstractHistory, places: Array, entry: dict[str, Any], times: Array, mark: str
) -> Callable[[int], None]:
    """Draw a body that a link meets, a square beside its face; walls are hatched."""
    from matplotlib.transforms import ScaledTranslation

    way = entry["sign"] * np.array(entry["along"])
    link = entry["link"]
    face = places[:, link] + entry["share"] * (places[:, link + 1] - places[:, link])
    gap = history.evaluate(times, f"gap:{history.scene.contacts[entry['contact']].name}")
    inside, hatch = (PAPER, "////") if entry["kind"] == "wall" else (INK, None)
    square = axis.scatter([], [], SQUARE**2, inside, marker="s", edgecolors=INK, hatch=hatch, clip_on=False, gid=mark)
    x, y = (0.7 * SQUARE / 72.0 * way).tolist()  # inches
    inches = axis.figure.dpi_scale_trans
    square.set_offset_transform(axis.transData + ScaledTranslation(x, y, inches))

    def step(number: int) -> None:
        square.set_offsets([face[number] + gap[number] * way])

    return step


@drawn
def positions(history: AbstractHistory, scene: Scene, mechanism: Mechanism) -> Figure:
    """Return a figure of the mechanism at start, contacts and end.

    Contacts are shown where they begin, with the path of the end between.
    """
    path = joints(history, mechanism, np.linspace(0.0, history.duration, 200))[:, -1]
    own = {each.name for each in scene.contacts if mechanism.name in (each.left.body, each.right.body)}
    begun = [span.start for span in history.contacts if span.contact in own][:MAX_DRAWN]
    figure, ((axis,),) = grid(1, 1, 3.2, Margins())
    axis.plot(path[:, 0], path[:, 1], color=MUTED, linewidth=0.8, linestyle=":", label="path of the end")
    for time, colour, width, label in (
        (0.0, MUTED, 2.0, "start"),
        *((time, PALETTE[0], 1.2, "contact begins" if number == 0 else "_") for number, time in enumerate(begun)),
        (history.duration, INK, 2.0, "end"),
    ):
        places = joints(history, mechanism, np.array([time]))[0]
        axis.plot(places[:, 0], places[:, 1], color=colour, linewidth=width, marker="o", markersize=4, label=label)
    if mechanism.slide is not None:
        axis.axhline(mechanism.slide, color=MUTED, linewidth=0.6)
    axis.set_aspect("equal", adjustable="datalim")
    axis.margins(MARGIN)
    axis.set_xlabel("x  [m]")
    axis.set_ylabel("y  [m]")
    axis.legend(loc="best", fontsize=8, frameon=False)
    return figure
