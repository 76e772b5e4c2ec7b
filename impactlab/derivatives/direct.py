"""Derivatives of the built-in quantities of an exact run, by formulas from its tangents."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from impactlab.exact.results.history import ContinuousHistory
from impactlab.exact.setup.network import Link
from impactlab.exact.tangents.arrays import DURATION, GAP, GRAVITY, IMPEDANCE, MASS, SPRING, TRANSIT
from impactlab.exact.tangents.run import Solved
from impactlab.exact.tangents.signals import MovingSignals
from impactlab.history.base import ContactSpan
from impactlab.metrics.collisions import collisions
from impactlab.types import Array

Labelled = dict[str, float]


class Direct:
    """Derivatives by one parameter; NaN where one does not exist or has no formula here."""

    def __init__(self, solved: Solved, parameter: int, history: ContinuousHistory) -> None:
        self.solved, self.parameter, self.history = solved, parameter, history
        self.scene, self.layout = history.scene, solved.layout
        self.signals = MovingSignals(solved, parameter)
        self.number = {self.scene.contacts[place].name: c for c, place in enumerate(self.layout.places.tolist())}
        count = int(solved.log.state["events"])
        times, contacts = (solved.log.events[name][:count].tolist() for name in ("time", "contact"))
        self._dated = dict(
            zip(zip(contacts, times, strict=True), solved.tangents.dated[:count, parameter].tolist(), strict=True)
        )
        self.end, self.of_end = history.duration, float(solved.tangents.of_state[parameter, DURATION])

    def of(self, quantity: str) -> Labelled:
        """Return the derivatives of a quantity by label; empty where there is no formula."""
        made: Mapping[str, Callable[[], Labelled]] = {
            "first_opening": self._first_opening,
            "time_in_contact": self._time_in_contact,
            "impulse": lambda: self._summed(self._impulse),
            "peak_force": self._peak_force,
            "restitution": self._restitution,
            "final_velocity": lambda: self._bodies(lambda name: self.velocity(name, self.end, self.of_end)),
            "final_momentum": lambda: self._bodies(lambda name: self.momentum(name, self.end, self.of_end)),
            "final_energy": lambda: self._bodies(self._energy),
        }
        return made[quantity]() if quantity in made else {}

    def moved(self, contact: str, time: float | None) -> float:
        """Return the derivative of the time of an event of a contact.

        ``time`` None is the end of the run.
        """
        return self.of_end if time is None else self._dated[self.number[contact], time]

    def _summed(self, value: Callable[[ContactSpan], float]) -> Labelled:
        contacts = self.scene.contacts
        return {each.name: sum(value(span) for span in self.history.spans(each.name)) for each in contacts}

    def _bodies(self, value: Callable[[str], float]) -> Labelled:
        return {name: value(name) for name, body in self.scene.bodies.items() if body.moves}

    def _first_opening(self) -> Labelled:
        opened = {event.contact: event.time for event in reversed(self.history.events) if event.kind == "open"}
        return {name: self.moved(name, time) for name, time in opened.items()}

    def _time_in_contact(self) -> Labelled:
        return self._summed(lambda span: self.moved(span.contact, span.end) - self.moved(span.contact, span.start))

    def _impulse(self, span: ContactSpan) -> float:
        return self.signals.force(self.number[span.contact]).integral(span.start, span.until(self.end))

    def _peak_force(self) -> Labelled:
        found = {}
        for contact in self.scene.contacts:
            spans = self.history.spans(contact.name)
            force = self.signals.force(self.number[contact.name])
            top = max(spans, key=lambda span: span.peak_force or 0.0, default=None)
            found[contact.name] = 0.0 if top is None else force.peak(top.start, top.until(self.end))
        return found

    def _restitution(self) -> Labelled:
        found: Labelled = {}
        for each in collisions(self.history):
            if each.bodies in found or each.restitution is None or each.end is None or not each.approach_speed:
                found.setdefault(each.bodies, math.nan)
                continue
            names = {span.contact for span in self.history.contacts if self._pair(span.contact) == each.bodies}
            starts = [self._dated[key] for key in self._dated if key[1] == each.start and self._named(key[0]) in names]
            ends = [self._dated[key] for key in self._dated if key[1] == each.end and self._named(key[0]) in names]
            left, right = each.bodies.split("|")
            other = right if each.striker == left else left
            sign = 1.0 if each.striker == left else -1.0
            before, after = np.nextafter(each.start, -1.0), each.end
            moved = ends[0] if ends else self.of_end
            approach = sign * (self.speed(each.striker, before, starts[0]) - self.speed(other, before, starts[0]))
            leaves = sign * (self.speed(other, after, moved) - self.speed(each.striker, after, moved))
            found[each.bodies] = (leaves - each.restitution * approach) / each.approach_speed
        return found

    def _named(self, contact: int) -> str:
        return self.scene.contacts[int(self.layout.places[contact])].name

    def _pair(self, contact: str) -> str:
        found = next(each for each in self.scene.contacts if each.name == contact)
        return f"{found.left.body}|{found.right.body}"

    def _numbers(self, kind: Array, number: int, column: int) -> float:
        return float(kind[self.parameter, number, column])

    def _link(self, link: Link) -> tuple[float, float, float, float]:
        """Return impedance and transit of a link, and their derivatives."""
        end = link.left_end
        z, transit = (float(self.solved.log.ends[name][end]) for name in ("impedance", "transit"))
        rates = self.solved.tangents.of_ends[self.parameter, end]
        return z, transit, float(rates[IMPEDANCE]), float(rates[TRANSIT])

    def _masses(self, name: str) -> list[tuple[int, float, float]]:
        """Return the nodes of a body with mass, it and its derivative."""
        of_nodes, masses = self.solved.tangents.of_nodes, self.solved.log.nodes["mass"]
        nodes = [node for node in self.layout.nodes[name] if 0.0 < masses[node] < np.inf]
        return [(node, float(masses[node]), self._numbers(of_nodes, node, MASS)) for node in nodes]

    def momentum(self, name: str, time: float, later: float) -> float:
        """Return the derivative of the momentum of a body at a time.

        ``later`` is the derivative of that time.
        """
        at, of_at = np.array([time]), np.array([later])
        gravity, of_gravity = (
            float(self.solved.log.state["gravity"]),
            self.solved.tangents.of_state[self.parameter, GRAVITY],
        )
        total = 0.0
        for link in self.layout.links.get(name, ()):
            z, transit, of_z, of_transit = self._link(link)
            inside = of_inside = 0.0
            for end in (link.left_end, link.right_end):
                carried = self.signals.carried(end)
                inside += float((carried.value(at) - carried.value(at - transit))[0])
                there, here = carried.derivative(at, of_at), carried.derivative(at - transit, of_at - of_transit)
                of_inside += float((there - here)[0])
            inside += 0.5 * gravity * transit**2
            of_inside += 0.5 * of_gravity * transit**2 + gravity * transit * of_transit
            total += of_z * inside + z * of_inside
        for node, mass, of_mass in self._masses(name):
            velocity = self.signals.velocity(node)
            total += of_mass * float(velocity.value(at)[0]) + mass * float(velocity.derivative(at, of_at)[0])
        return total

    def speed(self, name: str, time: float, later: float) -> float:
        """Return the derivative of the speed of a body in a collision; 0 if held."""
        return 0.0 if self.scene.bodies[name].is_held else self.velocity(name, time, later)

    def velocity(self, name: str, time: float, later: float) -> float:
        """Return the derivative of the mean velocity of a body, momentum over mass; 0 for a wall."""
        if not self.scene.bodies[name].moves:
            return 0.0
        mass = of_mass = 0.0
        for link in self.layout.links.get(name, ()):
            z, transit, of_z, of_transit = self._link(link)
            mass, of_mass = mass + z * transit, of_mass + of_z * transit + z * of_transit
        for _, own, of_own in self._masses(name):
            mass, of_mass = mass + own, of_mass + of_own
        momentum = float(self.history.evaluate([max(0.0, time)], f"momentum:{name}")[0])
        return (self.momentum(name, time, later) - of_mass * momentum / mass) / mass

    def _energy(self, name: str) -> float:
        at, of_at = np.array([self.end]), np.array([self.of_end])
        if self.solved.log.state["gravity"] or self.solved.tangents.of_state[self.parameter, GRAVITY]:
            return math.nan  # no formula: the moved history gives it
        total = 0.0
        for link in self.layout.links.get(name, ()):
            z, transit, of_z, of_transit = self._link(link)
            for end in (link.left_end, link.right_end):
                inside = self.history.signals.wave(end).between(at - transit, at)
                moved = self.signals.wave(end).square(
                    self.end - transit, self.end, self.of_end - of_transit, self.of_end
                )
                total += of_z * float(inside[0]) + z * moved
        for node, mass, of_mass in self._masses(name):
            velocity = self.signals.velocity(node)
            v = float(velocity.value(at)[0])
            total += 0.5 * of_mass * v * v + mass * v * float(velocity.derivative(at, of_at)[0])
        for node in self.layout.nodes[name]:
            spring = float(self.solved.log.nodes["spring"][node])
            stiffer = self._numbers(self.solved.tangents.of_nodes, node, SPRING)
            if spring or stiffer:
                displacement = self.signals.displacement(node)
                u = float(displacement.value(at)[0])
                total += 0.5 * stiffer * u * u + spring * u * float(displacement.derivative(at, of_at)[0])
        return total

    def sampled(self, channel: str, times: Array) -> Array:
        """Return the derivatives of a channel at fixed times, (n,), NaN without formula or at fronts."""
        quantity, _, rest = channel.partition(":")
        still = np.zeros(len(times))
        if quantity == "force" and rest in self.number:
            return self.signals.force(self.number[rest]).derivative(times, still)
        if quantity == "gap" and rest in self.number:
            record = self.solved.log.contacts[self.number[rest]]
            sides = (
                self.signals.displacement(int(record[side])).derivative(times, still) for side in ("left", "right")
            )
            left, right = sides
            return np.asarray(right - left + self._numbers(self.solved.tangents.of_contacts, self.number[rest], GAP))
        if quantity in ("velocity", "position") and rest in self.layout.nodes and rest not in self.layout.links:
            node = self.layout.nodes[rest][0]
            signal = self.signals.velocity(node) if quantity == "velocity" else self.signals.displacement(node)
            return signal.derivative(times, still)
        return np.full(len(times), math.nan)  # the moved history gives it
