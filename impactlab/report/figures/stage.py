"""The scene as a page animates it: bodies end to end, with motion and load at the frames."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from impactlab.errors import ImpactlabError
from impactlab.history.base import AbstractHistory
from impactlab.history.sampling import frame_times
from impactlab.report.figures.fields import load_of
from impactlab.report.figures.signals import UNITS, sampled
from impactlab.scene.bodies import Beam, Body, ElasticBody, MechanismBody, Wall
from impactlab.scene.problem import Contact, Scene
from impactlab.types import Array

PLACES, NODES = 121, 25  # along a body: of its load, of its displacement
LANE = 0.12  # of the whole length, between bodies that never meet end to end


class BodyPlace(NamedTuple):
    """Where a body stands: its left end along the train, and the bodies before it."""

    x: float  # m, along the train
    icons: int  # masses and walls before it, which have a width on the screen but no length
    gap: float  # m, sum of the gaps between it and the first body of its row
    beside: str = ""  # the beam that it strikes from below or above
    side: int = 0  # 1 above that beam, -1 below
    at: float = 0.0  # m, where on it


def layout(scene: Scene) -> dict[str, BodyPlace]:
    """Return the place of every body: rows of bodies in contact, one after the other."""
    spots: dict[str, BodyPlace] = {}
    total = sum(body.length for body in scene.bodies.values()) or 1.0
    start = 0.0
    for first in _beginnings(scene):
        if first in spots:
            continue
        row = _row(scene, first)
        long = {name: spot for name, spot in row.items() if not spot.beside}
        low = min(spot.x for spot in long.values())
        few = min(spot.icons for spot in long.values())
        near = min(spot.gap for spot in long.values())
        end = start
        for name, spot in long.items():
            spots[name] = spot._replace(x=start + spot.x - low, icons=spot.icons - few, gap=spot.gap - near)
            end = max(end, spots[name].x + scene.bodies[name].length)
        for name, spot in row.items():
            if spot.beside:  # a rod that stands on a beam has its own place in the diagram
                spots[name] = spot._replace(x=end + LANE * total if scene.bodies[name].length else end)
                end = spots[name].x + scene.bodies[name].length
        start = end + LANE * total
    return spots


def _beginnings(scene: Scene) -> list[str]:
    """Return the bodies in the order in which they begin rows: beams, those with nothing on their left, all."""
    on_right = {contact.right.body for contact in scene.contacts}
    beams = [name for name, body in scene.bodies.items() if body.bends]
    return [*beams, *(name for name in scene.bodies if name not in on_right), *scene.bodies]


def _row(scene: Scene, first: str) -> dict[str, BodyPlace]:
    """Return the bodies that contacts join to the first, in metres and icons from it."""
    row, queue = {first: BodyPlace(0.0, 0, 0.0)}, deque([first])
    while queue:
        name = queue.popleft()
        for _, contact in scene.met_by(name):
            for here, there, side in ((contact.left, contact.right, 1), (contact.right, contact.left, -1)):
                if here.body != name or there.body in row:
                    continue
                row[there.body] = _next(scene, row[name], contact, side)
                queue.append(there.body)
    return row


def _next(scene: Scene, spot: BodyPlace, contact: Contact, side: int) -> BodyPlace:
    """Return the place of the body on one side of a contact.

    The side is 1 to the right (or above a beam), -1 to the left.
    """
    here, there = contact.faces if side > 0 else (contact.right, contact.left)
    if scene.bodies[here.body].bends and not scene.bodies[there.body].bends:
        return BodyPlace(spot.x + here.x, 0, side * contact.gap, here.body, side, here.x)
    if spot.beside:
        return spot._replace(gap=spot.gap + side * contact.gap)
    left = scene.bodies[contact.left.body]
    icons = side * (1 if left.length == 0.0 else 0)
    return BodyPlace(spot.x + here.x - there.x, spot.icons + icons, spot.gap + side * contact.gap)


def described(scene: Scene) -> list[dict[str, Any]]:
    """Return the bodies as page.js draws them.

    An entry has name, kind, place, segments as (length, relative height), and ends.
    """
    spots = layout(scene)
    tallest = max((s.area for b in scene.elastic.values() for s in b.segments), default=1.0)
    heaviest = max((b.moving_mass for b in scene.bodies.values() if _is_icon(b)), default=1.0)
    bodies = []
    for name, body in scene.bodies.items():
        entry = {"name": name, "kind": body.kind, **spots[name]._asdict(), "length": body.length}
        entry["velocity"] = body.velocity
        if isinstance(body, ElasticBody):
            entry["pieces"] = [[s.length, round((s.area / tallest) ** 0.5, 3)] for s in body.segments]
            entry["ends"] = [end.kind for _, end in body.ends]
            entry["load"] = shown_load(body)
            entry["unit"] = UNITS[entry["load"]]
        elif _is_icon(body):
            entry["size"] = round((body.moving_mass / heaviest) ** (1 / 3), 3)
        bodies.append(entry)
    return bodies


def _is_icon(body: Body) -> bool:
    return body.elastic is None and not isinstance(body, Wall)


def shown_load(body: ElasticBody) -> str:
    """Return the quantity that colours a body: stress, torque, or the deflection of a beam."""
    return "displacement" if isinstance(body, Beam) else load_of(body)


Frames = dict[str, dict[str, Array | None]]
_known: WeakKeyDictionary[AbstractHistory, Frames] = WeakKeyDictionary()  # the figure and the data of a page share them


def frames(history: AbstractHistory, scene: Scene) -> Frames:
    """Return the motion and the load of every body at the frames.

    The motion ``u`` is (frames, places) [m], the load (frames, PLACES). A body without fields moves as its faces do,
    straight lines between them, and has no load: None.
    """
    if history not in _known:
        _known[history] = _frames(history, scene)
    return _known[history]


def _frames(history: AbstractHistory, scene: Scene) -> Frames:
    times, recorded = frame_times(scene.duration), _displacements(history)
    made: Frames = {}
    for name, body in scene.bodies.items():
        if not body.moves:
            made[name] = {"u": np.zeros((times.size, 1)), "load": None}
        elif isinstance(body, ElasticBody):
            nodes = PLACES if isinstance(body, Beam) else NODES
            u = sampled_field(history, body, times, "displacement", nodes)
            load = u if isinstance(body, Beam) else sampled_field(history, body, times, shown_load(body), PLACES)
            if u is None:
                u = _faces(history, body, times, recorded.get(name, {}))
            made[name] = {"u": u, "load": load}
        else:
            u = None if isinstance(body, MechanismBody) else sampled(history, body.face_channel(0.0), times)
            made[name] = {"u": None if u is None else u[:, None], "load": None}
    return made


def sampled_field(
    history: AbstractHistory, body: ElasticBody, times: Array, quantity: str, places: int
) -> Array | None:
    """Return a quantity along a body at all frames, (frames, places); None where not kept."""
    x = np.linspace(0.0, body.length, places)
    try:
        known, values = history.fields_at(body.name, times, quantity)
    except ImpactlabError:  # a stepped run keeps fields at its snapshots only
        return None
    return np.array([np.interp(x, known, row) for row in values])


def _displacements(history: AbstractHistory) -> dict[str, dict[float, str]]:
    """Return the channels of displacements by body and place [m]."""
    found: dict[str, dict[float, str]] = {}
    for channel in history.channels():
        quantity, _, rest = channel.partition(":")
        name, _, at = rest.rpartition("@")
        if quantity == "displacement" and name:
            found.setdefault(name, {})[float(at)] = channel
    return found


def _faces(history: AbstractHistory, body: ElasticBody, times: Array, channels: Mapping[float, str]) -> Array | None:
    """Return the displacement of a body from those of its recorded faces, by place [m].

    It is straight between them.
    """
    known = {x: history.evaluate(times, channel) for x, channel in channels.items()}
    known |= {x: np.zeros(times.size) for x, end in body.ends if end.kind in ("clamped", "pinned")}
    places = sorted(known)
    if not places:
        return None
    rows = np.array([known[x] for x in places])
    if len(places) == 1 or places == [0.0, body.length]:
        return rows.T.copy()
    x = np.linspace(0.0, body.length, NODES)
    return np.array([np.interp(x, places, column) for column in rows.T])
