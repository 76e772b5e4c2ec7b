"""The explicit scheme of Chung and Lee, which damps what a mesh cannot resolve."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.errors import PairingError
from impactlab.integrators.base import AbstractIntegrator, Stepper
from impactlab.models.base import Operators
from impactlab.numerics.banded import grounded, multiply
from impactlab.types import Array, Level, option

MOST_BETA = 28.0 / 27.0


def free(parameters: Array, state: Array) -> None:
    """Step without contact: a_new = M^-1 (load - K u), then displacements and velocities from a_new and the last a.

    The state holds u, v, the last a and the u that it belongs to. Springs act on differences of displacements, so that
    a rod far from where it began feels no rounding of its travel.
    """
    n, bandwidth, dt, beta = int(parameters[0]), int(parameters[1]), parameters[2], parameters[3]
    arrays = parameters[4:]
    mass, load, ground = arrays[:n], arrays[n : 2 * n], arrays[2 * n : 3 * n]
    u, v, a, before = state[:n], state[n : 2 * n], state[2 * n : 3 * n], state[3 * n : 4 * n]
    for i in range(n):
        before[i] = load[i] - ground[i] * u[i]  # room for the force, then for the displacement
    for offset in range(1, bandwidth + 1):
        coupling = arrays[(2 + offset) * n : (3 + offset) * n]
        for i in range(n - offset):
            pull = coupling[i] * (u[i + offset] - u[i])
            before[i] -= pull
            before[i + offset] += pull
    last, new = dt * dt * (0.5 - beta), dt * dt * beta
    for i in range(n):
        acceleration = before[i] / mass[i]
        before[i] = u[i]
        u[i] += dt * v[i] + last * a[i] + new * acceleration
        v[i] += dt * (1.5 * acceleration - 0.5 * a[i])
        a[i] = acceleration


def measure(parameters: Array, state: Array, out: Array) -> None:
    """Write the energy [J] that the scheme damps and never raises, and the work of the load so far [J].

    With D the next step's displacement and P the last one's it is D M D/(2 dt^2) + (u + D) K u/2, the energy that
    leapfrog conserves, plus (beta - 1)/2 (D K P - D K D/2 + P K P/2). From step to step it falls by
    (beta - 1)/4 (D - D'') K (D - D''), D'' the displacement two steps before D, as the difference of two such energies
    shows when the scheme is put into it (our derivation; a test checks it step by step).
    """
    n, bandwidth, dt, beta = int(parameters[0]), int(parameters[1]), parameters[2], parameters[3]
    arrays = parameters[4:]
    mass, load, ground = arrays[:n], arrays[n : 2 * n], arrays[2 * n : 3 * n]
    ahead = arrays[(3 + bandwidth) * n : (4 + bandwidth) * n]  # room for D
    u, v, a, before = state[:n], state[n : 2 * n], state[2 * n : 3 * n], state[3 * n : 4 * n]
    for i in range(n):
        ahead[i] = load[i] - ground[i] * u[i]
    for offset in range(1, bandwidth + 1):
        coupling = arrays[(2 + offset) * n : (3 + offset) * n]
        for i in range(n - offset):
            pull = coupling[i] * (u[i + offset] - u[i])
            ahead[i] -= pull
            ahead[i + offset] += pull
    last, new, share = dt * dt * (0.5 - beta), dt * dt * beta, beta - 1.0
    energy, work = 0.0, 0.0
    for i in range(n):
        ahead[i] = dt * v[i] + last * a[i] + new * ahead[i] / mass[i]
        d, p = ahead[i], u[i] - before[i]
        energy += 0.5 * mass[i] * (d / dt) * (d / dt)
        energy += 0.5 * ground[i] * ((u[i] + d) * u[i] + share * (d * p - 0.5 * d * d + 0.5 * p * p))
        work += load[i] * (u[i] + 0.5 * d)
    for offset in range(1, bandwidth + 1):
        coupling = arrays[(2 + offset) * n : (3 + offset) * n]
        for i in range(n - offset):
            j = i + offset
            stretch, d = u[j] - u[i], ahead[j] - ahead[i]
            p = stretch - (before[j] - before[i])
            energy -= 0.5 * coupling[i] * ((stretch + d) * stretch + share * (d * p - 0.5 * d * d + 0.5 * p * p))
    out[0], out[1] = energy, work


@final
@dataclass(frozen=True)
class ChungLee(AbstractIntegrator):
    """The explicit scheme of Chung and Lee: diagonal mass, damps high frequencies, beta = 1 is central difference.

    M a_new + K u = load, u_new = u + dt v + dt^2 ((1/2 - beta) a + beta a_new), v_new = v + dt (3 a_new - a)/2: the
    accelerations lag by a step, so velocities and displacements belong to the same instant and nothing is solved for.
    Stable up to w dt = 2/sqrt(4 beta - 3), which is 2 for beta = 1 and 1.866 for 28/27; there a mode of w dt = 1.837
    loses half of itself in each step.

    Deviations from the source: the contact force is no part of the accelerations carried; constant over its step, it
    adds its exact impulse F dt and its displacement F dt^2/2. Damping is refused.

    References
    ----------
    ChungLee1994.
    """

    citations = ("ChungLee1994",)
    examples = ({}, {"beta": 1.0}, {"beta": 1.02})
    serves = frozenset(Level)
    order = 2
    needs_diagonal_mass = True
    hard_constraint_gains = True
    gains_energy = 0.02  # none seen in 150 impacts on rods at rest, at 3.5 to 10 points per period; not proven

    beta: float = option(
        MOST_BETA, at_least=1.0, at_most=MOST_BETA, description="weight of the new acceleration; 28/27 damps most"
    )

    def limit(self, system: Operators) -> float:
        if system.highest_frequency == 0.0:
            return math.inf
        return 2.0 / (system.highest_frequency * math.sqrt(4.0 * self.beta - 3.0))

    def prepare(self, system: Operators, ports: Array, dt: float) -> Stepper:
        if np.any(system.damping):
            raise PairingError(
                "integrator 'chung_lee' serves bodies without dampers only",
                remedy="Use central_difference or newmark.",
                path="solve.integrator",
            )
        n_dof, bandwidth = system.load.size, system.stiffness.shape[0] - 1
        mass = system.mass[0]
        header = np.array([n_dof, bandwidth, dt, self.beta], float)
        arrays = (mass, system.load, grounded(system.stiffness), *system.stiffness[1:], np.zeros(n_dof))
        acceleration = (system.load - multiply(system.stiffness, system.displacement)) / mass
        jump = np.ascontiguousarray(ports / mass)
        none = np.zeros_like(jump)
        moved = np.array([-multiply(system.stiffness, row) / mass for row in jump]).reshape(jump.shape)
        return Stepper(
            free=free,
            measure=measure,
            parameters=np.concatenate((header, *arrays)),
            state=np.concatenate((system.displacement, system.velocity, acceleration, system.displacement)),
            force_response=np.hstack((0.5 * dt**2 * jump, dt * jump, none, none)),
            impulse_response=np.hstack((dt * jump, jump, none, none)),
            projection_response=np.hstack((jump, none, moved, jump)),
            jump=jump,
            face_rows=ports,
        )
