"""The times that say how fine a description must be: of contacts, of waves."""

from __future__ import annotations

import math

from impactlab.contact.power_law import AbstractHystereticLaw, Hertz
from impactlab.scene.bodies import WaveBody
from impactlab.scene.facts import impedance_of, rods_of
from impactlab.scene.method import Method, stiffness_of
from impactlab.scene.problem import Contact, Point, Scene


def speed_of(scene: Scene) -> float:
    """Return the velocity with which the bodies of a scene meet [m/s]: that at the start, or what loads may give."""
    velocities = [body.velocity for body in scene.bodies.values() if body.moves]
    given = max(velocities, default=0.0) - min(*velocities, 0.0, 0.0)
    pushed = [abs(rod.end_force) / rod.segments[0].impedance for rod in rods_of(scene)]
    strained = [_strain_speed(rod) for rod in rods_of(scene)]
    return max(given, abs(scene.gravity) * scene.duration, *pushed, *strained, 0.0)


def _strain_speed(rod: WaveBody) -> float:
    if rod.displacement is None:
        return 0.0
    import numpy as np

    u = rod.displacement(np.linspace(0.0, rod.length, 21))
    return float(np.ptp(u)) / rod.round_trip * 2.0


def rise_time(scene: Scene, method: Method, contact: Contact) -> float:
    """Return the time in which the force of a contact rises [s]; a quarter of a round trip where its law is unknown.

    A soft contact rises with its own oscillation sqrt(m/k), or as the rod behind it gives way, Z/k; of a power law k is
    the tangent at the indentation that brings the bodies to the same speed. A hard one rises at once, and then falls as
    the mass gives its momentum to the waves, M/Z.
    """
    law = method.laws[contact.name]
    masses = [mass for mass in (_mass_at(scene, point) for point in (contact.left, contact.right)) if mass > 0.0]
    mass = 1.0 / sum(1.0 / each for each in masses) if masses and min(masses) < math.inf else math.inf
    give = 1.0 / impedance_of(scene, contact)
    if law.hard:
        return min(scene.duration, mass * give) if give > 0.0 else scene.duration
    if law.is_spring:
        known = stiffness_of(scene, method, contact)
        stiffness = math.nan if known is None else known
    elif isinstance(law, Hertz | AbstractHystereticLaw):
        stiffness = _tangent(law.stiffness, law.exponent, speed_of(scene), mass, give)
    else:
        stiffness = math.nan
    times = [1.0 / (give * stiffness)] if give > 0.0 else []
    times += [math.sqrt(mass / stiffness)]
    times = [time for time in times if math.isfinite(time)]
    return min([scene.duration, *times]) if times else 0.25 * scene.round_trip


def _mass_at(scene: Scene, point: Point) -> float:
    """Return the mass right at a face [kg]: 0 of a bare end of a rod, inf of a wall."""
    body = scene.bodies[point.body]
    if body.waves is None:
        return math.inf if math.isnan(body.rigid_mass) else body.rigid_mass
    end = body.waves.left if point.x == 0.0 else body.waves.right
    return end.value if end.kind == "mass" and point.x in (0.0, body.length) else 0.0


def _tangent(stiffness: float, exponent: float, speed: float, mass: float, give: float) -> float:
    """Return the tangent of F = K d^n at the indentation that a speed brings about [N/m]."""
    depths = []
    if mass < math.inf:
        depths.append((0.5 * (exponent + 1.0) * mass * speed**2 / stiffness) ** (1.0 / (exponent + 1.0)))
    if give > 0.0:
        depths.append((speed / give / stiffness) ** (1.0 / exponent))
    depth = min(depths, default=0.0)
    return exponent * stiffness * depth ** (exponent - 1.0) if depth > 0.0 else math.nan
