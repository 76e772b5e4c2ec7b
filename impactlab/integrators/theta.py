"""The step of the theta method, which its schemes share.

It keeps displacements and velocities only, so a step of any length may follow: only the matrix is factorised again. In
free motion the energy changes in a step by -(theta - 1/2) ([v] M [v] + [u] K [u]) - dt v_theta C v_theta, where [x] is
the step's change of x, and a force gives F times the displacement of its face, less (theta - 1/2) of the same kind.
"""

from __future__ import annotations

import numpy as np

from impactlab.integrators.banded_steps import LOAD, LOADED, measure, theta_free, theta_retime
from impactlab.integrators.base import Step
from impactlab.integrators.flat_matrices import packed, trimmed_of
from impactlab.models.base import Operators


def theta_step(system: Operators, dt: float, theta: float) -> Step:
    """Return the step with this theta."""
    bands = max(map(len, trimmed_of(system)))
    room = np.zeros((bands + 2) * system.load.size)  # factors, and the gain in velocity
    parameters = packed(system, dt, (theta,), room)
    theta_retime(parameters, dt)
    return Step(
        free=theta_free,
        measure=measure,
        parameters=parameters,
        load=slice(LOADED, LOAD + system.load.size),
        state=np.concatenate((system.displacement, system.velocity)),
        retime=theta_retime,
    )
