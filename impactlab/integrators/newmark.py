"""The Newmark method, in midpoint-load form."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import final

import numpy as np

from impactlab.integrators.alpha import alpha_step, mid_step, newmark_losses
from impactlab.integrators.base import AbstractIntegrator, Step
from impactlab.integrators.flat_matrices import has_coupled_damping
from impactlab.integrators.theta import theta_step
from impactlab.models.base import Operators
from impactlab.numerics.compiling import UNPACK
from impactlab.numerics.subnormals import flush_subnormals, restore_subnormals
from impactlab.numerics.windows import window
from impactlab.types import Array, option

AVERAGE = 0.25, 0.5  # beta and gamma of the average acceleration
N, DT, BETA, GAMMA, LOAD = range(5)  # places in the parameters, which go on with the arrays of `split`


@UNPACK
def split(parameters: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Return load, mass, damping, stiffness and the inverse matrix, (n_dof,) each.

    The last is 1/(M + gamma dt C + beta dt^2 K).
    """
    n = int(parameters[N])
    return (
        window(parameters, LOAD, n),
        window(parameters, LOAD + n, n),
        window(parameters, LOAD + 2 * n, n),
        window(parameters, LOAD + 3 * n, n),
        window(parameters, LOAD + 4 * n, n),
    )


def free(parameters: Array, state: Array) -> None:
    """Step without contact, of uncoupled coordinates: predict, solve for the acceleration, correct.

    Its equation is (M + gamma dt C + beta dt^2 K) a = load - C v - K u; coupled ones go through `banded_steps`.
    """
    before = flush_subnormals()  # modes fade away
    n, dt, beta, gamma = int(parameters[N]), parameters[DT], parameters[BETA], parameters[GAMMA]
    load, _, damping, stiffness, pivot = split(parameters)
    u, v, a = window(state, 0, n), window(state, n, n), window(state, 2 * n, n)
    old_u, old_v = dt * dt * (0.5 - beta), dt * (1.0 - gamma)
    new_u, new_v = beta * dt * dt, gamma * dt
    for i in range(n):
        u[i] += dt * v[i] + old_u * a[i]
        v[i] += old_v * a[i]
        a[i] = pivot[i] * (load[i] - stiffness[i] * u[i] - damping[i] * v[i])
        u[i] += new_u * a[i]
        v[i] += new_v * a[i]
    restore_subnormals(before)


def measure(parameters: Array, state: Array, out: Array) -> None:
    """Write the energy that Newmark conserves or damps, and the work of the load [J].

    The work is that so far, up to a constant.

    The energy is v M v/2 + u K u/2 + kappa a M a/2 + min(kappa, 0) v C a, kappa = (beta - gamma/2) dt^2, which is zero
    for average acceleration (see `newmark_losses`).
    """
    n, dt, beta, gamma = int(parameters[N]), parameters[DT], parameters[BETA], parameters[GAMMA]
    share = (beta - 0.5 * gamma) * dt * dt
    load, mass, damping, stiffness, _ = split(parameters)
    u, v, a = window(state, 0, n), window(state, n, n), window(state, 2 * n, n)
    energy, work = 0.0, 0.0
    for i in range(n):
        energy += 0.5 * (mass[i] * (v[i] * v[i] + share * a[i] * a[i]) + stiffness[i] * u[i] * u[i])
        work += load[i] * u[i]
    if share < 0.0:
        for i in range(n):
            energy += share * damping[i] * v[i] * a[i]
    out[0], out[1] = energy, work


def derive(parameters: Array, state: Array) -> None:
    """Rewrite the accelerations, M a = load - C v - K u."""
    n = int(parameters[N])
    load, mass, damping, stiffness, _ = split(parameters)
    for i in range(n):
        state[2 * n + i] = (load[i] - damping[i] * state[n + i] - stiffness[i] * state[i]) / mass[i]


@final
@dataclass(frozen=True)
class Newmark(AbstractIntegrator):
    """The Newmark method (average acceleration by default), its contact force acting as a midpoint load.

    The accelerations carried are those without contact force; the force of a step, constant over it, adds its exact
    impulse F dt and its displacement F dt^2/2 (deviation from the source: the contact force is no part of the
    accelerations, so that a force that jumps from step to step gives its whole impulse). With beta = 1/4, gamma = 1/2
    this is the midpoint rule; coupled coordinates are then stepped as that, without an array of accelerations.

    References
    ----------
    Newmark1959; EscalonaMayoDominguez1999, Section 5 (delta = 0.5, alpha = 0.25).
    """

    citations = ("Newmark1959",)
    order = 2
    examples = ({}, {"beta": 1.0 / 6.0})

    beta: float = option(
        0.25, at_least=0.0, at_most=1.0, description="weight of the new acceleration in the displacement"
    )
    gamma: float = option(0.5, at_least=0.5, at_most=1.0, description="weight of the new acceleration in the velocity")

    @property
    def gains_energy(self) -> float:
        # Measured for other weights: 0.12 (docs/bounds.md); the average acceleration gains nothing.
        return 0.0 if (self.beta, self.gamma) == AVERAGE else 0.2

    def limit(self, system: Operators) -> float:
        if 2.0 * self.beta >= self.gamma or system.highest_frequency == 0.0:
            return math.inf
        return 1.0 / (system.highest_frequency * math.sqrt(0.5 * self.gamma - self.beta))

    def step(self, system: Operators, dt: float) -> Step:
        if max(system.mass.shape[0], system.stiffness.shape[0]) > 1 or has_coupled_damping(system):
            if (self.beta, self.gamma) == AVERAGE:
                return theta_step(system, dt, 0.5)
            return alpha_step(system, dt, (0.0, 0.0), (self.beta, self.gamma))
        n_dof, beta, gamma = system.load.size, self.beta, self.gamma
        mass, damping, stiffness = system.mass[0], system.damping[0], system.stiffness[0]
        pivot = 1.0 / (mass + gamma * dt * damping + beta * dt**2 * stiffness)
        step = Step(
            free=free,
            measure=measure,
            parameters=np.concatenate(([n_dof, dt, beta, gamma], system.load, mass, damping, stiffness, pivot)),
            load=slice(LOAD, LOAD + n_dof),
            state=np.concatenate((system.displacement, system.velocity, np.zeros(n_dof))),
            derive=derive,
            losses=newmark_losses(dt, (beta, gamma)),
        )
        return step._replace(force=partial(mid_step, step, dt))
