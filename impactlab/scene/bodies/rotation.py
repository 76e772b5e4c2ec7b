"""Steady rotation of a body about an axis, in the rotating frame.

The body does not touch the axis, or is clamped to it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Plane = Literal["axial", "chord", "flap"]


@dataclass(frozen=True)
class Rotation:
    """A steady rotation of a body.

    Displacements, velocities, stresses and gaps are counted from the steady state in the rotating frame. A body's plane
    says in which direction it moves: ``axial`` along the radius, ``chord`` across the radius in the plane of rotation,
    ``flap`` along the axis.
    """

    rate: float  # rad/s
    axis_at: float = 0.0  # m, place of the axis in the body's own x; of a mass, minus its distance from the axis
    plane: Plane = "axial"

    @property
    def squared(self) -> float:
        """Rate squared [1/s2]."""
        return self.rate**2

    @property
    def softening(self) -> float:
        """Centrifugal force per mass and displacement along the motion [1/s2].

        It is the rate squared, and 0 for a motion along the axis.
        """
        return 0.0 if self.plane == "flap" else self.squared
