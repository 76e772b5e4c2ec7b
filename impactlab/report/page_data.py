"""The data that the script of a page draws: JSON with arrays in one packed text."""

from __future__ import annotations

import base64
import dataclasses
import json
import math
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from impactlab.history.sampling import FRAMES, HISTORY_POINTS, frame_times
from impactlab.report.figures import mechanism
from impactlab.report.figures.named_contacts import with_figures
from impactlab.report.figures.signals import Panel, panels, sampled, shown
from impactlab.report.figures.stage import Frames, described, frames
from impactlab.report.figures.style import DASHES, INK, PALETTE, Trace
from impactlab.scene.problem import Scene
from impactlab.types import Array

LEVELS = (
    *((65535, 1, 1), (16384, 1, 1), (4096, 1, 1), (4096, 2, 1), (2048, 2, 2)),
    *((1024, 3, 4), (1024, 4, 4), (1024, 6, 8), (512, 8, 8)),
)
"""Values that a curve may have; of how many frames and places, and of how many instants, one is kept; finest first."""
MAX_DATA = 260_000  # characters, where the levels allow it
# Times `MAX_DATA`: above it fewer values alone would not do, and the next level of fewer places follows.
MAX_EXCESS = 1.4
MAX_BODIES = 4  # bodies with fields, above which each is narrow on the screen and keeps half of its places
MIN_PLACES = 30  # places along a body, none of which is left out
MAX_EVENTS = 4000  # of a history that the page draws; chatter beyond them would fill it
COLOUR_LEVELS = 255  # values of an array that is shown as colours
NAN_CODE = 65535  # code of NaN
Packed = tuple[int, int, float, float]
"""Place of an array in the text: first value, number of values, least value, step between values."""


def page_data(traces: Sequence[Trace], scene: Scene, *, compared: bool) -> str:
    """Return the data of a page as JSON.

    It is safe inside a script element of HTML. Curves have as many values, films as many frames and places, as
    `MAX_DATA` allows.
    """
    histories = shown(traces)
    films = [frames(trace.history, scene) for trace in histories]
    contacts = with_figures([trace.history for trace in histories])
    members = {member for each in contacts for member in each.members}
    part = dataclasses.replace(scene, contacts=tuple(each for each in scene.contacts if each.name in members))
    curves = panels(histories, part, compared=compared, contacts=contacts)
    text, size, before = "", 0, 0
    for levels, every, instants in LEVELS:
        if every == before and size > MAX_EXCESS * MAX_DATA:
            continue
        text = _text(histories, films, curves, scene, compared, levels, every, instants)
        size, before = len(text), every
        if size <= MAX_DATA:
            break
    return text


def _text(
    histories: Sequence[Trace],
    films: Sequence[Frames],
    curves: Sequence[Panel],
    scene: Scene,
    compared: bool,
    levels: int,
    every: int,
    instants: int,
) -> str:
    packer, names = Packer(), [contact.name for contact in scene.contacts]
    data: dict[str, Any] = {
        "duration": scene.duration,
        "trip": scene.round_trip if compared and math.isfinite(scene.round_trip) else None,
        "compared": compared,
        "points": (HISTORY_POINTS - 1) // instants + 1,
        "frames": FRAMES + 1,
        "methods": [_method(trace) for trace in histories],
        "bodies": described(scene),
        "contacts": [
            {
                "name": contact.name,
                "gap": contact.gap,
                "left": [contact.left.body, contact.left.x],
                "right": [contact.right.body, contact.right.x],
            }
            for contact in scene.contacts
        ],
        "mechanism": any(body.changes for body in scene.bodies.values()),
        "chains": [{"name": body.name, "slide": body.slide} for body in mechanism.chains(scene)],
        "met": mechanism.met(scene),
        "films": [
            _film(trace, film, scene, packer, names, levels, every)
            for trace, film in zip(histories, films, strict=True)
        ],
        "panels": [
            {
                "title": panel.title,
                "group": panel.group,
                "unit": panel.unit,
                "lines": [
                    {"name": line.name, "method": line.trace, "values": packer.add(line.values[::instants], levels)}
                    for line in panel.lines
                ],
            }
            for panel in curves
        ],
    }
    data["arrays"] = packer.text()
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _method(trace: Trace) -> dict[str, Any]:
    colour = "ink" if trace.colour == INK else f"c{PALETTE.index(trace.colour)}"
    return {"name": trace.name, "colour": colour, "dash": DASHES.index(trace.dash)}


