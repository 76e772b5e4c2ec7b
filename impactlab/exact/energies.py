"""Momentum and energy of the rods of an exact history, and its energy book."""

from __future__ import annotations

import numpy as np

from impactlab.exact.network import Integers, Layout, Link
from impactlab.exact.signals import Signals, clenshaw, gauss
from impactlab.history.base import EnergyBook
from impactlab.scene.problem import Scene
from impactlab.types import Array

MAX_SAMPLES = 4000
EVEN_SAMPLES = 201


def link_momentum(layout: Layout, signals: Signals, link: Link, t: Array) -> Array:
    """Return the momentum of a link [N s]: Z times the waves inside it, integrated over their emission."""
    z = float(layout.network.impedance[link.left_end])
    inside = sum(
        (signals.carried(end)(t) - signals.carried(end)(t - link.transit) for end in (link.left_end, link.right_end)),
        np.zeros_like(t),
    )
    return np.asarray(z * (inside + 0.5 * layout.network.gravity * link.transit**2))


def link_energy(layout: Layout, signals: Signals, link: Link, t: Array) -> Array:
    """Return kinetic and strain energy of a link [J]: Z times the integral of both waves squared."""
    net = layout.network
    z = float(net.impedance[link.left_end])
    g = net.gravity
    lag = link.transit
    total = np.zeros_like(t)
    for end in (link.left_end, link.right_end):
        wave, carried = signals.wave(end), signals.carried(end)
        total += wave.between(t - lag, t)
        if g != 0.0:  # on the way a wave gains g/2 times its age
            first = -carried(t - lag) * lag + carried.integral(t, False) - carried.integral(t - lag, False)
            total += g * first + g * g * lag**3 / 12.0
    return z * total


def rod_momentum(layout: Layout, signals: Signals, name: str, t: Array) -> Array:
    """Return the momentum of a rod with its end masses [N s], shape of t (n,)."""
    total = np.zeros_like(t)
    for link in layout.links[name]:
        total += link_momentum(layout, signals, link, t)
    for node in layout.nodes[name]:
        mass = float(layout.network.mass[node])
        if 0.0 < mass < np.inf:
            total += mass * signals.velocity(node)(t)
    return total


def rod_energy(layout: Layout, signals: Signals, name: str, t: Array) -> Array:
    """Return the energy of a rod with its end masses and end springs [J], shape of t (n,)."""
    total = np.zeros_like(t)
    for link in layout.links[name]:
        total += link_energy(layout, signals, link, t)
    net = layout.network
    for node in layout.nodes[name]:
        if 0.0 < net.mass[node] < np.inf:
            total += 0.5 * net.mass[node] * signals.velocity(node)(t) ** 2
        if net.spring[node] > 0.0:
            total += 0.5 * net.spring[node] * signals.displacement(node)(t) ** 2
    return total


