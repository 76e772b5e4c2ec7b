"""Bathe's composite method."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.integrators.banded_steps import bathe_free, measure
from impactlab.integrators.base import AbstractIntegrator, Stepper
from impactlab.integrators.packing import factors, packed
from impactlab.models.base import Operators
from impactlab.numerics.banded import multiply, solve
from impactlab.types import Array, Level, option


@final
@dataclass(frozen=True)
class Bathe(AbstractIntegrator):
    """Bathe's composite method: the trapezoidal rule over a part of the step, then the three-point backward formula.

    It damps what the step cannot resolve and hardly anything else. For these linear bodies it needs displacements and
    velocities only. The contact force is a load constant over the whole step, and gives its exact impulse F dt.

    References
    ----------
    BatheBaig2005 (first part 1/2); Bathe2007; the default part 2 - sqrt 2 gives both parts one matrix.
    """

    citations = ("BatheBaig2005", "Bathe2007")
    examples = ({}, {"first_part": 0.5})
    serves = frozenset(Level)
    order = 2
    hard_constraint_gains = True
    gains_energy = 0.0

    first_part: float = option(
        2.0 - math.sqrt(2.0), above=0.0, below=1.0, description="share of the step under the trapezoidal rule"
    )

    def limit(self, system: Operators) -> float:
        return math.inf

    def prepare(self, system: Operators, ports: Array, dt: float) -> Stepper:
        part = self.first_part
        body = packed(system, dt, (part,), (0.0, 0.0, 0.0, 0.0))
        mass, damping, stiffness = body.mass, body.damping, body.stiffness
        half, lag = 0.5 * part * dt, (1.0 - part) / (2.0 - part) * dt
        carry = (1.0 - part) ** 2 / (part * (2.0 - part))
        matrices = [mass + weight * damping + weight**2 * stiffness for weight in (half, lag)]
        n_dof = system.load.size

        def linear_step(u: Array, v: Array, push: Array) -> Array:
            """Return the end of a step under a constant load."""
            swing = solve(matrices[0], push - multiply(damping, v) - multiply(stiffness, u + half * v))
            swung, moved = 2.0 * half * swing, 2.0 * half * (v + half * swing)
            v_next = v + (1.0 + carry) * swung
            u_next = u + (1.0 + carry) * moved + lag * v_next
            swing = solve(matrices[1], push - multiply(damping, v_next) - multiply(stiffness, u_next))
            return np.concatenate((u_next + lag**2 * swing, v_next + lag * swing))

        none = np.zeros(n_dof)
        jump = np.array([solve(mass, row) for row in ports]).reshape(len(ports), n_dof)
        size = (len(ports), 2 * n_dof)
        return Stepper(
            free=bathe_free,
            measure=measure,
            parameters=np.concatenate(
                (body.header, *body.arrays, *factors(matrices[0]), *factors(matrices[1]), np.zeros(2 * n_dof))
            ),
            state=np.concatenate((system.displacement, system.velocity)),
            force_response=np.array([linear_step(none, none, row) for row in ports]).reshape(size),
            impulse_response=np.array([linear_step(none, row, none) for row in jump]).reshape(size),
            projection_response=np.hstack((jump, np.zeros_like(jump))),
            jump=jump,
            face_rows=ports,
        )
