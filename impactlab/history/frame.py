"""Frames of the centres of mass of bodies that interact.

In them scales of energy and displacement are free of a common drift.

Bodies joined by contacts form a group: by all contacts of a scene, or by those alone that were closed in a run. A wall,
or anything else that holds one of its bodies, fixes the frame of the whole group at rest. The frame of a free group
moves as its centre of mass does without loads on ends: at W(t) = V + g t, with V its momentum over its mass at the
start. A collision is the same in every such frame, so its scales of energy and displacement may not grow where all
bodies fly along together.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.history.energy import CarriedEnergy
from impactlab.numerics.unions import Unions
from impactlab.scene.bodies import SampledLoad
from impactlab.scene.problem import Scene
from impactlab.types import Array


class Group(NamedTuple):
    """Bodies joined by contacts, and the frame of their centre of mass."""

    bodies: tuple[str, ...]
    mass: float  # kg; 0 of a group that something holds
    velocity: float  # m/s, of its frame at t = 0; 0 of a group that something holds
    gravity: float  # m/s2, by which its frame gains speed; 0 of a group that something holds
    force: float  # N, constant, on the ends of its bodies; 0 of a group that something holds
    loads: tuple[SampledLoad, ...] = ()  # over time, on the ends of its bodies

    def velocity_at(self, t: Array) -> Array:
        """Return the velocity of the frame [m/s] at times t [s], shape of t."""
        return np.asarray(self.velocity + self.gravity * t)

    def displacement(self, t: Array) -> Array:
        """Return how far the frame has moved [m] at times t [s], shape of t."""
        return np.asarray(self.velocity * t + 0.5 * self.gravity * t * t)


def groups(scene: Scene, touched: Collection[str] | None = None) -> tuple[Group, ...]:
    """Return the groups of bodies joined by contacts, each body in one.

    A wall joins no bodies but holds all it meets.

    ``touched`` are the names of the contacts that were closed in a run; all contacts of the scene if not given.
    """
    key = _closed(scene, touched)
    if key not in scene.derived:
        scene.derived[key] = _groups(scene, key)
    found: tuple[Group, ...] = scene.derived[key]
    return found


def frames(scene: Scene, touched: Collection[str] | None = None) -> Mapping[str, Group]:
    """Return the group of each body by its name; ``touched`` as of `groups`."""
    key = "frames", _closed(scene, touched)
    if key not in scene.derived:
        scene.derived[key] = {name: group for group in groups(scene, touched) for name in group.bodies}
    found: Mapping[str, Group] = scene.derived[key]
    return found


def _closed(scene: Scene, touched: Collection[str] | None) -> frozenset[str] | None:
    """Return the contacts that join bodies; None of all."""
    closed = None if touched is None else frozenset(touched)
    return None if closed is None or len(closed) == len(scene.contacts) else closed


def _groups(scene: Scene, touched: frozenset[str] | None) -> tuple[Group, ...]:
    joined = Unions[str]()
    pulled = scene.gravity != 0.0  # a body that does not fall with the others holds their frame
    free = {name for name, body in scene.bodies.items() if body.is_free and (body.falls or not pulled)}
    held = {name for name, body in scene.bodies.items() if body.moves and name not in free}
    for contact in scene.contacts:
        if touched is not None and contact.name not in touched:
            continue
        left, right = contact.left.body, contact.right.body
        moves = [scene.bodies[name].moves for name in (left, right)]
        if not all(moves):
            held.add(left if moves[0] else right)
        else:
            joined.join(left, right)
    members: dict[str, list[str]] = {}
    for name in scene.in_order:
        members.setdefault(joined.leader(name), []).append(name)
    return tuple(_group(scene, names, held) for names in members.values())


def _group(scene: Scene, names: Sequence[str], held: set[str]) -> Group:
    bodies = [scene.bodies[name] for name in names]
    if not held.isdisjoint(names) or not all(body.moves for body in bodies):
        return Group(tuple(names), 0.0, 0.0, 0.0, 0.0)
    mass = sum(body.moving_mass for body in bodies)
    momentum = sum(body.moving_mass * body.velocity for body in bodies)
    force = sum(body.end_force for body in bodies)
    loads = tuple(load.sampled(scene.duration) for body in bodies for _, load in body.loads)
    return Group(tuple(names), mass, momentum / mass, scene.gravity, force, loads)


def touched_in(history: AbstractHistory) -> frozenset[str]:
    """Return the names of the contacts, links included, that were closed in a run."""
    return frozenset(span.contact for span in history.contacts).union(history.method.links)


def drift_velocities(scene: Scene, touched: Collection[str] | None = None) -> dict[str, float]:
    """Return frame velocities of the bodies' groups at t = 0 [m/s]; 0 if held."""
    return {name: group.velocity for name, group in frames(scene, touched).items()}


