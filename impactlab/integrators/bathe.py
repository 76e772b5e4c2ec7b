"""Bathe's composite method."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.integrators.banded_steps import LOAD, LOADED, bathe_free, measure
from impactlab.integrators.base import AbstractIntegrator, Step
from impactlab.integrators.flat_matrices import chain_springs, combined, factors, packed
from impactlab.models.base import Operators
from impactlab.types import option


@final
@dataclass(frozen=True)
class Bathe(AbstractIntegrator):
    """Bathe's composite method: trapezoidal rule, then the three-point backward formula.

    The first covers a part of the step. It damps motion that the step cannot resolve and hardly any other. For these
    linear bodies it needs displacements and velocities only. The contact force is a load constant over the step, and
    gives its exact impulse F dt.

    References
    ----------
    BatheBaig2005 (first part 1/2); Bathe2007; the default part 2 - sqrt 2 gives both parts one matrix.
    """

    citations = ("BatheBaig2005", "Bathe2007")
    examples = ({}, {"first_part": 0.5})
    order = 2
    gains_energy = 0.0

    first_part: float = option(
        2.0 - math.sqrt(2.0), above=0.0, below=1.0, description="share of the step under the trapezoidal rule"
    )

    def step(self, system: Operators, dt: float) -> Step:
        part, n_dof = self.first_part, system.load.size
        half, lag = 0.5 * part * dt, (1.0 - part) / (2.0 - part) * dt
        matrices = [factors(combined(system, weight, weight**2), chain_springs(system)) for weight in (half, lag)]
        return Step(
            free=bathe_free,
            measure=measure,
            parameters=packed(system, dt, (part,), *matrices, np.zeros(2 * n_dof)),
            load=slice(LOADED, LOAD + system.load.size),
            state=np.concatenate((system.displacement, system.velocity)),
        )
