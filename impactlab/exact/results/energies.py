"""Momentum and energy of the rods of an exact history, and its energy book."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from impactlab.exact.results.branch_energies import BranchContact
from impactlab.exact.results.signals import Signals, clenshaw, gauss
from impactlab.exact.setup.end_loads import work_of_loads
from impactlab.exact.setup.network import Link, Log, NetworkLayout
from impactlab.history.energy import EnergyBook
from impactlab.scene.problem import Scene
from impactlab.types import Array, Ints

MAX_SAMPLES = 4000
EVEN_SAMPLES = 201


def masses(signals: Signals, nodes: tuple[int, ...]) -> Iterator[tuple[int, float]]:
    """Yield the nodes that carry a mass, and it [kg]."""
    every = signals.log.nodes["mass"]
    for node in nodes:
        if 0.0 < every[node] < np.inf:
            yield node, float(every[node])


def rod_momentum(layout: NetworkLayout, signals: Signals, name: str, t: Array) -> Array:
    """Return the momentum of a rod with its end masses [N s].

    It has the shape of t (n,). That of a link is Z times the waves inside it, integrated over their emission.
    """
    total = np.zeros_like(t)
    for link in layout.links[name]:
        inside = np.zeros_like(t)
        for end in (link.left_end, link.right_end):
            inside = inside + (signals.carried(end)(t) - signals.carried(end)(t - link.transit))
        total += link.segment.impedance * (inside + 0.5 * signals.gravity * link.transit**2)
    for node, mass in masses(signals, layout.nodes[name]):
        total += mass * signals.velocity(node)(t)
    return total


def link_energy(signals: Signals, link: Link, t: Array) -> Array:
    """Return kinetic and strain energy of a link [J]: Z times its integral of both waves squared."""
    g, lag, total = signals.gravity, link.transit, np.zeros_like(t)
    for end in (link.left_end, link.right_end):
        wave, carried = signals.wave(end), signals.carried(end)
        total += wave.between(t - lag, t)
        if g != 0.0:  # on the way a wave gains g/2 times its age
            first = -carried(t - lag) * lag + carried.integral(t, False) - carried.integral(t - lag, False)
            total += g * first + g * g * lag**3 / 12.0
    return link.segment.impedance * total


def rod_energy(layout: NetworkLayout, signals: Signals, name: str, t: Array) -> Array:
    """Return the energy of a rod with its end masses and springs [J], shape of t (n,)."""
    total = np.zeros_like(t)
    for link in layout.links[name]:
        total += link_energy(signals, link, t)
    masses_of_nodes, springs = signals.log.nodes["mass"], signals.log.nodes["spring"]
    for node in layout.nodes[name]:
        if 0.0 < masses_of_nodes[node] < np.inf:
            total += 0.5 * masses_of_nodes[node] * signals.velocity(node)(t) ** 2
        if springs[node] > 0.0:
            total += 0.5 * springs[node] * signals.displacement(node)(t) ** 2
    return total


def sample_times(log: Log, duration: float) -> Array:
    """Return the sampling times of the energies [s].

    They are breaks of all junctions, thinned where they are many, and an equal grid.
    """
    stops = [row["stop"][:count] for row, count in zip(log.pieces, log.junctions["records"], strict=True)]
    breaks = np.unique(np.concatenate(stops))
    breaks = breaks[(breaks > 0.0) & (breaks < duration)]
    if len(breaks) > MAX_SAMPLES:
        breaks = breaks[:: len(breaks) // MAX_SAMPLES + 1]
    return np.unique(np.concatenate([np.linspace(0.0, duration, EVEN_SAMPLES), breaks]))


class SpringContact:
    """Stored and lost energy of a spring-and-dashpot contact of a solved network."""

    def __init__(self, signals: Signals, contact: int) -> None:
        record, self.number = signals.log.contacts[contact], contact
        left, right = int(record["left"]), int(record["right"])
        self.stiffness, self.damping, self.gap = (float(record[name]) for name in ("stiffness", "damping", "gap"))
        self.places = signals.displacement(left), signals.displacement(right)
        self.rates = signals.velocity(left), signals.velocity(right)
        self.force = signals.force(contact)
        self.begins = np.maximum(self.force.start, 0.0)
        self.loaded = np.any(self.force.table != 0.0, axis=0)

    def held(self, t: Array) -> Array:
        """Return the energy of the spring [J], shape of t."""
        depth = np.maximum(0.0, self.places[0](t) - self.places[1](t) - self.gap)
        return np.asarray(0.5 * self.stiffness * depth**2)

    def within(self, piece: Ints, until: Array) -> Array:
        """Return the loss within pieces [J].

        It is from the start of each piece to a time in it, shape of both (n,). While the force is up the dashpot loses
        d d'^2. A spring that is unloaded but still overlapped returns nothing back: it relaxes against the dashpot, and
        its energy is lost as the faces part.
        """
        x, w = gauss(len(self.force.table) + 2)
        begin = self.begins[piece]
        half = 0.5 * (until - begin)
        at = begin[:, None] + half[:, None] * (x + 1.0)
        start, stop = self.force.start[piece][:, None], self.force.stop[piece][:, None]
        y = (2.0 * at - start - stop) / (stop - start)
        wide = piece[:, None]
        rate = clenshaw(self.rates[0].table, wide, y) - clenshaw(self.rates[1].table, wide, y)
        damped = self.damping * ((rate * rate) @ w) * half
        relaxed = np.maximum(self.held(begin) - self.held(until), 0.0)
        return np.asarray(np.where(self.loaded[piece], damped, relaxed))

    def lost(self, t: Array) -> Array:
        """Return the loss so far [J], shape of t (n,)."""
        if self.damping == 0.0:
            return np.zeros_like(t)
        every = np.arange(len(self.force.stop))
        each = np.where(self.force.stop > 0.0, self.within(every, self.force.stop), 0.0)
        whole = np.concatenate([[0.0], np.cumsum(each)])
        piece = self.force.pieces(t)
        return np.asarray(whole[piece] + self.within(piece, np.maximum(t, self.begins[piece])))


def contacts_with_energy(signals: Signals) -> list[SpringContact | BranchContact]:
    """Return the contacts of a solved network that store or lose energy."""
    contacts = signals.log.contacts
    branched = contacts["branch"] >= 0
    springs = np.flatnonzero((contacts["stiffness"] >= 0.0) & ~branched).tolist()
    yielding = np.flatnonzero(branched & np.isfinite(contacts["elastic"])).tolist()
    return [SpringContact(signals, c) for c in springs] + [BranchContact(signals, c) for c in yielding]


def energies_at(scene: Scene, layout: NetworkLayout, signals: Signals, t: Array) -> EnergyBook:
    """Return the energies at times t [s], (n,); work and losses are those since t[0]."""
    log, g = signals.log, signals.gravity
    bodies: dict[str, Array] = {}
    work = np.zeros_like(t)
    for name, body in scene.in_order.items():
        if name in layout.links:
            energy = rod_energy(layout, signals, name, t)
            # a difference of large sums: below their rounding it is zero
            bodies[name] = np.where(np.abs(energy) < 1e-14 * np.max(np.abs(energy)), 0.0, energy)
            if g != 0.0:
                work += gravity_work(layout, signals, name, t)
        elif body.rigid_mass < np.inf:
            node, mass = layout.nodes[name][0], body.rigid_mass
            bodies[name] = 0.5 * mass * signals.velocity(node)(t) ** 2
            work += mass * g * signals.travel(node, t)
        else:
            bodies[name] = np.zeros_like(t)
    for node in np.flatnonzero(log.nodes["end_force"]).tolist():
        if log.nodes["last_sample"][node] == log.nodes["first_sample"][node]:
            work += log.nodes["end_force"][node] * signals.travel(node, t)
    work += work_of_loads(log, signals, t)
    ends = np.zeros_like(t)
    for node in np.flatnonzero(log.nodes["dashpot"] > 0.0).tolist():
        velocity = signals.velocity(node)
        ends += log.nodes["dashpot"][node] * (velocity.integral(t, True) - velocity.integral(t[:1], True))
    springs = contacts_with_energy(signals)
    stored = sum((spring.held(t) for spring in springs), np.zeros_like(t))
    names = [scene.contacts[place].name for place in layout.places]
    each = {names[spring.number]: spring.lost(t) - spring.lost(t[:1]) for spring in springs}
    booked = {"contact": sum(each.values(), np.zeros_like(t)), "ends": ends, "unresolved": np.zeros_like(t)}
    return EnergyBook(t, bodies, stored, booked, work, by_contact=each)


def gravity_work(layout: NetworkLayout, signals: Signals, name: str, t: Array) -> Array:
    """Return the work of gravity on a rod [J]: g times the integral of its momentum."""
    g, total = signals.gravity, np.zeros_like(t)
    for link in layout.links[name]:
        z = link.segment.impedance
        for end in (link.left_end, link.right_end):
            carried = signals.carried(end)
            inside = carried.integral(t, False) - carried.integral(t - link.transit, False)
            total += z * g * (inside - inside[0])
        total += z * g * 0.5 * g * link.transit**2 * (t - t[0])
    for node, mass in masses(signals, layout.nodes[name]):
        total += mass * g * signals.travel(node, t)
    return total
