"""The generalised-alpha method, with the contact force in its accelerations."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from impactlab.integrators.alpha import alpha_step
from impactlab.integrators.base import AbstractIntegrator, Step
from impactlab.models.base import Operators
from impactlab.types import option


@final
@dataclass(frozen=True)
class GeneralisedAlpha(AbstractIntegrator):
    """Generalised-alpha method with a chosen damping at high frequencies.

    It filters the contact force as well. (1 - am) a_new + am a = (1 - af) w_new + af w with M w = load + contact - C v
    - K u at the same instant. The force of a step acts at its end, as engineers' codes have it: its impulse reaches the
    velocities over this and later steps, and the part still to come counts to the body's momentum. A contact spring
    needs a step that resolves it with the lighter face on it; a hard constraint on positions makes the scheme
    oscillate.

    References
    ----------
    ChungHulbert1993; ArnoldBruels2007 (the form with two accelerations).
    """

    citations = ("ChungHulbert1993", "ArnoldBruels2007")
    examples = ({}, {"rho_inf": 0.5}, {"rho_inf": 1.0})
    order = 2
    load_point = 1.0
    momentum_point = 1.5  # it includes impulses still to come: half a step's (`alpha`, all weights)
    # No bound is known: the filter keeps parts of a force that has ended. With springs up to EA/h 0.42 was measured
    # (docs/bounds.md); with stiffer faces or hard contact many times the initial energy (docs/matrix.md).
    gains_energy = math.inf

    rho_inf: float = option(
        0.8, at_least=0.0, at_most=1.0, description="amplitude of the highest modes after a step: 1 all, 0 nothing"
    )

    def step(self, system: Operators, dt: float) -> Step:
        return alpha_step(system, dt, *weights(self.rho_inf), in_accelerations=True)


def weights(rho: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return (af, am) and (beta, gamma) of a spectral radius: ChungHulbert1993, Eqs. 17, 20, 25."""
    af, am = rho / (rho + 1.0), (2.0 * rho - 1.0) / (rho + 1.0)
    return (af, am), (0.25 * (1.0 + af - am) ** 2, 0.5 + af - am)
