"""The Newmark method, in midpoint-load form."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.banded import factorised, grounded, multiply, solve, widened
from impactlab.integrators.alpha import prepare_alpha
from impactlab.integrators.base import AbstractIntegrator, Stepper
from impactlab.integrators.packing import has_coupled_damping
from impactlab.models.base import Operators
from impactlab.types import Array, Level, option


def free(parameters: Array, state: Array) -> None:
    """Step without contact: predict, solve (M + gamma dt C + beta dt^2 K) a = load - C v - K u, correct.

    For diagonal or tridiagonal matrices with diagonal damping; the others go through `banded_steps`.
    """
    n, bandwidth, damped = int(parameters[0]), int(parameters[1]), parameters[2]
    dt, beta, gamma = parameters[3], parameters[4], parameters[5]
    arrays = parameters[6:]
    pivot, load, damping = arrays[:n], arrays[n : 2 * n], arrays[2 * n : 3 * n]
    ground = arrays[3 * n : 4 * n]
    u, v, a = state[:n], state[n : 2 * n], state[2 * n : 3 * n]
    old_u, old_v = dt * dt * (0.5 - beta), dt * (1.0 - gamma)
    new_u, new_v = beta * dt * dt, gamma * dt
    if bandwidth == 1:
        below, lower = arrays[4 * n : 5 * n], arrays[5 * n : 6 * n]
        for i in range(n):
            u[i] += dt * v[i] + old_u * a[i]
            v[i] += old_v * a[i]
        # The forward sweep is one chain; all that does not belong to the chain is done before it. Springs act on
        # differences of displacements, so that a rod far from where it began feels no rounding of its travel.
        if n > 1:
            a[0] = load[0] - ground[0] * u[0] - below[0] * (u[1] - u[0])
            for i in range(1, n - 1):
                a[i] = load[i] - ground[i] * u[i] - below[i] * (u[i + 1] - u[i]) - below[i - 1] * (u[i - 1] - u[i])
            a[n - 1] = load[n - 1] - ground[n - 1] * u[n - 1] - below[n - 2] * (u[n - 2] - u[n - 1])
        else:
            a[0] = load[0] - ground[0] * u[0]
        if damped != 0.0:
            for i in range(n):
                a[i] -= damping[i] * v[i]
        for i in range(1, n):
            a[i] -= lower[i - 1] * a[i - 1]
        for i in range(n):
            a[i] *= pivot[i]
        for i in range(n - 2, -1, -1):
            a[i] -= lower[i] * a[i + 1]
        for i in range(n):
            u[i] += new_u * a[i]
            v[i] += new_v * a[i]
        return
    for i in range(n):
        u[i] += dt * v[i] + old_u * a[i]
        v[i] += old_v * a[i]
        a[i] = pivot[i] * (load[i] - ground[i] * u[i] - damping[i] * v[i])
        u[i] += new_u * a[i]
        v[i] += new_v * a[i]


def measure(parameters: Array, state: Array, out: Array) -> None:
    """Write the energy [J] that Newmark conserves or damps, and the work of the load so far, up to a constant [J].

    The energy is v M v/2 + u K u/2 + (beta - gamma/2) dt^2 a M a/2; the last term is zero for average acceleration.
    """
    n, bandwidth = int(parameters[0]), int(parameters[1])
    dt, beta, gamma = parameters[3], parameters[4], parameters[5]
    share = (beta - 0.5 * gamma) * dt * dt
    arrays = parameters[6:]
    load, ground = arrays[n : 2 * n], arrays[3 * n : 4 * n]
    masses = arrays[(4 + 2 * bandwidth) * n :]
    u, v, a = state[:n], state[n : 2 * n], state[2 * n : 3 * n]
    energy, work = 0.0, 0.0
    for i in range(n):
        energy += 0.5 * (masses[i] * (v[i] * v[i] + share * a[i] * a[i]) + ground[i] * u[i] * u[i])
        work += load[i] * u[i]
    if bandwidth == 1:
        below, coupled = arrays[4 * n : 5 * n], masses[n : 2 * n]
        for i in range(n - 1):
            stretch = u[i + 1] - u[i]
            energy += coupled[i] * (v[i] * v[i + 1] + share * a[i] * a[i + 1]) - 0.5 * below[i] * stretch * stretch
    out[0], out[1] = energy, work


def derive(parameters: Array, state: Array) -> None:
    """Rewrite the accelerations of a diagonal system from displacements and velocities that were changed outside."""
    n, bandwidth = int(parameters[0]), int(parameters[1])
    arrays = parameters[6:]
    load, damping, ground = arrays[n : 2 * n], arrays[2 * n : 3 * n], arrays[3 * n : 4 * n]
    masses = arrays[(4 + 2 * bandwidth) * n :]
    for i in range(n):
        state[2 * n + i] = (load[i] - damping[i] * state[n + i] - ground[i] * state[i]) / masses[i]


@final
@dataclass(frozen=True)
class Newmark(AbstractIntegrator):
    """The Newmark method (average acceleration by default), its contact force acting as a midpoint load.

    The accelerations carried are those without contact force; the force of a step, constant over it, adds its exact
    impulse F dt and its displacement F dt^2/2 (deviation from the source: the contact force is no part of the
    accelerations, so that a force that jumps from step to step gives its whole impulse). With beta = 1/4, gamma = 1/2
    this is the midpoint rule.

    References
    ----------
    Newmark1959; EscalonaMayoDominguez1999, Section 5 (delta = 0.5, alpha = 0.25).
    """

    citations = ("Newmark1959",)
    serves = frozenset(Level)
    order = 2
    hard_constraint_gains = True
    examples = ({}, {"beta": 1.0 / 6.0})

    beta: float = option(
        0.25, at_least=0.0, at_most=1.0, description="weight of the new acceleration in the displacement"
    )
    gamma: float = option(0.5, at_least=0.5, at_most=1.0, description="weight of the new acceleration in the velocity")

    @property
    def gains_energy(self) -> float:
        # Measured for other weights: 0.12 (docs/bounds.md); the average acceleration gains nothing.
        return 0.0 if (self.beta, self.gamma) == (0.25, 0.5) else 0.2

    def limit(self, system: Operators) -> float:
        if 2.0 * self.beta >= self.gamma or system.highest_frequency == 0.0:
            return math.inf
        return 1.0 / (system.highest_frequency * math.sqrt(0.5 * self.gamma - self.beta))

    def prepare(self, system: Operators, ports: Array, dt: float) -> Stepper:
        if max(system.mass.shape[0], system.stiffness.shape[0]) > 2 or has_coupled_damping(system):
            return prepare_alpha(system, ports, dt, (0.0, 0.0), (self.beta, self.gamma))
        n_dof = system.load.size
        bandwidth = max(system.mass.shape[0], system.stiffness.shape[0]) - 1
        mass, stiffness = widened(system.mass, bandwidth), widened(system.stiffness, bandwidth)
        damping = widened(system.damping[:1], bandwidth)
        matrix = mass + self.gamma * dt * damping + self.beta * dt**2 * stiffness

        def linear_step(u: Array, v: Array, a: Array) -> Array:
            a_new = solve(matrix, -multiply(damping, v) - multiply(stiffness, u)) if n_dof else a
            return np.concatenate((u + self.beta * dt**2 * a_new, v + self.gamma * dt * a_new, a_new))

        force_response, impulse_response, projection_response = np.zeros((3, len(ports), 3 * n_dof))
        jump = np.zeros((len(ports), n_dof))
        for port, row in enumerate(ports):
            jump[port] = solve(mass, row)
            force_response[port] = linear_step(0.5 * dt**2 * jump[port], dt * jump[port], np.zeros(n_dof))
            a = solve(mass, -multiply(damping, jump[port]))
            predicted = dt * jump[port] + dt**2 * (0.5 - self.beta) * a, jump[port] + dt * (1.0 - self.gamma) * a
            impulse_response[port] = linear_step(*predicted, a)
            moved = solve(mass, -multiply(stiffness, jump[port]))
            projection_response[port] = np.concatenate((jump[port], np.zeros(n_dof), moved))
        internal = system.load - multiply(damping, system.velocity) - multiply(stiffness, system.displacement)
        acceleration = solve(mass, internal)
        pivot, lower = factorised(matrix)
        header = np.array([n_dof, bandwidth, float(np.any(damping)), dt, self.beta, self.gamma])
        ground = grounded(stiffness)
        bands = [ground] if bandwidth == 0 else [ground, stiffness[1], lower[0]]
        arrays = [1.0 / pivot, system.load, damping[0], *bands, *mass]
        return Stepper(
            free=free,
            measure=measure,
            parameters=np.concatenate((header, *arrays)),
            state=np.concatenate((system.displacement, system.velocity, acceleration)),
            force_response=force_response,
            impulse_response=impulse_response,
            projection_response=projection_response,
            jump=jump,
            face_rows=ports,
            derive=derive if bandwidth == 0 else None,
        )
