"""Exact time stepping of uncoupled modes under forces constant over the step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.errors import PairingError
from impactlab.integrators.base import AbstractIntegrator, Stepper
from impactlab.models.base import Operators
from impactlab.types import Array, Level


def free(parameters: Array, state: Array) -> None:
    """Step without contact: the exact free evolution of each mode, load included."""
    n = int(parameters[0])
    arrays = parameters[1:]
    cosine, sine, turn = arrays[3 * n : 4 * n], arrays[4 * n : 5 * n], arrays[5 * n : 6 * n]
    shift, push = arrays[6 * n : 7 * n], arrays[7 * n : 8 * n]
    u, v = state[:n], state[n : 2 * n]
    for i in range(n):
        old = u[i]
        u[i] = cosine[i] * old + sine[i] * v[i] + shift[i]
        v[i] = cosine[i] * v[i] - turn[i] * old + push[i]


def measure(parameters: Array, state: Array, out: Array) -> None:
    """Write the energy v M v/2 + u K u/2 [J] and the work of the load so far, up to a constant [J]."""
    n = int(parameters[0])
    arrays = parameters[1:]
    mass, frequency, load = arrays[:n], arrays[n : 2 * n], arrays[2 * n : 3 * n]
    energy, work = 0.0, 0.0
    for i in range(n):
        spin = frequency[i] * state[i]
        energy += 0.5 * mass[i] * (state[n + i] * state[n + i] + spin * spin)
        work += load[i] * state[i]
    out[0], out[1] = energy, work


def retime(parameters: Array, dt: float, jump: Array, force_response: Array, impulse_response: Array) -> None:
    """Rewrite the step's constants and responses (flat, port by port) for another step length."""
    n = int(parameters[0])
    arrays = parameters[1:]
    for i in range(n):
        mass, frequency, load = arrays[i], arrays[n + i], arrays[2 * n + i]
        if frequency > 0.0:
            half = math.sin(0.5 * frequency * dt) / frequency
            cosine, sine = math.cos(frequency * dt), math.sin(frequency * dt) / frequency
            lift = 2.0 * half * half
        else:
            cosine, sine, lift = 1.0, dt, 0.5 * dt * dt
        arrays[3 * n + i], arrays[4 * n + i], arrays[5 * n + i] = cosine, sine, frequency * frequency * sine
        arrays[6 * n + i], arrays[7 * n + i] = lift * load / mass, sine * load / mass
        for port in range(jump.size // n):
            push, u, v = jump[port * n + i], 2 * port * n + i, (2 * port + 1) * n + i
            force_response[u], force_response[v] = lift * push, sine * push
            impulse_response[u], impulse_response[v] = sine * push, cosine * push


@final
@dataclass(frozen=True)
class ExactModal(AbstractIntegrator):
    """Each mode moves by its exact solution, the contact force constant over the step; a step of any length.

    References
    ----------
    Bathe1982, section 9.3 (mode superposition; Duhamel's integral of a constant force).
    """

    citations = ("Bathe1982",)
    serves = frozenset(Level)
    order = 2
    any_dt = True
    hard_constraint_gains = True
    gains_energy = 0.0
    needs_modes = True

    def limit(self, system: Operators) -> float:
        return math.inf

    def prepare(self, system: Operators, ports: Array, dt: float) -> Stepper:
        if np.any(system.damping):
            raise PairingError(
                "integrator 'exact_modal' serves undamped modes only",
                remedy="Use newmark, or midpoint where events are located.",
                path="solve.integrator",
            )
        n_dof = system.load.size
        mass = system.mass[0]
        frequency = np.sqrt(system.stiffness[0] / mass)
        parameters = np.concatenate(([float(n_dof)], mass, frequency, system.load, np.zeros(5 * n_dof)))
        jump = np.ascontiguousarray(ports / mass)
        force_response, impulse_response = np.zeros((len(ports), 2 * n_dof)), np.zeros((len(ports), 2 * n_dof))
        stepper = Stepper(
            free=free,
            measure=measure,
            parameters=parameters,
            state=np.concatenate((system.displacement, system.velocity)),
            force_response=force_response,
            impulse_response=impulse_response,
            projection_response=np.hstack((jump, np.zeros_like(jump))),
            jump=jump,
            face_rows=ports,
            retime=retime,
        )
        retime(parameters, dt, jump.ravel(), force_response.ravel(), impulse_response.ravel())
        return stepper