def _film(
    trace: Trace, film: Frames, scene: Scene, packer: Packer, names: Sequence[str], levels: int, every: int
) -> dict[str, Any]:
    """Return the film of one history: motion and load of bodies, periods of contact, events."""
    history = trace.history
    numbers = {name: number for number, name in enumerate(names)}  # a page of many contacts draws a part of them
    shown = [span for span in history.contacts if span.contact in numbers][:MAX_EVENTS]
    spans = [[numbers[span.contact], span.start, span.until(scene.duration)] for span in shown if span.kicks is None]
    drawn = [event for event in history.events if event.contact in numbers][:MAX_EVENTS]
    events = [[numbers[event.contact], event.time, event.kind] for event in drawn]
    times = frame_times(scene.duration)[::every]
    gaps = {name: sampled(history, f"gap:{name}", times) for name in names} if mechanism.chains(scene) else {}
    return {
        "bodies": _bodies(film, packer, levels, every),
        "spans": spans,
        "events": events,
        "chains": {
            body.name: _kept(mechanism.joints(history, body, times).reshape(times.size, -1), packer, levels, 1, 1)
            for body in mechanism.chains(scene)
        },
        "gaps": [None if gap is None else _kept(gap[:, None], packer, levels, 1, 1) for gap in gaps.values()],
    }


def _bodies(made: Frames, packer: Packer, levels: int, every: int) -> dict[str, Any]:
    packed = {}
    long = sum(entry["load"] is not None for entry in made.values())
    across = every if long <= MAX_BODIES else min(2 * every, 15)  # a divisor of the steps between places
    for name, entry in made.items():
        u, load = entry["u"], entry["load"]
        packed[name] = {
            "u": None if u is None else _kept(u, packer, levels, every, across),
            "load": None if load is None or load is u else _kept(load, packer, COLOUR_LEVELS, every, across),
            "largest": 0.0 if load is None else float(np.max(np.abs(load))),
            "same": load is not None and load is u,  # a beam is coloured by its deflection
        }
    return packed


def _kept(values: Array, packer: Packer, levels: int, every: int, across: int) -> list[Any]:
    """Return frames, places and values of a field, thinned in both except for few places."""
    thin = values[::every, :: across if values.shape[1] % across == 1 and values.shape[1] > MIN_PLACES else 1]
    return [*thin.shape, packer.add(thin, levels)]


class Packer:
    """Collects arrays; `text` holds all of them, as `unpack` of page.js reads them."""

    def __init__(self) -> None:
        self._codes: list[np.ndarray[tuple[int], np.dtype[np.uint16]]] = []
        self._size = 0

    def add(self, values: Array, levels: int) -> Packed:
        """Return the place of an array, which loses its shape.

        Its values are kept to (max - min)/(levels - 1).
        """
        flat = np.asarray(values, float).ravel()
        known = flat[np.isfinite(flat)]
        low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
        step = (high - low) / (levels - 1) or 1.0
        codes = np.full(flat.size, NAN_CODE, np.uint16)
        codes[np.isfinite(flat)] = np.rint((known - low) / step)
        place = (self._size, flat.size, low, step)
        self._codes.append(np.diff(codes, prepend=np.uint16(0)))  # modulo 65536
        self._size += flat.size
        return place

    def text(self) -> str:
        """Return all arrays: their low bytes, then their high bytes, deflated, in base64."""
        codes = np.concatenate(self._codes) if self._codes else np.zeros(0, np.uint16)
        planes = (codes & 0xFF).astype(np.uint8).tobytes() + (codes >> 8).astype(np.uint8).tobytes()
        return base64.b64encode(zlib.compress(planes, 6)).decode("ascii")
