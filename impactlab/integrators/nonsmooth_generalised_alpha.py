"""The nonsmooth generalised-alpha method: impulses of contact stay out of the accelerations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.integrators.alpha import alpha_step, force_gain, start_gain
from impactlab.integrators.base import AbstractIntegrator, Step
from impactlab.integrators.generalised_alpha import weights
from impactlab.models.base import Operators
from impactlab.types import option


@final
@dataclass(frozen=True)
class NonsmoothGeneralisedAlpha(AbstractIntegrator):
    """Generalised-alpha for the smooth motion; impulses of contacts include the velocity jumps of impacts.

    An impulse L of a step adds M^-1 L to the velocities and dt/2 M^-1 L to the displacements at its end; the forces of
    the equation of motion there see both, the filter of accelerations does not.

    References
    ----------
    ChenAcaryVirlezBruels2013; BruelsAcaryCardona2014.
    """

    citations = ("ChenAcaryVirlezBruels2013", "BruelsAcaryCardona2014", "ChungHulbert1993")
    examples = ({}, {"rho_inf": 0.3}, {"rho_inf": 1.0})
    order = 2
    jump_in_force = True

    rho_inf: float = option(
        0.8, at_least=0.0, at_most=1.0, description="amplitude of the highest modes after a step: 1 all, 0 nothing"
    )

    @property
    def gains_energy(self) -> float:
        # Of impulses and projections in damped bodies, measured; forces have a bound of their own (`alpha`).
        return 0.0 if self.rho_inf == 1.0 else 0.03

    @property
    def force_gain(self) -> float:
        return force_gain(*weights(self.rho_inf)[0])

    @property
    def start_gain(self) -> float:
        return start_gain(*weights(self.rho_inf)[0])

    def step(self, system: Operators, dt: float) -> Step:
        return alpha_step(system, dt, *weights(self.rho_inf))
