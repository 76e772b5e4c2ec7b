"""History of the exact solver: any channel at any time, evaluated from the waves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import CaseError
from impactlab.exact.energies import energy_book, rod_energy, rod_momentum
from impactlab.exact.network import Layout, Link, Log
from impactlab.exact.signals import Signal, Signals
from impactlab.history.base import AbstractHistory, ContactSpan, Cost, EnergyBook, Event, Field, Warned, within_run
from impactlab.history.noise_floor import above_noise
from impactlab.metrics.grazing import near_grazing
from impactlab.scene.bodies import WaveBody
from impactlab.scene.frame import carried_energy, touched_in
from impactlab.scene.method import Simulation
from impactlab.scene.problem import Probe
from impactlab.types import Array, Quantity

JUMP_TOL = 1.0e-9  # of the largest velocity: smaller jumps are rounding
QUANTITIES: tuple[Quantity, ...] = ("displacement", "velocity", "strain", "stress", "force")
FIELD_POINTS = 401


class Place(NamedTuple):
    """A place on a rod: its uniform piece and how long a wave takes there from the piece's left end."""

    rod: WaveBody
    link: Link
    way: float | Array  # s; one per time


class ContinuousHistory(AbstractHistory):
    """The exact history of a scene; channels exist at any place on a rod, with or without a probe.

    Waves and events are stored; everything else is computed from them on first use.
    """

    def __init__(
        self,
        run: Simulation,
        layout: Layout,
        log: Log,
        duration: float,
        first_carried: Mapping[int, float] | None = None,
    ) -> None:
        self.dt = None
        self.duration = duration
        self.scene, self.method = run
        self.layout = layout
        self._log = log
        self._first_carried = first_carried  # where the log begins later than one transit before t = 0
        self.cost = Cost(steps=int(log.tally[2]))
        self._events: tuple[Event, ...] | None = None
        self._spans: tuple[ContactSpan, ...] | None = None
        self._book: EnergyBook | None = None
        self._warned: list[Warned] | None = None

    @cached_property
    def signals(self) -> Signals:
        """The waves and forces as functions of time."""
        return Signals(self.layout, self._log)

    @cached_property
    def _contact(self) -> dict[str, int]:
        return {self.scene.contacts[place].name: c for c, place in enumerate(self.layout.places)}

    @cached_property
    def _speed(self) -> float:
        return float(self._log.scale[0])

    @cached_property
    def _exact_x(self) -> dict[str, float]:
        touching = [point for contact in self.scene.contacts for point in (contact.left, contact.right)]
        waves = [point for point in touching if point.body in self.layout.links]
        faces = [Probe(point.body, point.x, own) for point in waves for own in self.scene.bodies[point.body].quantities]
        return {probe.channel: probe.x for probe in (*faces, *self.scene.probes)}

    @property
    def events(self) -> tuple[Event, ...]:
        """Closings and openings in order of time."""
        if self._events is None:
            self._events, self._spans = above_noise(self.scene, self.method.models, self.dated, self._find_spans())
        return self._events

    @events.setter
    def events(self, events: tuple[Event, ...]) -> None:
        self._events = events

    @cached_property
    def dated(self) -> tuple[Event, ...]:
        """All closings and openings in order of time, noise included."""
        log, names = self._log, [self.scene.contacts[place].name for place in self.layout.places]
        found = zip(log.event_time, log.event_contact, log.event_kind, strict=True)
        dated = sorted(
            (float(time), number, names[contact], bool(closes))
            for number, (time, contact, closes) in enumerate(islice(found, int(log.tally[1])))
            if time <= self.duration
        )
        return tuple(Event(time, name, "close" if closes else "open") for time, _, name, closes in dated)

    @property
    def contacts(self) -> tuple[ContactSpan, ...]:
        """Periods of contact in order of their start, with impulse [N s] and peak force [N]."""
        if self._spans is None:
            self._events, self._spans = above_noise(self.scene, self.method.models, self.dated, self._find_spans())
        return self._spans

    @contacts.setter
    def contacts(self, spans: tuple[ContactSpan, ...]) -> None:
        self._spans = spans

    @property
    def energy(self) -> EnergyBook:
        """Energies at every break and on an equal grid."""
        if self._book is None:
            book = self.balanced
            self._book = replace(book, carried=carried_energy(self.scene, book.time, touched_in(self)))
        return self._book

    @energy.setter
    def energy(self, book: EnergyBook) -> None:
        self._book = book

    @cached_property
    def balanced(self) -> EnergyBook:
        """The energies without those of a common drift, which needs all contact periods."""
        return energy_book(self.scene, self.layout, self.signals, self.duration)

    @property
    def warnings(self) -> list[Warned]:
        """Warnings, found on first use."""
        if self._warned is None:
            self._warned = []
            if np.isfinite(self.scene.round_trip):
                for contact in self.scene.contacts:
                    text = near_grazing(self, contact.name, self.scene.round_trip)
                    if text is not None:
                        self._warned.append(Warned("near_grazing", text))
        return self._warned

    @warnings.setter
    def warnings(self, warned: list[Warned]) -> None:
        self._warned = warned

    def _find_spans(self) -> tuple[ContactSpan, ...]:
        spans = []
        for name, contact in self._contact.items():
            began: float | None = None
            for event in self.dated:
                if event.contact != name:
                    continue
                if event.kind == "close":
                    began = event.time
                elif began is not None:
                    spans.append(self._span(name, contact, began, event.time))
                    began = None
            if began is not None:
                spans.append(self._span(name, contact, began, None))
        return tuple(sorted(spans, key=lambda span: span.start))

    def _span(self, name: str, contact: int, start: float, end: float | None) -> ContactSpan:
        """Return one period of contact, with impulse and peak force over the pieces inside it."""
        force = self.signals.force(contact)
        slack = force.tolerance
        until = self.duration if end is None else end
        # Pieces follow one another: those of a contact are found without looking at all of them.
        first = int(np.searchsorted(force.start, start - slack))
        chosen = np.arange(first, max(first, int(np.searchsorted(force.stop, until + slack, side="right"))))
        if len(chosen) == 0:
            return ContactSpan(name, start, end, 0.0, 0.0)
        return ContactSpan(name, start, end, force.impulse(chosen), max(0.0, force.peak(chosen)))

    def channels(self) -> tuple[str, ...]:
        names = [probe.channel for probe in (*self.scene.probes, *self.scene.loaded_ends)]
        for name, body in self.scene.bodies.items():
            names += [f"{own}:{name}" for own, _ in body.own_channels]
            if name in self.layout.links or body.own_channels:
                names += [f"momentum:{name}", f"energy:{name}"]
        for contact in self.scene.contacts:
            names += [f"force:{contact.name}", f"gap:{contact.name}"]
        return tuple(dict.fromkeys(names))

    def evaluate(self, t: ArrayLike, channel: str) -> Array:
        times = within_run(t, self.duration)
        return np.asarray(self._answer(times.ravel(), channel).reshape(times.shape))

    def _answer(self, t: Array, channel: str) -> Array:
        quantity, _, rest = channel.partition(":")
        if rest in self._contact and quantity in ("force", "gap"):
            contact = self._contact[rest]
            if quantity == "force":
                return self.signals.force(contact)(t)
            net = self.layout.network
            left, right = (self.signals.displacement(int(node[contact])) for node in (net.left, net.right))
            return np.asarray(net.gap[contact] + right(t) - left(t))
        name, at, x = rest.rpartition("@")
        if at and name in self.layout.links and quantity in self.scene.bodies[name].quantities:
            read, factor = self.scene.bodies[name].reading(quantity)
            return factor * self._wave(t, read, self._place(name, channel, x))
        body = self.scene.bodies.get(rest)
        if rest in self.layout.links and quantity in ("momentum", "energy"):
            evaluated = rod_momentum if quantity == "momentum" else rod_energy
            return evaluated(self.layout, self.signals, rest, t)
        if body is not None and body.own_channels and quantity in ("position", "velocity", "momentum", "energy"):
            node, mass = self.layout.nodes[rest][0], body.rigid_mass
            if quantity == "position":
                return self.signals.displacement(node)(t)
            v = self.signals.velocity(node)(t)
            return {"velocity": v, "momentum": mass * v, "energy": 0.5 * mass * v * v}[quantity]
        raise CaseError(
            f"'{channel}' is not a channel of this history",
            remedy=f"Channels: {', '.join(self.channels())}, and {'|'.join(QUANTITIES)}:rod@x at any x of a rod.",
        )

    def _place(self, name: str, channel: str, text: str) -> Place:
        """Return the place of a channel; x of a probe is taken as the probe has it, not as its name rounds it."""
        body = self.scene.bodies[name].waves
        if body is None:
            raise CaseError(f"'{channel}': '{name}' is no rod", remedy="Name a rod.")
        try:
            x = self._exact_x[channel] if channel in self._exact_x else float(text)
        except ValueError:
            x = np.nan
        if not -1e-9 * body.length <= x <= (1.0 + 5e-6) * body.length:
            raise CaseError(
                f"'{channel}': x lies outside rod '{name}'", remedy=f"Give x between 0 and {body.length:g} m."
            )
        links = self.layout.links[name]
        link = next((item for item in links if x < item.x + item.length * (1.0 - 1e-12)), links[-1])
        way = (x - link.x) / link.wave_speed
        # Names carry six digits: what rounds to the end of the rod is the end, however short its last link is.
        at_end = link is links[-1] and x > body.length * (1.0 - 5e-6)
        if at_end or (channel in self._exact_x and x == link.x + link.length):
            way = link.transit
        return Place(body, link, min(max(way, 0.0), link.transit))

    def _wave(self, t: Array, quantity: str, place: Place) -> Array:
        link, way = place.link, place.way
        g = self.layout.network.gravity
        back = link.transit - way
        if quantity == "displacement":
            moved = self.signals.carried(link.left_end)(t - way) + self.signals.carried(link.right_end)(t - back)
            return np.asarray(moved + 0.5 * g * (link.transit * t + way * back) + self._rest(place.rod, link))
        right = self.signals.wave(link.left_end)(t - way) + 0.5 * g * way
        left = self.signals.wave(link.right_end)(t - back) + 0.5 * g * back
        if quantity == "velocity":
            return np.asarray(right + left)
        factor = {
            "strain": 1.0 / link.wave_speed,
            "stress": link.density * link.wave_speed,
            "force": link.density * link.wave_speed * link.area,
        }[quantity]
        return np.asarray(factor * (right - left))

    def _rest(self, rod: WaveBody, link: Link) -> float:
        """Constant of the displacement of a link: its left end at t = 0."""
        shape = rod.displacement
        start = 0.0 if shape is None else float(shape(np.array([link.x]))[0])
        return start - self.carried_before(link)

    def carried_before(self, link: Link) -> float:
        """Return the time integral of the wave of a link's right end, one transit before t = 0 [m]."""
        if self._first_carried is not None:
            return self._first_carried[link.right_end]
        return float(self.signals.carried(link.right_end)(np.array([-link.transit]))[0])

    def force(self, name: str) -> Signal:
        """Return the force of a contact as a function of time [N]."""
        return self.signals.force(self._contact[name])

    def field(self, body: str, t: float, quantity: str) -> Field:
        rod = self.scene.bodies[body].waves if body in self.scene.bodies else None
        if rod is None or quantity not in rod.quantities:
            raise CaseError(f"no field '{quantity}' of '{body}'", remedy=f"Fields: {', '.join(QUANTITIES)} of a rod.")
        read, factor = rod.reading(quantity)
        x = np.linspace(0.0, rod.length, FIELD_POINTS)
        values = np.empty_like(x)
        links = self.layout.links[body]
        time = float(within_run(t, self.duration))
        for i, link in enumerate(links):
            mine = (x >= link.x) & ((x < link.x + link.length) | (i == len(links) - 1))
            ways = np.clip((x[mine] - link.x) / link.wave_speed, 0.0, link.transit)
            at = np.full(int(np.sum(mine)), time)
            values[mine] = factor * self._wave(at, read, Place(rod, link, ways))
        return Field(x, values)

    def jumps(self, channel: str) -> Array:
        quantity, _, rest = channel.partition(":")
        floor = JUMP_TOL * self._speed
        if rest in self._contact and quantity in ("force", "gap"):
            if quantity == "gap":
                return np.zeros(0)
            contact = self._contact[rest]
            scale = float(self.layout.network.contact_impedance[contact])
            found = self.signals.force(contact).jumps(floor * scale)
            return np.asarray(found[(found >= 0.0) & (found <= self.duration)])
        name, at, x = rest.rpartition("@")
        known = self.scene.bodies[name].quantities if name in self.layout.links else {}
        read, _ = known.get(quantity, ("displacement", 1.0))
        if not at or read == "displacement" or name not in self.layout.links:
            self._answer(np.zeros(1), channel)  # refuses what is no channel
            return np.zeros(0)
        place = self._place(name, channel, x)
        link, way = place.link, place.way
        times = np.concatenate(
            [
                self.signals.wave(link.left_end).jumps(floor) + way,
                self.signals.wave(link.right_end).jumps(floor) + (link.transit - way),
            ]
        )
        times = np.unique(times[(times >= 0.0) & (times <= self.duration)])
        if len(times) == 0:
            return times
        slack = 4.0 * self.layout.network.tolerance
        times = times[np.concatenate([[True], np.diff(times) > slack])]
        shape = {"velocity": 1.0, "strain": 1.0 / link.wave_speed, "stress": link.density * link.wave_speed}
        scale = shape.get(read, link.density * link.wave_speed * link.area)
        before, after = self._wave(times - slack, read, place), self._wave(times + slack, read, place)
        return np.asarray(times[(np.abs(after - before) > 10.0 * floor * scale) | (times <= slack)])
