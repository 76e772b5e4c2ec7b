"""The energy-momentum midpoint rule."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from impactlab.integrators.base import AbstractIntegrator, Stepper
from impactlab.integrators.theta import prepare_theta
from impactlab.models.base import Operators
from impactlab.types import Array, Level


@final
@dataclass(frozen=True)
class Midpoint(AbstractIntegrator):
    """The energy-momentum midpoint rule: forces at the middle of the step; conserves energy; a step of any length.

    For these linear bodies the scheme of the source is the midpoint rule. It keeps displacements and velocities only:
    the same motion as Newmark's average acceleration, but a step may be cut at an event.

    References
    ----------
    SimoTarnow1992.
    """

    citations = ("SimoTarnow1992",)
    serves = frozenset(Level)
    order = 2
    any_dt = True
    hard_constraint_gains = True
    gains_energy = 0.0

    def limit(self, system: Operators) -> float:
        return math.inf

    def prepare(self, system: Operators, ports: Array, dt: float) -> Stepper:
        return prepare_theta(system, ports, dt, 0.5)
