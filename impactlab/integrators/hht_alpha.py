"""The alpha method of Hilber, Hughes and Taylor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.integrators.alpha import alpha_step, force_gain, start_gain
from impactlab.integrators.base import AbstractIntegrator, Step
from impactlab.models.base import Operators
from impactlab.types import option


@final
@dataclass(frozen=True)
class HhtAlpha(AbstractIntegrator):
    """HHT alpha method: Newmark's scheme with damping of the highest modes.

    beta = (1 - alpha)^2/4, gamma = 1/2 - alpha. M a_new + (1 + alpha) (C v + K u)_new - alpha (C v + K u) = load. The
    contact force is no part of the accelerations (deviation from the source): constant over its step, it gives its
    exact impulse F dt and displacement F dt^2/2.

    References
    ----------
    HilberHughesTaylor1977; ArnoldBruels2007 (the form with two accelerations).
    """

    citations = ("HilberHughesTaylor1977", "ArnoldBruels2007")
    examples = ({}, {"alpha": -1.0 / 3.0}, {"alpha": 0.0})
    order = 2

    alpha: float = option(-0.1, at_least=-1.0 / 3.0, at_most=0.0, description="0 damps nothing, -1/3 most")

    @property
    def gains_energy(self) -> float:
        # Measured at -1/3: 0.003 (docs/bounds.md); at -0.1 with modes that damping stops within a step 0.02, in the two
        # steps after a touch (`alpha`), with errors of positions up to 1.5 times those of Newmark.
        return 0.0 if self.alpha == 0.0 else 0.03

    @property
    def force_gain(self) -> float:
        return force_gain(-self.alpha, 0.0)

    @property
    def start_gain(self) -> float:
        return start_gain(-self.alpha, 0.0)

    def step(self, system: Operators, dt: float) -> Step:
        newmark = 0.25 * (1.0 - self.alpha) ** 2, 0.5 - self.alpha
        return alpha_step(system, dt, (-self.alpha, 0.0), newmark)
