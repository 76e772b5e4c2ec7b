"""The time stepping of Moreau and Jean."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.integrators.base import AbstractIntegrator, Step
from impactlab.integrators.theta import theta_step
from impactlab.models.base import Operators
from impactlab.types import option


@final
@dataclass(frozen=True)
class MoreauJean(AbstractIntegrator):
    """Moreau-Jean time stepping: a theta method whose impulses include the velocity jumps of impacts.

    M (v_new - v) = dt (load - C v_theta - K u_theta) + F dt, u_new = u + dt (theta v_new + (1 - theta) v): an impulse
    moves its face within the step by theta dt times its velocity jump. The order is 2 with theta = 1/2, else 1. The
    impulse is given by the law of the case, of velocities or positions. Events are captured within a step and not
    located.

    References
    ----------
    Moreau1988; Jean1999; AcaryBrogliato2008, section 10.1.
    """

    citations = ("Moreau1988", "Jean1999", "AcaryBrogliato2008")
    order = 2
    jump_in_force = True
    gains_energy = 0.0

    theta: float = option(
        0.5, at_least=0.5, at_most=1.0, description="weight of the end of the step; 1/2 damps nothing"
    )

    def step(self, system: Operators, dt: float) -> Step:
        return theta_step(system, dt, self.theta)
