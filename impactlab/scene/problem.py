"""The physics of a run in SI units, as frozen records.

They are bodies, contacts, loads, duration and recorded quantities.

Conventions: x runs from a body's left end to its right end; displacements and velocities are positive to the
right; gaps are positive when open; contact forces, stresses and strains are positive in compression. Of a beam the
displacement is the deflection, positive up; for its contacts "left" reads below and "right" above.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from numbers import Integral
from typing import Any

from impactlab.errors import ImpactlabError
from impactlab.scene.bodies import Body, ElasticBody, WaveBody
from impactlab.scene.instrument import Instrument
from impactlab.startup.cached import cached_property
from impactlab.types import Quantity

SAME_TIME = 1e-9  # of the duration: times of fields that are nearer to each other are the same
RECORDS = 20_000  # instants that a run keeps unless the case says otherwise


@dataclass(frozen=True)
class Point:
    """A place on a body. ``label`` is how the case names it: ``hammer``, ``rod.left``, ``rod.at(0.15)``."""

    body: str
    x: float  # m from the left end; 0 for masses and walls
    label: str


@dataclass(frozen=True)
class Contact:
    """Two faces, left and right, that may meet or are joined.

    gap = gap0 + u_right - u_left.
    """

    left: Point
    right: Point
    gap: float  # m, at t = 0
    overlap_allowed: bool = False
    group: str = ""  # name of the contacts whose forces are summed, such as the pieces of a shaft

    @cached_property
    def name(self) -> str:
        """Name used in channels and events: ``hammer|rod.left``."""
        return f"{self.left.label}|{self.right.label}"

    @property
    def shared_name(self) -> str:
        """Name of the sum of forces that it is a part of: that of its group, else its own."""
        return self.group or self.name

    @property
    def faces(self) -> tuple[Point, Point]:
        """The left and the right face."""
        return self.left, self.right

    def places_on(self, body: str) -> list[float]:
        """Return the places x [m] of its faces on a body: two if it meets itself."""
        return [face.x for face in self.faces if face.body == body]


@dataclass(frozen=True)
class Probe:
    """A quantity at a place that is recorded over the whole run."""

    body: str
    x: float  # m
    quantity: str  # one of the body's own: see `Body.quantities`
    instrument: Instrument | None = None  # that its signal is also measured with

    @property
    def channel(self) -> str:
        """Name of its channel: ``displacement:rod@0.15``."""
        return f"{self.quantity}:{self.body}@{self.x:.6g}"

    @property
    def gauge_ends(self) -> tuple[Probe, ...]:
        """Displacements of both ends of a strain gauge with a length; none of other probes."""
        length = 0.0 if self.instrument is None else self.instrument.length
        places = (self.x - 0.5 * length, self.x + 0.5 * length) if length > 0.0 else ()
        return tuple(Probe(self.body, x, "displacement") for x in places)


@dataclass(frozen=True)
class Scene:
    """Physics, and the quantities that a run records. How it is solved is a `impactlab.scene.method.Method`."""

    name: str
    bodies: Mapping[str, Body]
    contacts: tuple[Contact, ...]
    duration: float  # s
    gravity: float = 0.0  # m/s2, along +x
    probes: tuple[Probe, ...] = ()
    snapshots: tuple[float, ...] = ()  # s, at which fields are kept and shown as figures
    frames: tuple[float, ...] = ()  # s, at which fields are kept beside the snapshots: for data and animations
    round_trip: float = float("nan")  # s, of the body named in round_trips_of; NaN without a rod or beam
    records: int = RECORDS  # instants kept: a run of more steps keeps every second, third ... one
    metrics: tuple[str, ...] = ()  # names of metrics of plugins to be measured beside impactlab's own

    @property
    def fronts_at_start(self) -> bool:
        """Whether waves with a front set out at t = 0.

        They start from an end force, or from an end that holds a moving body.
        """
        moving = [body for body in self.bodies.values() if body.velocity != 0.0]
        held = any(end.kind in ("clamped", "dashpot") for body in moving for _, end in body.ends)
        return held or bool(self.loaded_ends)

    @cached_property
    def field_times(self) -> tuple[float, ...]:
        """Times of the snapshots and frames, rising [s]; those that differ by rounding are one."""
        kept: list[float] = []
        for time in sorted((*self.snapshots, *self.frames)):
            if not kept or time > kept[-1] + SAME_TIME * self.duration:
                kept.append(time)
        return tuple(kept)

    def with_frames(self, count: int) -> Scene:
        """Return the scene with frames at ``count`` equal parts, at least one, of the run."""
        if isinstance(count, bool) or not isinstance(count, Integral) or count < 1:
            raise ImpactlabError(f"frames is {count!r}. Allowed: whole numbers from 0", remedy="Give frames=240.")
        more = (self.duration * number / count for number in range(count + 1))
        return replace(self, frames=tuple(sorted({*self.frames, *more})))

    @cached_property
    def in_order(self) -> dict[str, Body]:
        """Bodies by first contact, then by name, in any order of the case.

        Sums over several bodies follow it, so that their bits do not change with the order of keys.
        """
        touching = [point.body for point in self.faces]
        return {name: self.bodies[name] for name in dict.fromkeys((*touching, *sorted(self.bodies)))}

    @cached_property
    def faces(self) -> tuple[Point, ...]:
        """Faces of all contacts, the left and the right one of each."""
        return tuple(face for contact in self.contacts for face in contact.faces)

    @cached_property
    def contact_names(self) -> frozenset[str]:
        """Names of the contacts: ``hammer|rod.left``."""
        return frozenset(contact.name for contact in self.contacts)

    @cached_property
    def touching(self) -> dict[str, list[tuple[int, int]]]:
        """Contact faces by the name of their body.

        Each is the number of the contact, and 0 for its left or 1 for its right face.
        """
        found: dict[str, list[tuple[int, int]]] = {}
        for number, contact in enumerate(self.contacts):
            found.setdefault(contact.left.body, []).append((number, 0))
            found.setdefault(contact.right.body, []).append((number, 1))
        return found

    @cached_property
    def places(self) -> list[tuple[int, int]]:
        """The places of both faces of each contact among those of their bodies.

        The left face comes first.
        """
        found = [[0, 0] for _ in self.contacts]
        for faces in self.touching.values():
            for place, (number, side) in enumerate(faces):
                found[number][side] = place
        return [(left, right) for left, right in found]

    def met_by(self, body: str) -> list[tuple[int, Contact]]:
        """Return the contacts of a body with their numbers, each once."""
        numbers = dict.fromkeys(number for number, _ in self.touching.get(body, ()))
        return [(number, self.contacts[number]) for number in numbers]

    @cached_property
    def waves_from_start(self) -> bool:
        """Whether a load or a given displacement makes waves in a rod or beam from t = 0 on."""
        rods = self.elastic.values()
        return any(body.loads or body.end_force or body.displacement is not None for body in rods)

    @cached_property
    def fastest(self) -> float:
        """Largest velocity of a body at t = 0 [m/s]."""
        return max((abs(body.velocity) for body in self.bodies.values()), default=0.0)

    @cached_property
    def fastest_relative(self) -> float:
        """Largest difference of velocities at t = 0 [m/s], of all bodies and of those that are held."""
        velocities = [body.velocity for body in self.bodies.values()]
        at_rest = [0.0] if any(body.is_held for body in self.bodies.values()) else []
        return max(velocities + at_rest, default=0.0) - min(velocities + at_rest, default=0.0)

    @cached_property
    def derived(self) -> dict[Any, Any]:
        """Results that other modules derived from the scene already, by keys of their own."""
        return {}

    @cached_property
    def elastic(self) -> dict[str, ElasticBody]:
        """Bodies that deform and need a model, by name."""
        return {name: body.elastic for name, body in self.bodies.items() if body.elastic is not None}

    @cached_property
    def wave_bodies(self) -> tuple[WaveBody, ...]:
        """Bodies that move by the wave equation of rods."""
        return tuple(body.waves for body in self.bodies.values() if body.waves is not None)

    @cached_property
    def recorded_probes(self) -> tuple[Probe, ...]:
        """Probes, displacements of the ends of gauges with a length, and displacements of loaded ends."""
        gauges = dict.fromkeys(end for probe in self.probes for end in probe.gauge_ends)
        return (*self.probes, *gauges, *self.loaded_ends)

    @cached_property
    def own_channels(self) -> tuple[tuple[str, str, float, Quantity], ...]:
        """Channels that the bodies record in every run: body, name, place x [m] and quantity."""
        return tuple((name, *each) for name, body in self.bodies.items() for each in body.recorded)

    @cached_property
    def loaded_ends(self) -> tuple[Probe, ...]:
        """Displacements of loaded ends, recorded like those of faces in contact."""
        ends = ((name, x, end) for name, body in self.elastic.items() for x, end in body.ends)
        return tuple([Probe(name, x, "displacement") for name, x, end in ends if end.is_loaded])
