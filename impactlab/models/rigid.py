"""Rigid bodies: masses with one coordinate, walls with none."""

from __future__ import annotations

from typing import final

import numpy as np

from impactlab.models.base import AbstractDiscreteModel, Operators
from impactlab.types import Array, Quantity


@final
class RigidBody(AbstractDiscreteModel):
    """A mass (one coordinate: its displacement) or, with ``mass`` None, a wall (no coordinate).

    A mass that turns is pulled outwards by m Omega^2 times its distance from the axis: a constant force where it
    stands, and a stiffness -m Omega^2.
    """

    def __init__(
        self, mass: float | None, velocity: float, gravity: float, softening: float = 0.0, distance: float = 0.0
    ) -> None:
        self._mass = np.zeros((1, 0)) if mass is None else np.array([[mass]])
        self._velocity = velocity
        self._gravity = gravity
        self._softening, self._distance = softening, distance  # 1/s2 along the motion, m from the axis at u = 0

    def operators(self) -> Operators:
        n_dof, turns = self._mass.shape[1], self._softening != 0.0
        pull = self._gravity + self._softening * self._distance  # m/s2
        return Operators(
            mass=self._mass,
            damping=np.zeros((1, n_dof)),
            stiffness=-self._softening * self._mass if turns else np.zeros((1, n_dof)),
            load=self._mass[0] * pull if pull else np.zeros(n_dof),
            displacement=np.zeros(n_dof),
            velocity=np.array([self._velocity] * n_dof, float),
            highest_frequency=0.0,
            rule_frequency=0.0,
            diagonal_mass=True,
            modes=True,
            ground_springs=np.zeros(n_dof),
            softening=self._softening,
            momentum=self._mass[0],
        )

    def row(self, x: float, quantity: Quantity) -> Array:
        moves = quantity in ("displacement", "velocity")
        return np.array([1.0 if moves else 0.0] * self._mass.shape[1], float)

    def momentum_row(self) -> Array:
        return np.asarray(self._mass[0])

    def grid(self) -> Array:
        return np.zeros(1)
