"""A Scotch yoke: a flywheel whose pin moves a slotted slider along x."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.mechanisms.base import AbstractMechanism, Motion, Reading
from impactlab.types import Array, option

FLYWHEEL, RADIUS, SLIDER, TORQUE, GRAVITY = range(5)  # places in the parameters


@final
@dataclass(frozen=True)
class ScotchYoke(AbstractMechanism):
    """Scotch yoke: a flywheel whose pin moves the slot of a slider.

    The slider is at r cos(angle) along x. Its kinetic energy is (J + m r^2 sin^2(angle)) rate^2/2.

    References
    ----------
    Norton1999 (the mechanism; its energy follows from x = r cos(angle)).
    """

    citations = ("Norton1999",)
    examples = (
        {"flywheel": 0.5, "radius": 0.1, "slider": 4.0, "rate": 20.0},
        {"flywheel": 0.02, "radius": 0.2, "slider": 3.0, "angle": 2.0, "torque": 5.0},
    )
    readings = (Reading("slider"), Reading("flywheel", is_angle=True))

    flywheel: float = option(unit="kg m2", above=0.0, description="moment of inertia of the flywheel with its pin")
    radius: float = option(unit="m", above=0.0, description="distance of the pin from the axis")
    slider: float = option(unit="kg", above=0.0, description="mass of the slider")
    angle: float = option(0.0, unit="rad", description="angle of the pin at t = 0, from +x")
    rate: float = option(0.0, unit="rad/s", description="angular rate at t = 0, counterclockwise")
    torque: float = option(0.0, unit="N m", description="constant torque on the flywheel")

    @property
    def mass(self) -> float:
        return self.slider

    def motion(self, gravity: tuple[float, float]) -> Motion:
        least, most = self.flywheel, self.flywheel + self.slider * self.radius**2
        swing = (abs(self.torque) + self.slider * self.radius * math.hypot(*gravity)) / least
        return Motion(
            parameters=np.array([self.flywheel, self.radius, self.slider, self.torque, gravity[0]]),
            position=np.array([self.angle]),
            velocity=np.array([self.rate]),
            stiffness=np.zeros((1, 1)),
            rate=abs(self.rate) * math.sqrt(most / least) + math.sqrt(swing),
        )

    @staticmethod
    def terms(
        parameters: Array, _t: float, p: Array, v: Array, mass: Array, force: Array, rows: Array, values: Array,
        rates: Array,
    ) -> None:  # fmt: skip
        radius, slider, torque = parameters[RADIUS], parameters[SLIDER], parameters[TORQUE]
        gravity = parameters[GRAVITY]
        c, s = math.cos(p[0]), math.sin(p[0])
        if mass.size > 0:
            mass[0] = parameters[FLYWHEEL] + slider * radius**2 * s**2
        force[0] = torque - slider * radius * s * (radius * c * v[0] ** 2 + gravity)
        rows[0], rows[1] = -radius * s, 1.0
        values[0], values[1], values[2] = radius * c, p[0], torque * p[0] + slider * gravity * radius * c
        rates[0], rates[1] = -radius * s * v[0], v[0]
