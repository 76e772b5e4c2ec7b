"""Rigid bodies: masses, and walls that never move."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from impactlab.scene.bodies.base import Body
from impactlab.types import SideFacts


@final
@dataclass(frozen=True)
class Mass(Body):
    """A rigid body."""

    mass: float  # kg
    velocity: float = 0.0  # m/s at t = 0

    own_channels = (("position", "displacement"), ("velocity", "velocity"))

    @property
    def kind(self) -> str:
        return "mass"

    @property
    def moving_mass(self) -> float:
        return self.mass

    @property
    def rigid_mass(self) -> float:
        return self.mass

    def face_channel(self, x: float) -> str:
        return f"position:{self.name}"

    def side_facts(self, x: float, element_length: float) -> SideFacts:
        return rigid_facts(self)


@final
@dataclass(frozen=True)
class Wall(Body):
    """A rigid body that never moves."""

    moves = False

    @property
    def kind(self) -> str:
        return "wall"

    @property
    def moving_mass(self) -> float:
        return math.inf

    @property
    def rigid_mass(self) -> float:
        return math.inf

    @property
    def is_held(self) -> bool:
        return True

    @property
    def is_free(self) -> bool:
        return False

    def side_facts(self, x: float, element_length: float) -> SideFacts:
        return rigid_facts(self)


def rigid_facts(body: Mass | Wall) -> SideFacts:
    """Return the facts of a face of a rigid body."""
    nan = math.nan
    return SideFacts(body.kind, nan, nan, nan, nan, nan, body.rigid_mass, 0.0)
