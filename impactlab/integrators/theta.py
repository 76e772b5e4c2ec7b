"""The stepper of the theta method, which its schemes share.

It keeps displacements and velocities only, so a step of any length may follow: only the matrix is factorised again. In
free motion the energy changes in a step by -(theta - 1/2) ([v] M [v] + [u] K [u]) - dt v_theta C v_theta, where [x] is
the step's change of x, and a force gives F times the displacement of its face, less (theta - 1/2) of the same kind.
"""

from __future__ import annotations

import numpy as np

from impactlab.integrators.banded_steps import measure, theta_free, theta_retime
from impactlab.integrators.base import Stepper
from impactlab.integrators.packing import packed
from impactlab.models.base import Operators
from impactlab.numerics.banded import multiply, solve
from impactlab.types import Array


def prepare_theta(
    system: Operators, ports: Array, dt: float, theta: float, any_dt: bool = True, projects_first: bool = False
) -> Stepper:
    """Return the stepper with this theta; with ``projects_first`` a projection moves what the step begins from.

    Then u_new = u + p + dt v_theta, M (v_new - v) = dt (load - K (u + u_new)/2) - C (u_new - u) for theta = 1/2: the
    displacement p = M^-1 row does not count as one at the start of the step. Dampers feel it: they lose
    [u] C [u]/dt, and nothing is left over that could be a gain, as p C v_theta would be.
    """
    body = packed(system, dt, (theta,), (0.0, 0.0, 0.0, 0.0))
    n_dof, width = system.load.size, body.width
    parameters = np.concatenate((body.header, *body.arrays, np.zeros((width + 2) * n_dof)))
    jump = np.array([solve(body.mass, row) for row in ports]).reshape(len(ports), n_dof)
    force_response, impulse_response = np.zeros((2, len(ports), 2 * n_dof))
    theta_retime(parameters, dt, jump.ravel(), force_response.ravel(), impulse_response.ravel())
    projection_response = np.hstack((jump, np.zeros_like(jump)))
    if projects_first:
        matrix = body.mass + theta * dt * body.damping + (theta * dt) ** 2 * body.stiffness
        for port in range(len(ports)):
            swung = solve(matrix, -multiply(body.damping + theta * dt * body.stiffness, jump[port]))
            projection_response[port] = np.concatenate((jump[port] + theta * dt * swung, swung))
    return Stepper(
        free=theta_free,
        measure=measure,
        parameters=parameters,
        state=np.concatenate((system.displacement, system.velocity)),
        force_response=force_response,
        impulse_response=impulse_response,
        projection_response=projection_response,
        jump=jump,
        face_rows=ports,
        retime=theta_retime if any_dt else None,
    )
