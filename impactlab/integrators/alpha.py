"""The stepper of the generalised-alpha family, which its schemes share.

With am, af, gamma = 1/2 + af - am, beta = (1 + af - am)^2/4 the scheme never gains energy in free undamped motion: with
b = (af - am)^2/4, f = 1/2 - af, m = 1/2 - am, and y from (1 - am) y_new + am y = u_new - u, y = 0 at first, the energy

    v M v/2 + u K u/2 + b dt^2 a M a/2 + f (m - f) y K y/2

changes in a step by -(m - f) (b dt^2 [a] M [a] + f m [y] K [y]), where [x] is the step's change of x. (Multiply the
changes of v and u by their means; M (a - w) = -(m - f) K y turns what is left into differences.) With the contact in
the accelerations the momentum that a force has still to give is M (dt (1 - am - gamma) a + dt af w): together with M v
it changes in a step by dt M w, for a w that holds the force.
"""

from __future__ import annotations

import numpy as np

from impactlab.integrators.banded_steps import alpha_free, measure
from impactlab.integrators.base import Stepper
from impactlab.integrators.packing import factors, packed
from impactlab.models.base import Operators
from impactlab.numerics.banded import multiply, solve
from impactlab.types import Array


def prepare_alpha(
    system: Operators,
    ports: Array,
    dt: float,
    filters: tuple[float, float],
    newmark: tuple[float, float],
    in_accelerations: bool = False,
) -> Stepper:
    """Return the stepper of a scheme with weights (af, am) and (beta, gamma).

    Without ``in_accelerations`` the force of a step acts beside the accelerations, constant over the step: it adds its
    exact impulse and the displacement F dt^2/2. With it, the force is that of the equation of motion at the step's end.
    An impulse or a projection shifts a and w by what it changes in the equation of motion at once.
    """
    (af, am), (beta, gamma) = filters, newmark
    filtered = af != 0.0 or am != 0.0
    of_y = (0.5 - af) * (af - am) if filtered else 0.0
    still_to_come = (dt * (1.0 - am - gamma), dt * af) if in_accelerations else (0.0, 0.0)
    weights = ((beta - 0.5 * gamma) * dt**2, of_y, *still_to_come)
    body = packed(system, dt, (af, am, beta, gamma), weights)
    mass, damping, stiffness = body.mass, body.damping, body.stiffness
    share, n_dof = (1.0 - af) / (1.0 - am), system.load.size
    matrix = mass + gamma * share * dt * damping + beta * share * dt**2 * stiffness

    def kept(u: Array, v: Array, a: Array, w: Array, y: Array) -> Array:
        return np.concatenate((u, v, a, w, y) if filtered else (u, v, a))

    def finished(u: Array, v: Array, push: Array, a: Array) -> Array:
        """Return the end of a step from what it predicts, and from the part of a that is known."""
        w = solve(matrix, push - multiply(damping, v) - multiply(stiffness, u))
        u, v = u + beta * share * dt**2 * w, v + gamma * share * dt * w
        return kept(u, v, a + share * w, w, u / (1.0 - am))

    none = np.zeros(n_dof)
    size = (5 if filtered else 3) * n_dof
    force_response, impulse_response, projection_response = np.zeros((3, len(ports), size))
    jump = np.zeros((len(ports), n_dof))
    for port, row in enumerate(ports):
        jump[port] = solve(mass, row)
        if in_accelerations:
            force_response[port] = finished(none, none, row, none)
        else:
            force_response[port] = finished(0.5 * dt**2 * jump[port], dt * jump[port], none, none)
        change = solve(mass, -multiply(damping, jump[port]))
        held = (af - am) / (1.0 - am) * change
        u = dt * jump[port] + dt**2 * ((0.5 - beta) * change + beta * held)
        impulse_response[port] = finished(u, jump[port] + dt * ((1.0 - gamma) * change + gamma * held), none, held)
        change = solve(mass, -multiply(stiffness, jump[port]))
        projection_response[port] = kept(jump[port], none, change, change, none)
    internal = system.load - multiply(damping, system.velocity) - multiply(stiffness, system.displacement)
    acceleration = solve(mass, internal)
    return Stepper(
        free=alpha_free,
        measure=measure,
        parameters=np.concatenate((body.header, *body.arrays, *factors(matrix))),
        state=kept(system.displacement, system.velocity, acceleration, acceleration, none),
        force_response=force_response,
        impulse_response=impulse_response,
        projection_response=projection_response,
        jump=jump,
        face_rows=ports,
    )
