"""Rigid bodies: masses, and walls that never move."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from impactlab.scene.bodies.base import Body


@final
@dataclass(frozen=True)
class Mass(Body):
    """A rigid body."""

    mass: float  # kg
    velocity: float = 0.0  # m/s at t = 0

    kind = "mass"
    own_channels = (("position", "displacement"), ("velocity", "velocity"))

    @property
    def moving_mass(self) -> float:
        return self.mass

    def face_channel(self, x: float) -> str:
        return f"position:{self.name}"


@final
@dataclass(frozen=True)
class Wall(Body):
    """A rigid body that never moves."""

    kind = "wall"
    moves = False

    @property
    def moving_mass(self) -> float:
        return math.inf
