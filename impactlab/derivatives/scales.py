"""The size that a number may have in its scene, for one that is zero."""

from __future__ import annotations

import math

from impactlab.derivatives.parameters import Parameter
from impactlab.scene.facts import field_acceleration
from impactlab.scene.problem import Scene


def scale_of(scene: Scene, parameter: Parameter) -> float:
    """Return the size of a parameter in its scene, in SI units.

    It is NaN where its unit has none. It is made of the lightest mass, the fastest velocity and the round trip.
    """
    mass, velocity, time = _scales(scene)
    scales = {
        "m": velocity * time, "m/s": velocity, "m/s2": velocity / time, "s": time, "kg": mass,
        "N": mass * velocity / time, "N/m": mass / time**2, "N s/m": mass / time,
    }  # fmt: skip
    scale = scales.get(parameter.unit, math.nan)
    return scale if 0.0 < scale < math.inf else math.nan


def _scales(scene: Scene) -> tuple[float, float, float]:
    """Return lightest mass [kg], fastest velocity [m/s] and round trip [s] of a scene."""
    bodies = scene.bodies.values()
    mass = min((body.moving_mass for body in bodies), default=math.nan)
    time = scene.round_trip if scene.round_trip > 0.0 else scene.duration
    force = max((end.largest_force(scene.duration) for body in bodies for _, end in body.ends), default=0.0)
    speeds = [abs(body.velocity) for body in bodies]
    return mass, max([*speeds, field_acceleration(scene) * time, force * time / mass]), time
