"""The energy-momentum midpoint rule."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.integrators.base import AbstractIntegrator, Step
from impactlab.integrators.theta import theta_step
from impactlab.models.base import Operators


@final
@dataclass(frozen=True)
class Midpoint(AbstractIntegrator):
    """Energy-momentum midpoint rule: forces at mid-step; conserves energy; any step length.

    For these linear bodies the scheme of the source is the midpoint rule. It keeps displacements and velocities only:
    the same motion as Newmark's average acceleration, but a step may be cut at an event.

    References
    ----------
    SimoTarnow1992.
    """

    citations = ("SimoTarnow1992",)
    order = 2
    any_dt = True
    gains_energy = 0.0

    def step(self, system: Operators, dt: float) -> Step:
        return theta_step(system, dt, 0.5)
