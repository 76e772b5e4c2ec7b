"""The central difference method (leapfrog)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.errors import PairingError
from impactlab.integrators import beam_steps
from impactlab.integrators.base import AbstractIntegrator, Stepper
from impactlab.integrators.packing import has_coupled_damping
from impactlab.models.base import Operators
from impactlab.numerics.banded import grounded, multiply, widened
from impactlab.types import Array, Level


def free(parameters: Array, state: Array) -> None:
    """Step without contact: v += dt M^-1 (load - K u - C (v_old + v_new)/2), then u += dt v.

    A tridiagonal stiffness is walked as a chain of springs, tied to the ground at its ends (and, rarely, inside); a
    wider one band by band, as springs too.
    """
    n, bandwidth, dt = int(parameters[0]), int(parameters[1]), parameters[2]
    damped, loaded, grounded = parameters[3], parameters[4], parameters[5]
    arrays = parameters[6:]
    if n == 1 and damped == 0.0 and grounded == 0.0:  # a rigid body, in a third of the time
        state[1] += arrays[4]
        state[0] += dt * state[1]
        return
    gain, chain = arrays[:n], arrays[n : 2 * n + 1]
    u, v = state[:n], state[n : 2 * n]
    if damped != 0.0:
        keep = arrays[2 * n + 1 : 3 * n + 1]
        for i in range(n):
            v[i] *= keep[i]
    if bandwidth == 1 and n > 1:
        v[0] -= gain[0] * (chain[0] * u[0] + chain[1] * (u[0] - u[1]))
        for i in range(1, n - 1):
            v[i] += gain[i] * (chain[i] * (u[i - 1] - u[i]) - chain[i + 1] * (u[i] - u[i + 1]))
        v[n - 1] += gain[n - 1] * (chain[n - 1] * (u[n - 2] - u[n - 1]) - chain[n] * u[n - 1])
    else:
        for offset in range(1, bandwidth + 1):
            band = arrays[(6 + offset) * n + 1 : (7 + offset) * n + 1]
            for i in range(n - offset):
                v[i] -= gain[i] * band[i] * (u[i + offset] - u[i])
            for i in range(offset, n):
                v[i] -= gain[i] * band[i - offset] * (u[i - offset] - u[i])
    if grounded != 0.0:
        ground = arrays[4 * n + 1 : 5 * n + 1]
        for i in range(n):
            v[i] -= gain[i] * ground[i] * u[i]
    if loaded != 0.0:
        push = arrays[3 * n + 1 : 4 * n + 1]
        for i in range(n):
            v[i] += push[i]
    for i in range(n):
        u[i] += dt * v[i]


def measure(parameters: Array, state: Array, out: Array) -> None:
    """Write the energy that leapfrog conserves, v M v/2 + u_old K u/2 [J], and its work of the load [J]."""
    n, bandwidth, dt = int(parameters[0]), int(parameters[1]), parameters[2]
    loaded, grounded = parameters[4], parameters[5]
    chain = parameters[6 + n : 7 + 2 * n]
    arrays = parameters[7 + 4 * n :]
    ground, mass, load = arrays[:n], arrays[n : 2 * n], arrays[2 * n : 3 * n]
    u, v = state[:n], state[n : 2 * n]
    energy, work = 0.0, 0.0
    for i in range(n):
        energy += 0.5 * mass[i] * v[i] * v[i]
    if grounded != 0.0:
        for i in range(n):
            energy += 0.5 * ground[i] * (u[i] - dt * v[i]) * u[i]
    if loaded != 0.0:
        for i in range(n):
            work += load[i] * (u[i] - 0.5 * dt * v[i])
    if bandwidth == 1 and n > 1:
        last = n - 1
        energy += 0.5 * chain[0] * (u[0] - dt * v[0]) * u[0]
        energy += 0.5 * chain[n] * (u[last] - dt * v[last]) * u[last]
        for i in range(last):
            stretch = u[i + 1] - u[i]
            energy += 0.5 * chain[i + 1] * (stretch - dt * (v[i + 1] - v[i])) * stretch
    elif bandwidth > 1:
        for offset in range(1, bandwidth + 1):
            band = arrays[(2 + offset) * n : (3 + offset) * n]
            for i in range(n - offset):
                stretch = u[i + offset] - u[i]
                energy -= 0.5 * band[i] * (stretch - dt * (v[i + offset] - v[i])) * stretch
    out[0], out[1] = energy, work


@final
@dataclass(frozen=True)
class CentralDifference(AbstractIntegrator):
    """The central difference method: explicit, diagonal mass, stable up to 2/w_max; velocities belong to half steps.

    The force of a step acts at its start; on a new touch its impulse F dt holds the closing jump.

    References
    ----------
    CourantFriedrichsLewy1928 (limit); Bathe1982, section 9.2.
    """

    citations = ("CourantFriedrichsLewy1928",)
    serves = frozenset(Level)
    order = 2
    load_point = 0.0
    gains_energy = 0.05
    velocity_point = 0.5
    jump_in_force = True
    needs_diagonal_mass = True

    def limit(self, system: Operators) -> float:
        return 2.0 / system.highest_frequency if system.highest_frequency > 0.0 else math.inf

    def prepare(self, system: Operators, ports: Array, dt: float) -> Stepper:
        if has_coupled_damping(system):
            raise PairingError(
                "integrator 'central_difference' serves dampers on single coordinates, and this damping couples them",
                remedy="Use newmark, or a damping proportional to the mass.",
                path="solve.integrator",
            )
        n_dof = system.load.size
        bandwidth = system.stiffness.shape[0] - 1
        mass, stiffness, damping = system.mass[0], widened(system.stiffness, bandwidth), system.damping[0]
        half = 0.5 * dt * damping / mass
        gain = dt / mass / (1.0 + half)
        keep = (1.0 - half) / (1.0 + half)
        chain, ground = np.zeros(n_dof + 1), grounded(stiffness)
        if bandwidth == 1:
            chain[1:-1] = -stiffness[1, :-1]
            if n_dof > 1:
                chain[0], chain[-1] = ground[0], ground[-1]
                ground[0] = ground[-1] = 0.0

        def linear_step(u: Array, v: Array) -> Array:
            v_new = keep * v - gain * multiply(stiffness, u)
            return np.concatenate((u + dt * v_new, v_new))

        jump = ports / mass
        force_response = np.hstack((dt * gain * ports, gain * ports))
        impulse_response = np.array([linear_step(np.zeros(n_dof), row) for row in jump]).reshape(len(ports), 2 * n_dof)
        internal = system.load - damping * system.velocity - multiply(stiffness, system.displacement)
        # Velocities start half a step early, so that the first full step is centred at t = 0.
        before = system.velocity - 0.5 * dt * internal / mass
        marks = (float(np.any(damping)), float(np.any(system.load)))
        header = np.array([n_dof, bandwidth, dt, *marks, np.any(ground)], float)
        bands = stiffness[1:].ravel() if bandwidth > 1 else np.zeros(0)
        arrays = (gain, chain, keep, gain * system.load, ground, mass, system.load, bands)
        steps, parameters = (free, measure), np.concatenate((header, *arrays))
        beam = beam_steps.beam_row(stiffness)
        if beam is not None:
            steps = beam_steps.free, beam_steps.measure
            parameters = beam_steps.packed(
                beam, dt, np.array([gain, keep, gain * system.load, mass, system.load]), marks
            )
        return Stepper(
            free=steps[0],
            measure=steps[1],
            parameters=parameters,
            state=np.concatenate((system.displacement, before)),
            force_response=force_response,
            impulse_response=impulse_response,
            projection_response=np.hstack((jump, np.zeros_like(jump))),
            jump=jump,
            face_rows=ports,
        )
