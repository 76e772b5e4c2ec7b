"""Rise times of contact forces: how fine a description must be."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from impactlab.contact.power_law import AbstractHystereticLaw, Hertz
from impactlab.scene.facts import field_acceleration, impedance_of
from impactlab.scene.method import Method, stiffness_of
from impactlab.scene.problem import Contact, Point, Scene
from impactlab.scene.recent import KeepsResults


class Times(NamedTuple):
    """Rise time [s] and stiffness [N/m] of a contact, as `rise_time` and `tangent_of` give them."""

    rise: float
    tangent: float


def _all_times(scene: Scene, method: Method) -> dict[str, Times]:
    speed = meeting_speed(scene) if scene.contacts else 0.0  # once: it looks at all bodies
    return {
        contact.name: Times(rise_time(scene, method, contact, speed), tangent_of(scene, method, contact, speed))
        for contact in scene.contacts
    }


times_of = KeepsResults(_all_times, lambda _times: True, limited=False)
"""Times of all contacts of a scene under the laws of a method, by name; found once."""


def shortest_rise(scene: Scene, method: Method) -> float:
    """Return the shortest rise time [s] of contacts; the duration without contacts."""
    return min((times.rise for times in times_of(scene, method).values()), default=scene.duration)


def rise_time(scene: Scene, method: Method, contact: Contact, speed: float | None = None) -> float:
    """Return the time in which the force of a contact rises [s].

    It is a quarter of a round trip where its law is unknown.

    A compliant contact rises with its own oscillation sqrt(m/k), or against the impedance of the rod, Z/k; of a power
    law k is the tangent at the indentation that brings the bodies to the same speed. A hard one rises at once, and then
    falls as the mass gives its momentum to the waves, M/Z. ``speed`` [m/s] is that at which the bodies of the scene
    meet, if known.
    """
    mass, mobility = _inertia(scene, contact)
    if method.laws[contact.name].hard:
        return min(scene.duration, mass * mobility) if mobility > 0.0 else scene.duration
    stiffness = tangent_of(scene, method, contact, speed)
    times = [1.0 / (mobility * stiffness)] if mobility > 0.0 else []
    times = [time for time in (*times, math.sqrt(mass / stiffness)) if math.isfinite(time)]
    return min([scene.duration, *times]) if times else 0.25 * scene.round_trip


def tangent_of(scene: Scene, method: Method, contact: Contact, speed: float | None) -> float:
    """Return the stiffness of a contact [N/m].

    Of a power law it is the tangent at the indentation of `rise_time`; ``speed`` as there. It is inf of a hard contact,
    and nan where it is unknown.
    """
    law = method.laws[contact.name]
    if law.hard:
        return math.inf
    if law.is_spring:
        known = stiffness_of(scene, method, contact)
        return math.nan if known is None else known
    if isinstance(law, Hertz | AbstractHystereticLaw):
        met = meeting_speed(scene) if speed is None else speed
        return _tangent(law.stiffness, law.exponent, met, *_inertia(scene, contact))
    return math.nan


def _inertia(scene: Scene, contact: Contact) -> tuple[float, float]:
    """Return the mass of a contact's faces [kg] and the mobility [m/(N s)].

    The mass is that of both in series, the mobility that of their rods.
    """
    masses = [mass for mass in (_mass_at(scene, point) for point in contact.faces) if mass > 0.0]
    mass = 1.0 / sum(1.0 / each for each in masses) if masses and min(masses) < math.inf else math.inf
    return mass, 1.0 / impedance_of(scene, contact)


def meeting_speed(scene: Scene) -> float:
    """Return the speed at which the bodies of a scene meet [m/s].

    It is that at the start, or one that loads may cause.
    """
    velocities = [body.velocity for body in scene.bodies.values() if body.moves]
    given = max(velocities, default=0.0) - min(*velocities, 0.0, 0.0)
    pushed = [abs(rod.end_force) / rod.segments[0].impedance for rod in scene.wave_bodies]
    pushed += [
        load.largest(scene.duration) / rod.segments[0].impedance for rod in scene.wave_bodies for _, load in rod.loads
    ]
    strained = []
    for rod in scene.wave_bodies:
        if rod.displacement is not None:
            u = rod.displacement(np.linspace(0.0, rod.length, 21))
            strained.append(2.0 * float(np.ptp(u)) / rod.round_trip)
    return max(given, field_acceleration(scene) * scene.duration, *pushed, *strained, 0.0)


def _mass_at(scene: Scene, point: Point) -> float:
    """Return the mass directly at a face [kg].

    It is 0 for a bare end of a rod, inf for a wall.
    """
    body = scene.bodies[point.body]
    if body.waves is None:
        return math.inf if math.isnan(body.rigid_mass) else body.rigid_mass
    end = body.waves.left if point.x == 0.0 else body.waves.right
    return end.value if end.kind == "mass" and point.x in (0.0, body.length) else 0.0


def _tangent(stiffness: float, exponent: float, speed: float, mass: float, mobility: float) -> float:
    """Return the tangent of F = K d^n at an indentation [N/m].

    A speed [m/s] causes the indentation.
    """
    depths = []
    if mass < math.inf:
        depths.append((0.5 * (exponent + 1.0) * mass * speed**2 / stiffness) ** (1.0 / (exponent + 1.0)))
    if mobility > 0.0:
        depths.append((speed / mobility / stiffness) ** (1.0 / exponent))
    depth = min(depths, default=0.0)
    return exponent * stiffness * depth ** (exponent - 1.0) if depth > 0.0 else math.nan
