"""Exact time stepping of uncoupled modes under forces constant over the step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.errors import PairingError
from impactlab.integrators.base import AbstractIntegrator, Step
from impactlab.models.base import Operators
from impactlab.numerics.compiling import UNPACK
from impactlab.numerics.lanes import LANES, lanes_at, put_lanes
from impactlab.numerics.windows import window
from impactlab.types import Array

N, LOADED, LOAD = range(3)  # places in the parameters, which go on with the arrays of `split`


@UNPACK
def split(parameters: Array) -> tuple[Array, Array, Array, Array, Array, Array, Array, Array]:
    """Return the arrays of the parameters: load, mass, frequency, and others.

    The others are cosine, sine and turn of a step, and its displacement and velocity per load. A frequency below zero
    is minus the rate at which an unstable mode grows.
    """
    n, arrays = int(parameters[N]), window(parameters, LOAD, parameters.size - LOAD)
    return (
        window(arrays, 0, n),
        window(arrays, n, n),
        window(arrays, 2 * n, n),
        window(arrays, 3 * n, n),
        window(arrays, 4 * n, n),
        window(arrays, 5 * n, n),
        window(arrays, 6 * n, n),
        window(arrays, 7 * n, n),
    )


def free(parameters: Array, state: Array) -> None:
    """Step without contact: the exact free evolution of each mode, load included."""
    n = int(parameters[N])
    load, _, _, cosine, sine, turn, lift, push = split(parameters)
    u, v = window(state, 0, n), window(state, n, n)
    done = 0
    while done + LANES <= n:
        old, rate, even = lanes_at(u, done), lanes_at(v, done), lanes_at(cosine, done)
        put_lanes(u, done, even * old + lanes_at(sine, done) * rate)
        put_lanes(v, done, even * rate - lanes_at(turn, done) * old)
        done += LANES
    for i in range(done, n):
        first = u[i]
        u[i] = cosine[i] * first + sine[i] * v[i]
        v[i] = cosine[i] * v[i] - turn[i] * first
    if parameters[LOADED] != 0.0:
        for i in range(n):
            u[i] += lift[i] * load[i]
            v[i] += push[i] * load[i]


def measure(parameters: Array, state: Array, out: Array) -> None:
    """Write the energy v M v/2 + u K u/2 and the load's work [J].

    The work is that so far, up to a constant [J].
    """
    n = int(parameters[N])
    load, mass, frequency, _, _, _, _, _ = split(parameters)
    energy, work = 0.0, 0.0
    for i in range(n):
        spin = frequency[i] * state[i]
        strain = spin * spin if frequency[i] >= 0.0 else -spin * spin
        energy += 0.5 * mass[i] * (state[n + i] * state[n + i] + strain)
        work += load[i] * state[i]
    out[0], out[1] = energy, work


def retime(parameters: Array, dt: float) -> None:
    """Rewrite the constants of the step for another step length."""
    n = int(parameters[N])
    _, masses, frequencies, cosines, sines, turn, lift, push = split(parameters)
    for i in range(n):
        mass, frequency = masses[i], frequencies[i]
        if frequency > 0.0:
            half = math.sin(0.5 * frequency * dt) / frequency
            cosine, sine = math.cos(frequency * dt), math.sin(frequency * dt) / frequency
            moved = 2.0 * half * half
        elif frequency < 0.0:
            half = math.sinh(0.5 * frequency * dt) / frequency
            cosine, sine = math.cosh(frequency * dt), math.sinh(frequency * dt) / frequency
            moved = 2.0 * half * half
        else:
            cosine, sine, moved = 1.0, dt, 0.5 * dt * dt
        cosines[i], sines[i], turn[i] = cosine, sine, frequency * abs(frequency) * sine
        lift[i], push[i] = moved / mass, sine / mass


@final
@dataclass(frozen=True)
class ExactModal(AbstractIntegrator):
    """Exact motion of each mode under a contact force constant over the step.

    A step may have any length. A coordinate of negative stiffness, as that of a mass that turns, moves by hyperbolic
    functions.

    References
    ----------
    Bathe1982, section 9.3 (mode superposition; Duhamel's integral of a constant force).
    """

    citations = ("Bathe1982",)
    order = 2
    any_dt = True
    gains_energy = 0.0
    needs_modes = True

    def step(self, system: Operators, dt: float) -> Step:
        if np.count_nonzero(system.damping):
            raise PairingError(
                "integrator 'exact_modal' supports only undamped modes",
                remedy="Use newmark, or midpoint where events are located.",
                path="solve.integrator",
            )
        n_dof, mass = system.load.size, system.mass[0]
        squared = system.stiffness[0] / mass
        frequency = np.copysign(np.sqrt(np.abs(squared)), squared)
        head = [float(n_dof), float(np.count_nonzero(system.load) > 0)]
        parameters = np.concatenate((head, system.load, mass, frequency, np.zeros(5 * n_dof)))
        retime(parameters, dt)
        return Step(
            free=free,
            measure=measure,
            parameters=parameters,
            load=slice(LOADED, LOAD + n_dof),
            state=np.concatenate((system.displacement, system.velocity)),
            retime=retime,
        )