def sample_times(signals: Signals, layout: Layout, duration: float) -> Array:
    """Return the instants of the book: breaks of all junctions, thinned where they are many, and an equal grid."""
    log = signals.log
    stops = [log.stop[j, : log.records[j]] for j in range(len(layout.network.node_of) - 1)]
    breaks = np.unique(np.concatenate(stops))
    breaks = breaks[(breaks > 0.0) & (breaks < duration)]
    if len(breaks) > MAX_SAMPLES:
        breaks = breaks[:: len(breaks) // MAX_SAMPLES + 1]
    return np.unique(np.concatenate([np.linspace(0.0, duration, EVEN_SAMPLES), breaks]))


class SpringContact:
    """Stored and lost energy of a spring-and-dashpot contact of a solved network."""

    def __init__(self, layout: Layout, signals: Signals, contact: int) -> None:
        net = layout.network
        left, right = int(net.left[contact]), int(net.right[contact])
        self.stiffness, self.damping = float(net.stiffness[contact]), float(net.damping[contact])
        self.gap = float(net.gap[contact])
        self.places = signals.displacement(left), signals.displacement(right)
        self.rates = signals.velocity(left), signals.velocity(right)
        self.force = signals.force(contact)
        self.begins = np.maximum(self.force.start, 0.0)
        self.loaded = np.any(self.force.table != 0.0, axis=0)

    def held(self, t: Array) -> Array:
        """Return the energy of the spring [J], shape of t."""
        depth = np.maximum(0.0, self.places[0](t) - self.places[1](t) - self.gap)
        return np.asarray(0.5 * self.stiffness * depth**2)

    def within(self, piece: Integers, until: Array) -> Array:
        """Return the loss from the start of each piece to a time in it [J], shape of both (n,).

        While the force is up the dashpot loses d d'^2. A spring that is unloaded but still overlapped returns nothing
        back: it relaxes against the dashpot, and its energy is lost as the faces part.
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


def energy_book(scene: Scene, layout: Layout, signals: Signals, duration: float) -> EnergyBook:
    """Return the energies of a history at its breaks and on an equal grid."""
    return energies_at(scene, layout, signals, sample_times(signals, layout, duration))


def energies_at(scene: Scene, layout: Layout, signals: Signals, t: Array) -> EnergyBook:
    """Return the energies at times t [s], (n,); work and losses are those since t[0]."""
    net = layout.network
    bodies: dict[str, Array] = {}
    work = np.zeros_like(t)
    for name, body in scene.in_order.items():
        if name in layout.links:
            energy = rod_energy(layout, signals, name, t)
            # a difference of large sums: below their rounding it is zero
            bodies[name] = np.where(np.abs(energy) < 1e-14 * np.max(np.abs(energy)), 0.0, energy)
            if net.gravity != 0.0:
                work += gravity_work(layout, signals, name, t)
        elif body.rigid_mass < np.inf:
            node, mass = layout.nodes[name][0], body.rigid_mass
            bodies[name] = 0.5 * mass * signals.velocity(node)(t) ** 2
            work += mass * net.gravity * (signals.displacement(node)(t) - signals.displacement(node)(t[:1]))
        else:
            bodies[name] = np.zeros_like(t)
    for pushed in np.flatnonzero(net.push):
        displacement = signals.displacement(int(pushed))
        work += net.push[pushed] * (displacement(t) - displacement(t[:1]))
    ends = np.zeros_like(t)
    for held in np.flatnonzero(net.dashpot > 0.0):
        velocity = signals.velocity(int(held))
        spent = velocity.integral(t, True) - velocity.integral(t[:1], True)
        ends += net.dashpot[held] * spent
    springs = [SpringContact(layout, signals, c) for c in range(len(net.left)) if net.stiffness[c] >= 0.0]
    stored = sum((spring.held(t) for spring in springs), np.zeros_like(t))
    lost = sum((spring.lost(t) - spring.lost(t[:1]) for spring in springs), np.zeros_like(t))
    return EnergyBook(t, bodies, stored, {"contact": lost, "ends": ends, "unresolved": np.zeros_like(t)}, work)


def gravity_work(layout: Layout, signals: Signals, name: str, t: Array) -> Array:
    """Return the work of gravity on a rod [J]: g times the integral of its momentum."""
    net = layout.network
    g = net.gravity
    total = np.zeros_like(t)
    for link in layout.links[name]:
        z = float(net.impedance[link.left_end])
        for end in (link.left_end, link.right_end):
            carried = signals.carried(end)
            inside = carried.integral(t, False) - carried.integral(t - link.transit, False)
            total += z * g * (inside - inside[0])
        total += z * g * 0.5 * g * link.transit**2 * (t - t[0])
    for node in layout.nodes[name]:
        mass = float(net.mass[node])
        if 0.0 < mass < np.inf:
            displacement = signals.displacement(node)
            total += mass * g * (displacement(t) - displacement(t[:1]))
    return total
