"""A run as an animation of its bodies, with their wave diagram.

The bodies stand above, coloured by their load; the diagram that their waves draw is below. Displacements and gaps are
shown larger than they are, both by the same factor, so that faces touch where they do.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from impactlab.errors import ImpactlabError
from impactlab.history.base import AbstractHistory
from impactlab.history.sampling import frame_times
from impactlab.prefixes import Unit, scaled
from impactlab.report.figures import mechanism
from impactlab.report.figures.diagram import MEANING, name_bodies
from impactlab.report.figures.drawn_part import drawn_part
from impactlab.report.figures.signals import UNITS
from impactlab.report.figures.stage import BodyPlace, frames, layout, shown_load
from impactlab.report.figures.style import GRID, INK, LETTER, MUTED, PALETTE, PAPER, clock, drawn
from impactlab.scene.bodies import ElasticBody, Wall
from impactlab.scene.problem import Scene
from impactlab.types import Array

if TYPE_CHECKING:
    from matplotlib.animation import FuncAnimation
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZE, DPI = (7.2, 4.6), 110  # inches, dots per inch
SHOWN_MOTION = 0.06  # of the length of the train: the largest displacement on the screen
ICON = 0.05  # of the length of the train: width of a mass
HEIGHT = 0.28  # half the height of the tallest rod, in units of the upper axes
COLOURS = "RdBu_r"
MOVING = "moving"  # mark of artists that change from frame to frame
PER_FRAME = 10  # instants of a force: contacts are shorter than a frame
CELLS = 120  # of a body, each of one colour
NAME_ROWS = 2  # below the bodies: of many, those without room have no name
Step = Callable[[int], None]
Corners = Callable[[int], Array]  # (2, CELLS + 1, 2): one edge of a body and the other, as x and y
Motion = Mapping[str, Mapping[str, Array | None]]


def animate(history: AbstractHistory, seconds: float = 8.0) -> FuncAnimation:
    """Return the animation of a history, for notebooks and windows."""
    from matplotlib.animation import FuncAnimation

    figure, step, count = film(history)
    return FuncAnimation(figure, step, frames=count, interval=1e3 * seconds / count)


@drawn
def film(history: AbstractHistory) -> tuple[Figure, Step, int]:
    """Return an animated figure of a history, its step and frame count.

    The step is the function that draws one of its frames.
    """
    from matplotlib.figure import Figure

    scene = dataclasses.replace(history.scene, duration=history.duration)
    motion, times, time = frames(history, scene), frame_times(scene.duration), clock(scene)
    figure = Figure(figsize=SIZE, dpi=DPI)
    loads = {name: made["load"] for name, made in motion.items() if made["load"] is not None}
    limits = _limits(scene, loads)
    wide = 0.9 - 0.11 * max(1, len(limits))
    chains = mechanism.chains(scene)
    if not chains and any(body.changes for body in scene.bodies.values()):
        raise ImpactlabError(
            "a mechanism that is not a chain of links cannot be drawn",
            remedy="Plot its channels, or the page of the run.",
        )
    high = 0.47 if chains else 0.24  # of the figure, its upper part
    stage, below = figure.add_axes((0.09, 0.9 - high, wide, high)), figure.add_axes((0.09, 0.115, wide, 0.71 - high))
    moving = partial(mechanism.moving, stage, history, chains, times, MOVING)
    steps = [moving() if chains else _stage(stage, scene, motion, limits)]
    if loads:
        steps.append(_waves(below, scene, loads, limits, time))
        _scales(figure, below, limits)
    else:
        steps.append(_forces(below, history, drawn_part(scene).scene, time))
    title = history.case.title if history.case is not None else scene.name
    figure.text(0.09, 0.95, title, color=INK, fontsize=10.5, weight="bold", va="center")
    digits = max(0, 2 - math.floor(math.log10(scene.duration / time.size)))
    time_text = figure.text(
        0.88, 0.95, "", color=MUTED, fontsize=9.5, ha="right", va="center", family="monospace", gid=MOVING
    )

    @drawn
    def step(number: int) -> None:
        for each in steps:
            each(number)
        time_text.set_text(f"t = {times[number] / time.size:.{digits}f} {time.label}")

    step(0)
    return figure, step, times.size


def _limits(scene: Scene, loads: dict[str, Array]) -> dict[str, float]:
    """Return the largest size of each quantity that colours bodies."""
    limits: dict[str, float] = {}
    for name, load in loads.items():
        quantity = shown_load(scene.elastic[name])
        limits[quantity] = max(limits.get(quantity, 0.0), float(np.abs(load).max()))
    return {quantity: limit or 1.0 for quantity, limit in limits.items()}


class _Place:
    """Places on the screen: x along the train and y across it, with motion enlarged."""

    def __init__(self, scene: Scene, motion: Motion) -> None:
        self.spots = layout(scene)
        right = max(spot.x + scene.bodies[name].length for name, spot in self.spots.items() if not spot.beside)
        self.whole = right or 1.0
        self.icon = ICON * self.whole
        gaps = [abs(spot.gap) for spot in self.spots.values()]
        moved = [float(np.nanmax(np.abs(made["u"]))) for made in motion.values() if made["u"] is not None]
        self.factor = SHOWN_MOTION * self.whole / (max([*moved, *gaps]) or 1.0)
        self.across = 0.35 / (SHOWN_MOTION * self.whole)  # of the upper axes, per length of the train

    def left(self, spot: BodyPlace) -> float:
        """Return the left end of a body that has not moved."""
        return spot.x + spot.icons * self.icon + self.factor * spot.gap


def _stage(axes: Axes, scene: Scene, motion: Motion, limits: dict[str, float]) -> Step:
    """Draw the bodies, each by its kind, and their names, which go with them."""
    place = _Place(scene, motion)
    tallest = max((piece.area for body in scene.elastic.values() for piece in body.segments), default=1.0)
    on_left = {contact.left.body for contact in scene.contacts}
    steps: list[Step] = []
    masses: list[tuple[float, Array | None]] = []  # left side, motion
    names: list[tuple[float, str, Array | None]] = []  # middle, name, motion
    edges = [0.0, place.whole]
    for name, body in scene.bodies.items():
        spot, u, load = place.spots[name], motion[name]["u"], motion[name]["load"]
        left, shift = place.left(spot), u
        if isinstance(body, ElasticBody) and u is not None:
            height = HEIGHT * (max(piece.area for piece in body.segments) / tallest) ** 0.5
            limit = limits.get(shown_load(body), 1.0)
            corners = _standing(place, spot, body, u) if spot.beside else _lying(place, left, body, u, height)
            steps.append(_elastic(axes, corners, load, limit))
            middle, shift = left + 0.5 * body.length, None if body.bends else u
        elif spot.beside:
            steps.append(_ball(axes, place, spot, u))
        else:
            width = (0.35 if isinstance(body, Wall) else 1.0) * place.icon
            # Its face stands beside that of the next body.
            start = left + place.icon - width if name in on_left else left
            if isinstance(body, Wall):
                steps.append(_wall(axes, place, start, width, u))
            else:
                masses.append((start, u))
            middle = start + 0.5 * width
        if not spot.beside:
            room, moved = 0.25 * place.icon, np.zeros(1) if shift is None else place.factor * shift
            edges += [left + min(0.0, float(moved.min())) - room]
            edges += [left + (body.length or place.icon) + max(0.0, float(moved.max())) + room]
            names.append((middle, name, shift))
    steps += [_masses(axes, place, masses)] if masses else []
    axes.set_xlim(min(edges), max(edges))
    steps += _names(axes, place, names)
    axes.set_ylim(-0.95, 0.75)
    axes.axis("off")

    def step(number: int) -> None:
        for each in steps:
            each(number)

    return step


def _names(axes: Axes, place: _Place, names: Iterable[tuple[float, str, Array | None]]) -> Iterator[Step]:
    """Write the names of the bodies in rows that have room.

    Each name has room beside those before it.
    """
    low, high = axes.get_xlim()
    letter = LETTER * (high - low) / (axes.get_position().width * SIZE[0])
    ends = [-math.inf] * NAME_ROWS
    for middle, name, u in sorted(names, key=lambda each: each[0]):
        half = 0.5 * letter * (len(name) + 1)
        row = next((row for row, end in enumerate(ends) if end <= middle - half), None)
        if row is not None:
            ends[row] = middle + half
            yield _name(axes, place, name, (middle, -0.62 - 0.2 * row), u)


def _name(axes: Axes, place: _Place, name: str, at: tuple[float, float], u: Array | None) -> Step:
    middle = at[0]
    text = axes.text(*at, name, ha="center", va="top", fontsize=8, color=MUTED, gid=MOVING)

    def step(number: int) -> None:
        text.set_x(middle + (0.0 if u is None else place.factor * float(np.mean(u[number]))))

    return step


def _lying(place: _Place, left: float, body: ElasticBody, u: Array, height: float) -> Corners:
    """Return a body's outline along the train as a function of frames.

    The outline of a rod or beam is its lower and its upper edge.
    """
    x, nodes = np.linspace(0.0, body.length, CELLS + 1), np.linspace(0.0, body.length, u.shape[1])

    def corners(number: int) -> Array:
        moved = place.factor * np.interp(x, nodes, u[number])
        along, across = (left + x, place.across * moved) if body.bends else (left + x + moved, 0.0 * x)
        half = 0.3 * height if body.bends else height
        return np.stack([np.stack([along, across - half], axis=1), np.stack([along, across + half], axis=1)])

    return corners


def _standing(place: _Place, spot: BodyPlace, body: ElasticBody, u: Array) -> Corners:
    """Return the outline of a rod that stands on a beam, from its face outwards."""
    at = place.left(place.spots[spot.beside]) + spot.at
    x, nodes = np.linspace(0.0, body.length, CELLS + 1), np.linspace(0.0, body.length, u.shape[1])
    long, half = min(0.5, 2.0 * body.length / place.whole), 0.25 * place.icon

    def corners(number: int) -> Array:
        moved = place.across * place.factor * (spot.gap + np.interp(x, nodes, u[number]))
        # x runs upwards, along its motion: above the beam from its face, below up to it.
        own = x / body.length if spot.side > 0 else x / body.length - 1.0
        up = spot.side * 0.3 * HEIGHT + long * own + moved
        return np.stack([np.stack([at - half + 0.0 * up, up], axis=1), np.stack([at + half + 0.0 * up, up], axis=1)])

    return corners


def _elastic(axes: Axes, corners: Corners, load: Array | None, limit: float) -> Step:
    """Draw a body as moving cells coloured by load, with its outline."""
    from matplotlib.collections import PolyCollection

    cells = PolyCollection([], cmap=COLOURS, edgecolors="face", linewidths=0.3, gid=MOVING)
    cells.set_clim(-limit, limit)
    axes.add_collection(cells)
    (outline,) = axes.plot([], [], color=INK, linewidth=1.1, gid=MOVING)
    middles = np.linspace(0.5, CELLS - 0.5, CELLS) / CELLS

    def step(number: int) -> None:
        one, other = corners(number)
        cells.set_verts(list(np.stack([one[:-1], one[1:], other[1:], other[:-1]], axis=1)))
        places = np.linspace(0.0, 1.0, 2 if load is None else load.shape[1])
        cells.set_array(np.interp(middles, places, np.zeros(2) if load is None else load[number]))
        outline.set_data(*np.concatenate([one, other[::-1], one[:1]]).T)

    return step


def _wall(axes: Axes, place: _Place, start: float, width: float, u: Array | None) -> Step:
    from matplotlib.patches import Rectangle

    patch = Rectangle((start, -0.55), width, 1.1, facecolor=PAPER, edgecolor=INK, linewidth=1.1, hatch="////")
    patch.set_gid(MOVING)
    axes.add_patch(patch)

    def step(number: int) -> None:
        if u is not None:
            patch.set_x(start + place.factor * float(u[number, 0]))

    return step


def _masses(axes: Axes, place: _Place, masses: Sequence[tuple[float, Array | None]]) -> Step:
    """Draw all masses, from their left sides and motions, as one artist: a chain has thousands."""
    from matplotlib.collections import PolyCollection

    lefts = np.array([start for start, _ in masses])
    still = np.zeros(len(next((u for _, u in masses if u is not None), [0])))
    moved = place.factor * np.stack([still if u is None else u[:, 0] for _, u in masses])  # (masses, frames)
    corners = np.array([(0.0, -0.4), (place.icon, -0.4), (place.icon, 0.4), (0.0, 0.4)])
    boxes = PolyCollection([], facecolors=INK, edgecolors=PAPER, linewidths=1.1, gid=MOVING)
    axes.add_collection(boxes)

    def step(number: int) -> None:
        at = lefts + moved[:, min(number, moved.shape[1] - 1)]
        boxes.set_verts(list(corners + np.stack([at, np.zeros_like(at)], axis=1)[:, None, :]))

    return step


def _ball(axes: Axes, place: _Place, spot: BodyPlace, u: Array | None) -> Step:
    """Draw a mass above or below the beam that it meets."""
    at = place.left(place.spots[spot.beside]) + spot.at
    (ball,) = axes.plot([], [], "o", color=INK, markersize=13, clip_on=False, zorder=0.9, gid=MOVING)  # behind the beam

    def step(number: int) -> None:
        moved = 0.0 if u is None else float(u[number, 0])
        ball.set_data([at], [0.24 * spot.side + place.across * place.factor * (spot.gap + moved)])

    return step


def _waves(axes: Axes, scene: Scene, loads: Mapping[str, Array], limits: Mapping[str, float], time: Unit) -> Step:
    """Draw the Lagrange diagram up to a frame in full colour, the rest pale."""
    spots, images = layout(scene), []
    whole = max(spots[name].x + scene.bodies[name].length for name in loads)
    place, until = scaled("m", whole), scene.duration / time.size
    for name, load in loads.items():
        limit, left = limits[shown_load(scene.elastic[name])], spots[name].x / place.size
        where: Any = {
            "origin": "lower", "aspect": "auto", "interpolation": "bilinear", "cmap": COLOURS,
            "vmin": -limit, "vmax": limit, "extent": (left, left + scene.bodies[name].length / place.size, 0.0, until),
        }  # fmt: skip
        axes.imshow(load, alpha=0.16, **where)
        images.append((axes.imshow(load, gid=MOVING, **where), load))
    now = axes.axhline(0.0, color=INK, linewidth=1.0, gid=MOVING)
    axes.set_xlim(0.0, whole / place.size)
    axes.set_ylim(0.0, until)
    name_bodies(axes, scene, loads, place)
    axes.grid(visible=False)
    axes.set_xlabel(f"place  x  [{place.label}]")
    axes.set_ylabel(f"time  t  [{time.label}]")

    def step(number: int) -> None:
        share = number / (len(images[0][1]) - 1)
        for image, load in images:
            x0, x1, _, _ = image.get_extent()
            image.set_data(load[: max(2, number + 1)])
            image.set_extent((x0, x1, 0.0, max(share, 1.0 / (len(load) - 1)) * until))
        axes.set_xlim(0.0, whole / place.size)
        axes.set_ylim(0.0, until)
        now.set_ydata([share * until] * 2)

    return step


def _scales(figure: Figure, axes: Axes, limits: dict[str, float]) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    for number, (quantity, limit) in enumerate(limits.items()):
        unit = scaled(UNITS[quantity], limit)
        colours = ScalarMappable(Normalize(-limit / unit.size, limit / unit.size), COLOURS)
        box = axes.get_position()
        bar = figure.colorbar(colours, cax=figure.add_axes((box.x1 + 0.012 + 0.11 * number, box.y0, 0.012, box.height)))
        bar.set_label(f"{MEANING[quantity]}  [{unit.label}]")


def _forces(axes: Axes, history: AbstractHistory, scene: Scene, time: Unit) -> Step:
    """Draw the contact forces up to a frame, where no fields are known; of many contacts those of a drawn part."""
    times = frame_times(scene.duration, PER_FRAME)
    lines, largest, least = [], 0.0, 0.0
    for number, contact in enumerate(scene.contacts):
        values = np.nan_to_num(history.evaluate(times, f"force:{contact.name}"))
        largest, least = max(largest, float(values.max())), min(least, float(values.min()))
        lines.append(
            (axes.plot([], [], color=PALETTE[number % len(PALETTE)], label=contact.name, gid=MOVING)[0], values)
        )
    span = largest - least or 1.0
    unit = scaled("N", max(largest, -least))
    axes.set_xlim(0.0, scene.duration / time.size)
    axes.set_ylim((least - 0.05 * span) / unit.size, (largest + 0.1 * span) / unit.size)
    axes.axhline(0.0, color=GRID, linewidth=0.8)
    axes.set_xlabel(f"time  t  [{time.label}]")
    axes.set_ylabel(f"contact force  [{unit.label}]")
    if 1 < len(lines) <= len(PALETTE):  # of more, colours repeat
        axes.legend(loc="upper right", fontsize=7.5, frameon=False)

    def step(number: int) -> None:
        for line, values in lines:
            until = PER_FRAME * number + 1
            line.set_data(times[:until] / time.size, values[:until] / unit.size)

    return step
