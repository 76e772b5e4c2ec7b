"""The explicit scheme of Chung and Lee, which damps frequencies that a mesh cannot resolve."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.errors import PairingError
from impactlab.integrators import AbstractIntegrator, Operators, Step, in_springs, pull, springs_of
from impactlab.types import Array, option

MOST_BETA = 28.0 / 27.0


N, BANDWIDTH, DT, BETA, LOAD = range(5)  # places in the parameters; then mass, springs and room for two vectors


def derive(parameters: Array, state: Array) -> None:
    """Rewrite the last acceleration, M a = load - K u, and its displacements."""
    n, bandwidth = int(parameters[N]), int(parameters[BANDWIDTH])
    load, mass, springs = parameters[LOAD : LOAD + n], parameters[LOAD + n : LOAD + 2 * n], parameters[LOAD + 2 * n :]
    u, a, before = state[:n], state[2 * n : 3 * n], state[3 * n : 4 * n]
    for i in range(n):
        a[i], before[i] = load[i], u[i]
    pull(n, bandwidth, springs, u, a)
    for i in range(n):
        a[i] /= mass[i]


def free(parameters: Array, state: Array) -> None:
    """Step without contact: a_new = M^-1 (load - K u), then u and v.

    Displacements and velocities follow from a_new and the last a. The state holds u, v, the last a and the u that it
    belongs to.
    """
    n, bandwidth, dt, beta = int(parameters[N]), int(parameters[BANDWIDTH]), parameters[DT], parameters[BETA]
    load, mass, springs = parameters[LOAD : LOAD + n], parameters[LOAD + n : LOAD + 2 * n], parameters[LOAD + 2 * n :]
    u, v, a, before = state[:n], state[n : 2 * n], state[2 * n : 3 * n], state[3 * n : 4 * n]
    for i in range(n):
        before[i] = load[i]  # room for the force, then for the displacement
    pull(n, bandwidth, springs, u, before)
    for i in range(n):
        acceleration = before[i] / mass[i]
        before[i] = u[i]
        u[i] += dt * v[i] + dt * dt * ((0.5 - beta) * a[i] + beta * acceleration)
        v[i] += dt * (1.5 * acceleration - 0.5 * a[i])
        a[i] = acceleration


def measure(parameters: Array, state: Array, out: Array) -> None:
    """Write the energy that the scheme never raises and the load's work [J].

    The work is that so far. With D the next step's displacement and P the last one's it is D M D/(2 dt^2) + (u + D) K
    u/2, the energy that leapfrog conserves, plus (beta - 1)/2 (D K P - D K D/2 + P K P/2). From step to step it falls
    by (beta - 1)/4 (D - D'') K (D - D''), D'' the displacement two steps before D, as the difference of two such
    energies shows when the scheme is put into it (our derivation; a test checks it step by step).
    """
    n, bandwidth, dt, beta = int(parameters[N]), int(parameters[BANDWIDTH]), parameters[DT], parameters[BETA]
    load, mass, springs = parameters[LOAD : LOAD + n], parameters[LOAD + n : LOAD + 2 * n], parameters[LOAD + 2 * n :]
    d, p = parameters[-2 * n : -n], parameters[-n:]
    u, v, a, before = state[:n], state[n : 2 * n], state[2 * n : 3 * n], state[3 * n : 4 * n]
    for i in range(n):
        d[i] = load[i]
    pull(n, bandwidth, springs, u, d)
    energy, work = 0.0, 0.0
    for i in range(n):
        d[i], p[i] = dt * v[i] + dt * dt * ((0.5 - beta) * a[i] + beta * d[i] / mass[i]), u[i] - before[i]
        energy += 0.5 * mass[i] * (d[i] / dt) * (d[i] / dt)
        work += load[i] * (u[i] + 0.5 * d[i])
    energy += in_springs(n, bandwidth, springs, u, u) + in_springs(n, bandwidth, springs, d, u)
    for weight, x, y in ((1.0, d, p), (-0.5, d, d), (0.5, p, p)):
        energy += (beta - 1.0) * weight * in_springs(n, bandwidth, springs, x, y)
    out[0], out[1] = energy, work


@final
@dataclass(frozen=True)
class ChungLee(AbstractIntegrator):
    """Explicit scheme of Chung and Lee: diagonal mass, damping of high frequencies.

    beta = 1 is central difference. M a_new + K u = load, u_new = u + dt v + dt^2 ((1/2 - beta) a + beta a_new), v_new =
    v + dt (3 a_new - a)/2: the accelerations lag by a step, so velocities and displacements belong to the same instant
    and nothing is solved for. Stable up to w dt = 2/sqrt(4 beta - 3), which is 2 for beta = 1 and 1.866 for 28/27;
    there a mode of w dt = 1.837 loses half of itself in each step.

    Deviations from the source: the contact force is no part of the accelerations carried; constant over its step, it
    adds its exact impulse F dt and its displacement F dt^2/2. Damping is refused.

    References
    ----------
    ChungLee1994.
    """

    citations = ("ChungLee1994",)
    examples = ({}, {"beta": 1.0}, {"beta": 1.02})
    order = 2
    needs_diagonal_mass = True
    gains_energy = 0.02  # none seen in 150 impacts on rods at rest, at 3.5 to 10 points per period; not proven

    beta: float = option(
        MOST_BETA, at_least=1.0, at_most=MOST_BETA, description="weight of the new acceleration; 28/27 damps most"
    )

    def limit(self, system: Operators) -> float:
        if system.highest_frequency == 0.0:
            return math.inf
        return 2.0 / (system.highest_frequency * math.sqrt(4.0 * self.beta - 3.0))

    def step(self, system: Operators, dt: float) -> Step:
        if np.any(system.damping):
            raise PairingError(
                "integrator 'chung_lee' supports bodies without dampers only",
                remedy="Use central_difference or newmark.",
                path="solve.integrator",
            )
        n, room = system.load.size, np.zeros(2 * system.load.size)
        header = [n, springs_of(system).size // n - 1, dt, self.beta]
        return Step(
            free=free,
            measure=measure,
            parameters=np.concatenate((header, system.load, system.mass[0], springs_of(system), room)),
            load=slice(LOAD, LOAD + n),
            state=np.concatenate((system.displacement, system.velocity, np.zeros(2 * n))),
            derive=derive,
            force=lambda jump: np.hstack((0.5 * dt**2 * jump, dt * jump, 0.0 * jump, 0.0 * jump)),
        )
