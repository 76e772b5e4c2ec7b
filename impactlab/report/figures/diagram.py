"""The Lagrange diagram: load over place, all bodies end to end, and time (upwards), with events."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from impactlab.errors import ImpactlabError
from impactlab.history.base import AbstractHistory
from impactlab.history.sampling import frame_times
from impactlab.prefixes import Unit, scaled
from impactlab.report.figures.signals import UNITS
from impactlab.report.figures.stage import frames, layout, shown_load
from impactlab.report.figures.style import INK, LETTER, MUTED, PAPER, Margins, clock, drawn, grid, is_narrow
from impactlab.scene.problem import Scene
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NAME_SIZE, LETTER_SIZE = 7.5, 10.0  # points, of a body's name and of the letter whose width is known
FINE_PLACES = 361  # along a body, at most
MIN_PLACES, ALL_PLACES = 9, 4000  # along a short body of many; of all bodies, more than a figure has dots
MEANING = {"stress": "stress σ", "torque": "torque T", "displacement": "deflection u"}


def has_waves(history: AbstractHistory, scene: Scene) -> bool:
    """Return whether a history has a body's load at the page's frames."""
    return any(entry["load"] is not None for entry in frames(history, scene).values())


@drawn
def lagrange(history: AbstractHistory, scene: Scene) -> Figure:
    """Return the Lagrange diagram of a history.

    Of a body whose fields it does not keep, only the contacts are drawn.
    """
    spots, time = layout(scene), clock(scene)
    loads = _loads(history, scene)
    elastic = {name: body for name, body in scene.elastic.items() if name in loads}
    quantities = dict.fromkeys(shown_load(body) for body in elastic.values())
    whole = max((spots[name].x + body.length for name, body in elastic.items()), default=1.0)
    place = scaled("m", whole)
    figure, ((axis,),) = grid(1, 1, 2.6 if is_narrow() else 3.6, Margins(top=0.3, right=0.9 * len(quantities) + 0.15))
    for number, quantity in enumerate(quantities):
        shown = {name: loads[name] for name, body in elastic.items() if shown_load(body) == quantity}
        largest = max(float(np.max(np.abs(load))) for load in shown.values())
        unit = scaled(UNITS[quantity], largest)
        for name, load in shown.items():
            left = spots[name].x / place.size
            image = axis.imshow(
                load / unit.size,
                origin="lower",
                aspect="auto",
                extent=(left, left + elastic[name].length / place.size, 0.0, scene.duration / time.size),
                cmap="RdBu_r",
                vmin=-largest / unit.size or -1.0,
                vmax=largest / unit.size or 1.0,
                interpolation="none",
            )
        inches = axis.get_position().width * figure.get_figwidth()
        bar = figure.colorbar(
            image, cax=axis.inset_axes((1.0 + (0.12 + 0.9 * number) / inches, 0.0, 0.11 / inches, 1.0))
        )
        bar.set_label(f"{MEANING[quantity]}  [{unit.label}]")
    _draw_contacts(axis, history, scene, place, time)
    axis.set_xlim(0.0, whole / place.size)
    axis.set_ylim(0.0, scene.duration / time.size)
    name_bodies(axis, scene, loads, place)
    axis.grid(visible=False)
    axis.set_xlabel(f"place  x  [{place.label}]")
    axis.set_ylabel(f"time  t  [{time.label}]")
    return figure


def _loads(history: AbstractHistory, scene: Scene) -> dict[str, Array]:
    """Return the load of each body with fields, (times, places).

    An exact run is known at all times and places: it is read so finely that slanted edges are straight, each body in
    places by its share of the length.
    """
    bodies = {name: body for name, body in scene.elastic.items() if body.moves}
    if history.dt is None:
        times, whole = frame_times(scene.duration, 2), sum(body.length for body in bodies.values())
        try:
            return {
                name: history.fields_at(name, times, shown_load(body), _places(body.length, whole)).values
                for name, body in bodies.items()
            }
        except ImpactlabError:  # a long run keeps its fields at the frames
            pass
    return {name: entry["load"] for name, entry in frames(history, scene).items() if entry["load"] is not None}


def _places(length: float, whole: float) -> Array:
    """Return places along a body (n,) [m] of a share of the whole length."""
    count = min(FINE_PLACES, max(MIN_PLACES, math.ceil(ALL_PLACES * length / whole)))
    return np.linspace(0.0, length, count)


def name_bodies(axis: Axes, scene: Scene, names: Iterable[str], place: Unit) -> None:
    """Write the names of bodies above a diagram whose limits are set, each over the middle of its body.

    The longest bodies come first; a name without room beside those before it is left out.
    """
    spots, letter = layout(scene), LETTER * NAME_SIZE / LETTER_SIZE
    low, high = axis.get_xlim()
    letter *= (high - low) / (axis.get_window_extent().width / axis.figure.dpi)
    taken: list[tuple[float, float]] = []
    for name in sorted(names, key=lambda each: -scene.bodies[each].length):
        middle = (spots[name].x + 0.5 * scene.bodies[name].length) / place.size
        half = 0.5 * letter * (len(name) + 1)
        if all(middle + half <= begin or end <= middle - half for begin, end in taken):
            taken.append((middle - half, middle + half))
            where = axis.get_xaxis_transform()
            axis.text(middle, 1.02, name, transform=where, ha="center", va="bottom", fontsize=NAME_SIZE, color=MUTED)


def _draw_contacts(axis: Axes, history: AbstractHistory, scene: Scene, place: Unit, time: Unit) -> None:
    """Draw contacts as lines while they are closed, closings and openings as dots."""
    spots, faces = layout(scene), {}
    for contact in scene.contacts:
        side = contact.left if scene.bodies[contact.left.body].length else contact.right
        faces[contact.name] = (spots[side.body].x + side.x) / place.size
    spans = [span for span in history.contacts if span.contact in faces]  # of many bodies some are drawn
    ends = np.array([(span.start, span.until(scene.duration), np.nan) for span in spans]).reshape(-1, 3) / time.size
    places = np.repeat([faces[span.contact] for span in spans], 3)  # NaN ends a line: one artist for all
    axis.plot(places, ends.ravel(), color=INK, linewidth=1.6, solid_capstyle="butt", clip_on=False)
    for kind, fill in (("close", INK), ("open", PAPER)):
        events = [event for event in history.events if event.kind == kind and event.contact in faces]
        axis.plot(
            [faces[event.contact] for event in events],
            [event.time / time.size for event in events],
            "o",
            color=INK,
            markerfacecolor=fill,
            markersize=4,
            markeredgewidth=0.9,
            clip_on=False,
        )
