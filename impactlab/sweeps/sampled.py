"""Channels, at given times or by their extremes, as quantities of a sweep, checked before the first run."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from impactlab.casefile.text.words import listed, shown
from impactlab.errors import CaseError, closest
from impactlab.history.arguments import END_ROUNDING
from impactlab.history.base import AbstractHistory
from impactlab.history.extremes import extremes
from impactlab.history.field_extremes import field_extremes, frames_needed, rod_of
from impactlab.history.units import UNITS
from impactlab.prefixes import prefixed_range
from impactlab.printing import counted
from impactlab.scene.bodies import WaveBody
from impactlab.scene.method import Method, is_exact
from impactlab.scene.problem import Scene
from impactlab.simulate.channels import probed


class Sampled(NamedTuple):
    """A channel at given times [s] as a quantity of a sweep.

    For example ``Sampled("force:hammer|rod.left", times)``.
    """

    channel: str
    times: Sequence[float]

    def __repr__(self) -> str:
        times = np.atleast_1d(np.asarray(self.times))
        if times.dtype.kind not in "iuf" or not times.size:  # refused by `check_sampled`
            return f"Sampled({self.channel!r}, {self.times!r})"
        span = prefixed_range(times.min(), times.max(), "s")
        return f"<Sampled {self.channel!r} at {counted(times.size, 'time')}, {span}>"


class Extreme(NamedTuple):
    """The largest or least value of a channel as a quantity, as ``max(strain:rod@0.15)``.

    Of a rod without a place, as ``max(stress:rod)``, it is that over all places.
    """

    of: str  # max or min
    channel: str

    @property
    def description(self) -> str:
        """What it is, for people."""
        quantity, _, place = self.channel.partition(":")
        return f"{'Largest' if self.of == 'max' else 'Least'} {quantity.replace('_', ' ')} of {place} in the run."

    def along(self, scene: Scene) -> WaveBody | None:
        """Return the rod over whose places it is; None for a channel that every run of the scene has."""
        rod = rod_of(scene, self.channel)
        return None if rod is not None and self.channel in channels(scene) else rod

    def value(self, history: AbstractHistory) -> float:
        """Return the value of a run, in the SI unit of the channel."""
        rod = self.along(history.scene)
        if rod is None:
            least, largest = extremes(history, self.channel)
        else:
            least, largest = (each.value for each in field_extremes(history, rod, self.channel.partition(":")[0]))
        return largest if self.of == "max" else least


def extreme_in(name: str) -> Extreme | None:
    """Return the extreme that a name of a quantity states, None for other names."""
    of, opened, rest = name.partition("(")
    return Extreme(of, rest[:-1].strip()) if of in ("max", "min") and opened and rest.endswith(")") else None


def frames_of(names: Sequence[str], scene: Scene) -> int:
    """Return the frames that a run needs for extremes along its rods, as ``max(stress:rod)``; 0 without them."""
    rods = [each.along(scene) for each in map(extreme_in, names) if each is not None]
    return max((frames_needed(scene.duration, 0.5 * rod.round_trip) for rod in rods if rod is not None), default=0)


def is_sampled(name: str) -> bool:
    """Return whether the name of a quantity is that of a channel at given times."""
    return ":" in name and extreme_in(name) is None


def check_sampled(wanted: Sampled, scene: Scene, method: Method, longest: float) -> None:
    """Raise `CaseError` where a run has no such channel or ends too early.

    Parameters
    ----------
    wanted : Sampled
        Channel and times.
    scene, method : Scene, Method
        Of one point of the sweep.
    longest : float
        Duration of the longest run [s].
    """
    if not len(wanted.times) or not all(0.0 <= time < math.inf for time in wanted.times):
        raise CaseError(f"{wanted.channel} is requested at no time of a run", remedy="Give times in s, from 0 on.")
    if max(wanted.times) > longest * (1.0 + END_ROUNDING):
        text = f"{wanted.channel} is requested at {max(wanted.times):.6g} s; the run ends at {longest:.6g} s"
        raise CaseError(text, remedy="Give times of the run, or run the case with a longer duration.")
    check_channel(wanted.channel, scene, method)


def check_channel(channel: str, scene: Scene, method: Method) -> None:
    """Raise `CaseError` where a run of a scene would not have a channel."""
    quantity, _, label = channel.partition(":")
    if quantity not in UNITS:
        text = f"{shown(channel)} is not a channel.{closest(quantity, UNITS)}"
        raise CaseError(text, remedy=f"A channel begins with one of: {listed(UNITS)}.")
    known = list(dict.fromkeys(channels(scene)))
    if channel in known:  # the six digits of an end's name may lie beyond the end
        return
    _check_inside(channel, label, scene)
    if not _anywhere(quantity, label, scene, method):
        text = f"no run has the channel {shown(channel)}.{closest(channel, known)}"
        raise CaseError(text, remedy=f"Channels: {', '.join(known)}. Another place needs a probe in the case.")


def _check_inside(channel: str, label: str, scene: Scene) -> None:
    """Raise `CaseError` for a channel at a place outside its body."""
    name, _, place = label.rpartition("@")
    body = scene.elastic.get(name)
    try:
        x = float(place)
    except ValueError:
        return
    if body is not None and not 0.0 <= x <= body.length:
        raise CaseError(
            f"{shown(channel)}: x = {x:.6g} m lies outside the body '{name}'. Allowed: 0 to {body.length:.6g} m",
            remedy="x runs from the left end of a body to its right end.",
        )


def channels(scene: Scene) -> Iterator[str]:
    """Yield the channels that every run of a scene has."""
    yield from dict.fromkeys(f"force:{contact.group}" for contact in scene.contacts if contact.group)
    for contact in scene.contacts:
        yield f"force:{contact.name}"
        yield f"gap:{contact.name}"
        for face in contact.faces:
            if scene.bodies[face.body].elastic is not None:
                yield f"displacement:{face.body}@{face.x:.6g}"
                yield f"velocity:{face.body}@{face.x:.6g}"
    yield from (each.channel for each in probed(scene))
    for name, body in scene.bodies.items():
        if body.moves:
            if not body.changes:
                yield f"momentum:{name}"
            yield f"energy:{name}"


def _anywhere(quantity: str, label: str, scene: Scene, method: Method) -> bool:
    """Return whether a channel is at a place of a body that is solved exactly.

    No probe is needed there. A delay line, a continuous rod in steps, has its probes alone.
    """
    name, at, place = label.rpartition("@")
    body = scene.elastic.get(name)
    if not at or body is None or quantity not in body.quantities or not is_exact(scene, method):
        return False
    try:
        return 0.0 <= float(place) <= body.length
    except ValueError:
        return False