def drift(scene: Scene, name: str, t: Array, touched: Collection[str] | None = None) -> Array:
    """Return the displacement of the frame of a body's group [m] at times t [s].

    It has the shape of t, and is 0 where the group is held.

    ``name`` is that of a body, or of a channel: ``position:hammer``, ``displacement:rod@0``.
    """
    return np.zeros(np.shape(t)) - in_frame(frames(scene, touched), name, t, 0.0)


def common_drift(scene: Scene, name: str, t: Array, touched: Collection[str]) -> Array:
    """Return the `drift` to subtract from the scale of a displacement [m].

    It has the shape of t. It is 0 for a body without contacts, loads and strains: all its motion is drift, and the rest
    is rounding and the error of the scheme, which is no scale.
    """
    group = frames(scene, touched).get(_body_of(name))
    if group is not None and _only_drifts(scene, group):
        return np.zeros(np.shape(t))
    return drift(scene, name, t, touched)


def _body_of(name: str) -> str:
    place = name.partition(":")[2] or name
    return place.rpartition("@")[0] or place


def _only_drifts(scene: Scene, group: Group) -> bool:
    """Return whether a group is one body that moves as its frame does.

    Nothing meets, loads or strains it.
    """
    if len(group.bodies) > 1 or group.loads or group.force != 0.0:
        return False
    body = scene.bodies[group.bodies[0]]
    return body.rotation is None and (body.elastic is None or body.elastic.displacement is None)


def in_frame(found: Mapping[str, Group], name: str, t: Array, moved: Array | float) -> Array:
    """Return a displacement relative to the frame of a body's group [m].

    ``t`` are the times of ``moved`` [s]. ``found`` are the groups by body, ``name`` is that of the body or of a
    channel.
    """
    group = found.get(_body_of(name))
    if group is None or (group.velocity == 0.0 and group.gravity == 0.0):
        return np.asarray(moved)  # held, of a mechanism by its ground; or at rest
    return np.asarray(moved - group.displacement(t))


def carried_energy(scene: Scene, t: Array, touched: Collection[str] | None = None) -> CarriedEnergy | None:
    """Return the energy (n,) [J] of the frames of free groups at times t.

    It is None where all bodies drift alone. In its frame a group begins with its energy less M V^2/2; the work of a
    load is that on the motion within the frame: gravity does none, a force F on an end F (u - D) with D the way of the
    frame.
    """
    found = groups(scene, touched)
    return None if drifts_alone(scene, found) else carried_by(found, t)


def drifts_alone(scene: Scene, found: Sequence[Group]) -> bool:
    """Return whether each moving body is a group of its own without strain or force.

    No contact overlaps, no end is loaded. Nothing is exchanged then, and a scheme's energy less that of the drift is
    rounding, or a term of the scheme's own. Faces that overlap at t = 0 may press without a period of contact.
    """
    if any(contact.gap < 0.0 for contact in scene.contacts):
        return False
    for group in found:
        bodies = [scene.bodies[name] for name in group.bodies if scene.bodies[name].moves]
        if len(bodies) > 1 or (bodies and (group.mass == 0.0 or group.force != 0.0 or group.loads)):
            return False
        if any(body.elastic is not None and body.elastic.displacement is not None for body in bodies):
            return False
    return True


def carried_by(found: Sequence[Group], t: Array) -> CarriedEnergy:
    """Return the energy (n,) [J] of the frames of these groups at times t [s]."""
    kinetic, work = 0.0, np.zeros_like(t)
    for group in found:
        kinetic += 0.5 * group.mass * group.velocity**2
        if group.gravity == 0.0 and group.force == 0.0 and not group.loads:
            continue
        way = group.displacement(t)
        # Gravity works on all of the momentum, also on the part that the force has given: M (V + g t) + F t.
        work += group.gravity * (group.mass * way + 0.5 * group.force * t * t) + group.force * way
        for load in group.loads:  # g times the momentum given so far, and F (V + g t): by parts, over time
            work += (group.velocity + group.gravity * t) * load.impulse(t)
    return CarriedEnergy(kinetic, work)
