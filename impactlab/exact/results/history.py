"""History of the exact solver: any channel at any time, evaluated from the waves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import CaseError, closest
from impactlab.exact.arrays import CHANGE, CLOSE
from impactlab.exact.results.energies import energies_at, rod_energy, rod_momentum, sample_times
from impactlab.exact.results.link_results import link_results, named, total
from impactlab.exact.results.signals import Signal, Signals, turning_times
from impactlab.exact.setup.branch_tables import FIRST
from impactlab.exact.setup.network import Link, Log, NetworkLayout, Place
from impactlab.history.arguments import check_one, one_time, places_on, within_run
from impactlab.history.base import (
    FIELD_POINTS,
    AbstractHistory,
    BranchChange,
    ContactSpan,
    Cost,
    Event,
    Field,
    LinkResult,
    Warned,
)
from impactlab.history.energy import EnergyBook
from impactlab.history.frame import carried_energy, touched_in
from impactlab.history.no_contact import never_closed
from impactlab.history.noise_floor import above_noise
from impactlab.history.waves import wave_body
from impactlab.metrics.grazing import near_grazing
from impactlab.metrics.linear_theory import overstrained
from impactlab.scene.bodies.segmented import PLACE_ROUNDING
from impactlab.scene.facts import round_trips_of
from impactlab.scene.method import Simulation
from impactlab.scene.problem import Probe
from impactlab.startup.cached import cached_property
from impactlab.startup.lazy import lazy
from impactlab.types import QUANTITIES_OF_ROD, Array

if TYPE_CHECKING:
    from impactlab.exact import periods
else:  # compiled code, needed only where faces have touched
    periods = lazy("impactlab.exact.periods")

MIN_JUMP = 1.0e-9  # of the largest velocity: smaller ones are rounding
MAX_TOGETHER = 50_000  # values of fields that are computed at once: some passes over them stay in the cache


class ContinuousHistory(AbstractHistory):
    """The exact history of a scene, with channels at any place.

    Places on a rod need no probe. Waves and events are stored; everything else is computed from them on first use.
    """

    def __init__(self, run: Simulation, layout: NetworkLayout, log: Log, duration: float) -> None:
        self.dt = None
        self.duration = duration
        self.scene, self.method = run
        self.layout, self.log = layout, log

    @cached_property
    def cost(self) -> Cost:  # type: ignore[override] # may be assigned, as that of every history
        """Times and counts of the work."""
        return Cost(steps=int(self.log.state["intervals"]))

    @cached_property
    def signals(self) -> Signals:
        """The waves and forces as functions of time."""
        return Signals(self.log)

    @cached_property
    def numbers(self) -> dict[str, int]:
        """Numbers of the contacts in the network, by name."""
        return {self.scene.contacts[place].name: c for c, place in enumerate(self.layout.places)}

    @cached_property
    def joined(self) -> frozenset[str]:
        """Names of the links, which are joined from the start."""
        return frozenset(self.method.links)

    @cached_property
    def _named(self) -> dict[str, list[str]]:
        return {name: own for name, own in named(self.scene).items() if name not in self.numbers}

    @cached_property
    def _exact_x(self) -> dict[str, float]:
        waves = [point for point in self.scene.faces if point.body in self.layout.links]
        faces = [Probe(point.body, point.x, own) for point in waves for own in self.scene.bodies[point.body].quantities]
        return {probe.channel: probe.x for probe in (*faces, *self.scene.recorded_probes)}

    @cached_property
    def _of_masses(self) -> dict[str, str]:
        """Channels of masses by those of their probes: ``position:hammer`` by ``displacement:hammer@0``."""
        channels = (
            (name, own, quantity) for name, body in self.scene.bodies.items() for own, quantity in body.own_channels
        )
        return {f"{quantity}:{name}@0": f"{own}:{name}" for name, own, quantity in channels}

    def _logged(self, column: str) -> Iterator[tuple[float, str, int]]:
        """Yield instant [s], contact and another column of all events by time."""
        found = self.log.events[: self.log.state["events"]]
        found = found[found["time"] <= self.duration]
        found = found[np.argsort(found["time"], kind="stable")]
        names = list(self.numbers)
        for time, contact, value in zip(*(found[name].tolist() for name in ("time", "contact", column)), strict=True):
            yield time, names[contact], value

    @cached_property
    def dated(self) -> tuple[Event, ...]:
        """All closings and openings in order of time, noise included; links have none."""
        return tuple(
            Event(time, contact, "close" if kind == CLOSE else "open")
            for time, contact, kind in self._logged("kind")
            if kind != CHANGE and contact not in self.joined
        )

    @cached_property
    def changes(self) -> tuple[BranchChange, ...]:  # type: ignore[override]
        """Changes of branch in order of time: instants at which a law yields, unloads, opens."""
        return tuple(
            BranchChange(time, contact, self.log.names[branch - FIRST])
            for time, contact, branch in self._logged("branch")
            if branch >= 0
        )

    @cached_property
    def links(self) -> tuple[LinkResult, ...]:  # type: ignore[override]
        """Results of each link, or of all links of one name."""
        if not self.joined:
            return ()
        return tuple(link_results(self.scene, self.method, self.signals, self.numbers, 0.0, self.duration))

    @cached_property
    def _above_noise(self) -> tuple[tuple[Event, ...], tuple[ContactSpan, ...]]:
        return above_noise(self.scene, self.method, self.dated, self._find_spans())

    @cached_property
    def events(self) -> tuple[Event, ...]:  # type: ignore[override] # may be assigned, as that of every history
        """Closings and openings in order of time."""
        return self._above_noise[0]

    @cached_property
    def contacts(self) -> tuple[ContactSpan, ...]:  # type: ignore[override]
        """Periods of contact by start, with impulse [N s] and peak force [N]."""
        return self._above_noise[1]

    @cached_property
    def energy(self) -> EnergyBook:  # type: ignore[override]
        """Energies at every break and on an equal grid."""
        return replace(self.balanced, carried=carried_energy(self.scene, self.balanced.time, touched_in(self)))

    @cached_property
    def balanced(self) -> EnergyBook:
        """The energies without those of a common drift, which needs all contact periods."""
        return energies_at(self.scene, self.layout, self.signals, sample_times(self.log, self.duration))

    @cached_property
    def warnings(self) -> list[Warned]:  # type: ignore[override]
        """Warnings, found on first use."""
        meeting = (contact for contact in self.scene.contacts if contact.name not in self.joined)
        texts = {name: near_grazing(self, name, trip) for name, trip in round_trips_of(self.scene, meeting).items()}
        found = [Warned("near_grazing", text, name) for name, text in texts.items() if text is not None]
        return [*found, *never_closed(self), *overstrained(self)]

    def _find_spans(self) -> tuple[ContactSpan, ...]:
        found: list[tuple[str, float, float | None]] = []
        began: dict[str, float] = {}
        for event in self.dated:
            if event.kind == "close":
                began[event.contact] = event.time
            elif event.contact in began:
                found.append((event.contact, began.pop(event.contact), event.time))
        found += [(name, start, None) for name, start in began.items()]
        found.sort(key=lambda period: (period[1], self.numbers[period[0]]))
        totals = self.impulses_and_peaks([(n, start, self.duration if end is None else end) for n, start, end in found])
        return tuple(ContactSpan(*period, *total) for period, total in zip(found, totals, strict=True))

    def impulses_and_peaks(self, spans: Sequence[tuple[str, float, float]]) -> list[tuple[float, float]]:
        """Return impulse [N s] and peak force [N] of each period.

        A period is (contact, start [s], stop [s]). All pieces of the force that reach into a period count as a whole;
        events begin and end pieces.
        """
        if not spans:
            return []
        return periods.finished(self.log.memory, [(self.numbers[name], start, stop) for name, start, stop in spans])

    def channels(self) -> tuple[str, ...]:
        names = [probe.channel for probe in self.scene.recorded_probes]
        for name, body in self.scene.bodies.items():
            names += [f"{own}:{name}" for own, _ in body.own_channels]
            if name in self.layout.links or body.own_channels:
                names += [f"momentum:{name}", f"energy:{name}"]
        for contact in self.scene.contacts:
            names += [f"force:{contact.name}", f"gap:{contact.name}"]
        names += [f"force:{name}" for name in self._named]
        return tuple(dict.fromkeys(names))

    def evaluate(self, t: ArrayLike, channel: str) -> Array:
        times = within_run(t, self.duration)
        return np.asarray(self._evaluated(times.ravel(), channel).reshape(times.shape))

    def _evaluated(self, t: Array, channel: str) -> Array:
        quantity, _, rest = self._of_masses.get(str(channel), str(channel)).partition(":")
        if rest in self.numbers and quantity in ("force", "gap"):
            contact = self.numbers[rest]
            if quantity == "force":
                return self.signals.force(contact)(t)
            record = self.log.contacts[contact]
            left, right = (self.signals.displacement(int(record[side])) for side in ("left", "right"))
            return np.asarray(record["gap"] + right(t) - left(t))
        if quantity == "force" and rest in self._named:
            return total([self.force(name) for name in self._named[rest]], t)
        name, at, _ = rest.rpartition("@")
        if at and name in self.layout.links and quantity in self.scene.bodies[name].quantities:
            read, factor = self.scene.bodies[name].reading(quantity)
            return factor * self._wave(t, read, self.place(channel))
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
        anywhere = "|".join(QUANTITIES_OF_ROD)
        check_one(channel)
        raise CaseError(
            f"'{channel}' is not a channel of this history.{closest(str(channel), self.channels())}",
            remedy=f"Channels: {', '.join(self.channels())}, and {anywhere}:rod@x at any x of a rod.",
        )

    def place(self, channel: str) -> Place:
        """Return the place of a channel of a rod, a probe's not rounded as in its name."""
        name, _, text = channel.partition(":")[2].rpartition("@")
        length = self.scene.bodies[name].length
        try:
            x = self._exact_x[channel] if channel in self._exact_x else float(text)
        except ValueError:
            text = f"'{channel}': '{text}' is not a place in metres"
            raise CaseError(text, remedy=f"Write the number alone, from 0 to {length:g}, as in {name}@0.1.") from None
        if not -1e-9 * length <= x <= (1.0 + 5e-6) * length:
            raise CaseError(f"'{channel}': x lies outside rod '{name}'", remedy=f"Give x between 0 and {length:g} m.")
        return Place.on(self.layout.links[name], length, x, channel in self._exact_x)

    def _wave(self, t: Array, quantity: str, place: Place) -> Array:
        link, way = place
        g, back = self.signals.gravity, link.transit - way
        if quantity == "displacement":
            moved = self.signals.carried(link.left_end)(t - way) + self.signals.carried(link.right_end)(t - back)
            rest = link.u - self.carried_before(link)
            return np.asarray(moved + 0.5 * g * (link.transit * t + way * back) + rest)
        right, left = self._two_waves(t, place)
        return np.asarray(
            right + left if quantity == "velocity" else link.segment.per_velocity(quantity) * (right - left)
        )

    def integral(self, channel: str, t: Array) -> Array | None:
        """Return the time integral of a channel from t = 0 on.

        It has the shape (n,) and is exact across fronts; None where there is none. Forces of contacts; velocity,
        strain, stress and force inside a rod; velocities of masses.
        """
        quantity, _, rest = channel.partition(":")
        if quantity == "force" and rest in self.numbers:
            force = self.force(rest)
            return force.integral(t, False) - force.integral(np.zeros(1), False)
        if quantity == "force" and rest in self._named:
            parts = (self.integral(f"force:{name}", t) for name in self._named[rest])
            return sum((part for part in parts if part is not None), np.zeros_like(t))
        name, at, _ = rest.rpartition("@")
        if at and name in self.layout.links and quantity in self.scene.bodies[name].quantities:
            read, factor = self.scene.bodies[name].reading(quantity)
            if read == "displacement":
                return None
            link, way = self.place(channel)
            g, back = self.signals.gravity, link.transit - way
            sides = []
            for end, lag in ((link.left_end, way), (link.right_end, back)):
                carried = self.signals.carried(end)
                sides.append(carried(t - lag) - carried(np.zeros(1) - lag) + 0.5 * g * lag * t)
            right, left = sides
            whole = right + left if read == "velocity" else link.segment.per_velocity(read) * (right - left)
            return np.asarray(factor * whole)
        body = self.scene.bodies.get(rest)
        if quantity == "velocity" and body is not None and rest not in self.layout.links and rest in self.layout.nodes:
            moved = self.signals.displacement(self.layout.nodes[rest][0])
            return np.asarray(moved(t) - moved(np.zeros(1)))
        return None

    def _two_waves(self, t: Array, place: Place) -> tuple[Array, Array]:
        """Return the velocities of the waves to right and left at a place [m/s]."""
        link, way = place
        g, back = self.signals.gravity, link.transit - way
        right = self.signals.wave(link.left_end)(t - way) + 0.5 * g * way
        left = self.signals.wave(link.right_end)(t - back) + 0.5 * g * back
        return right, left

    def travelling(self, body: str, x: float, t: ArrayLike) -> tuple[Array, Array]:
        times = within_run(t, self.duration)
        wave_body(self.scene, body, x)
        place = Place.on(self.layout.links[body], self.scene.bodies[body].length, x, True)
        right, left = self._two_waves(times.ravel(), place)
        return right.reshape(times.shape), left.reshape(times.shape)

    def carried_before(self, link: Link) -> float:
        """Return the integral of a link's right wave one transit before t = 0 [m]."""
        known, end = self.layout.carried, link.right_end
        if end not in known:  # kept, as the log of a long run begins later
            known[end] = float(self.signals.carried(end)(np.array([-link.transit]))[0])
        return known[end]

    def force(self, name: str) -> Signal:
        """Return the force of a contact as a function of time [N]."""
        return self.signals.force(self.numbers[name])

    def impulse_of(self, contact: str) -> float:
        if str(contact) not in self.joined:
            return super().impulse_of(contact)
        return self.impulse_until(contact, self.duration)

    def impulse_until(self, contact: str, time: float) -> float:
        return float(np.diff(self.force(contact).integral(np.array([0.0, max(0.0, time)]), False))[0])

    def field(self, body: str, t: float, quantity: str, x: ArrayLike | None = None) -> Field:
        places, rows = self.fields_at(body, [one_time(t, self.duration)], quantity, x)
        return Field(places, rows[0])

    def fields_at(self, body: str, times: ArrayLike, quantity: str, x: ArrayLike | None = None) -> Field:
        rods = self.layout.links
        links = rods.get(str(body), ())
        if not links:
            raise CaseError(
                f"no field of '{body}'.{closest(str(body), rods)} Rods and shafts: {', '.join(rods)}",
                remedy="Name one of these; a mass has channels.",
            )
        known = self.scene.bodies[body].quantities
        if str(quantity) not in known:
            raise CaseError(
                f"no field {str(quantity)!r} of '{body}'.{closest(str(quantity), known)}",
                remedy=f"Fields: {', '.join(known)}.",
            )
        read, factor = self.scene.bodies[body].reading(quantity)
        length = self.scene.bodies[body].length
        x = np.linspace(0.0, length, FIELD_POINTS) if x is None else places_on(self.scene.bodies[body], x)
        t = within_run(times, self.duration).reshape(-1, 1)
        values = np.empty((t.size, x.size))
        blocks = np.array_split(t, max(1, values.size // MAX_TOGETHER))
        starts = np.array([link.x for link in links])
        numbers = np.searchsorted(starts[1:], x + PLACE_ROUNDING * length, side="right")  # at a boundary the right link
        for number, link in enumerate(links):
            mine = numbers == number
            place = Place(link, np.clip((x[mine] - link.x) / link.segment.wave_speed, 0.0, link.transit))
            values[:, mine] = factor * np.concatenate([self._wave(some, read, place) for some in blocks])
        return Field(x, values)

    def turning_times(self, channel: str) -> Array:
        if channel.partition(":")[2].rpartition("@")[0] not in self.layout.links:
            return super().turning_times(channel)
        link, way = self.place(channel)
        ends = (link.left_end, way), (link.right_end, link.transit - way)
        breaks = np.concatenate([self.signals.wave(end).stop + lag for end, lag in ends])
        return turning_times(breaks, float(self.log.state["tolerance"]), self.duration)

    def jumps(self, channel: str) -> Array:
        quantity, _, rest = channel.partition(":")
        floor, slack = MIN_JUMP * float(self.log.state["fastest"]), 4.0 * float(self.log.state["tolerance"])
        if quantity == "force" and rest in self.numbers:
            contact = self.numbers[rest]
            found = self.signals.force(contact).jumps(floor * float(self.log.contacts["impedance"][contact]))
            return np.asarray(found[(found >= 0.0) & (found <= self.duration)])
        if quantity == "force" and rest in self._named:
            return np.unique(np.concatenate([self.jumps(f"force:{name}") for name in self._named[rest]]))
        name, _, _ = rest.rpartition("@")
        known = self.scene.bodies[name].quantities if name in self.layout.links else {}
        read, _ = known.get(quantity, ("displacement", 1.0))
        if read == "displacement":
            self._evaluated(np.zeros(1), channel)  # raises if there is no such channel
            return np.zeros(0)
        place = self.place(channel)
        link, way = place
        right, left = (self.signals.wave(end).jumps(floor) for end in (link.left_end, link.right_end))
        times = np.concatenate([right + way, left + (link.transit - way)])
        times = np.unique(times[(times >= 0.0) & (times <= self.duration)])
        if len(times) == 0:
            return times
        times = times[np.concatenate([[True], np.diff(times) > slack])]
        scale = 1.0 if read == "velocity" else link.segment.per_velocity(read)
        before, after = self._wave(times - slack, read, place), self._wave(times + slack, read, place)
        return np.asarray(times[(np.abs(after - before) > 10.0 * floor * scale) | (times <= slack)])
