"""The central difference method (leapfrog)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.errors import PairingError
from impactlab.integrators import beam_steps
from impactlab.integrators.base import AbstractIntegrator, Step
from impactlab.integrators.chain_steps import measure_chain, step_chain
from impactlab.integrators.flat_matrices import NOTHING, has_coupled_damping
from impactlab.integrators.leapfrog_factors import (
    BANDWIDTH,
    DAMPED,
    DT,
    GROUNDED,
    LOAD,
    LOADED,
    LUMPED,
    RARE,
    SOFT,
    N,
    write_chain,
    write_factors,
)
from impactlab.models.base import Operators
from impactlab.numerics import addresses
from impactlab.numerics.banded import multiply
from impactlab.numerics.compiling import UNPACK
from impactlab.numerics.windows import window
from impactlab.types import Array

MASS_OF_ONE = LOAD + 6  # of a single coordinate: after its load, gain, chain of two, share kept and ground


@UNPACK
def split(parameters: Array) -> tuple[Array, Array, Array, Array, Array, Array, Array]:
    """Return the parameters of a step.

    They are load, gain dt/(M + dt C/2), chain of springs (n + 1,), share kept of v, ground, mass, and the runs of
    the chain or wide bands.
    """
    n = int(parameters[N])
    keep, rest = LOAD + 3 * n + 1, LOAD + 6 * n + 1
    return (
        window(parameters, LOAD, n),
        window(parameters, LOAD + n, n),
        window(parameters, LOAD + 2 * n, n + 1),
        window(parameters, keep, n),
        window(parameters, keep + n, n),
        window(parameters, keep + 2 * n, n),
        window(parameters, rest, parameters.size - rest),
    )


@UNPACK
def add_rare(parameters: Array, u: Array, v: Array) -> None:
    """Change the velocities by forces that few bodies have.

    They are dampers, springs to the ground, loads and centrifugal forces.
    """
    n, soft = int(parameters[N]), parameters[SOFT]
    load, gain, _, keep, ground, mass, _ = split(parameters)
    if parameters[DAMPED] != 0.0:
        for i in range(n):
            v[i] *= keep[i]
    if parameters[GROUNDED] != 0.0:
        for i in range(n):
            v[i] -= gain[i] * ground[i] * u[i]
    if parameters[LOADED] != 0.0:
        for i in range(n):
            v[i] += gain[i] * load[i]
    if soft != 0.0:
        for i in range(n):
            v[i] += soft * gain[i] * mass[i] * u[i]


@UNPACK
def along_bands(n: int, bandwidth: int, bands: Array, gain: Array, u: Array, v: Array) -> None:
    """Add the forces of springs between coordinates to the velocities, band by band."""
    for offset in range(1, bandwidth + 1):
        band = bands[(offset - 1) * n : offset * n]
        for i in range(n - offset):
            v[i] -= gain[i] * band[i] * (u[i + offset] - u[i])
        for i in range(offset, n):
            v[i] -= gain[i] * band[i - offset] * (u[i - offset] - u[i])


def free(parameters: Array, state: Array) -> None:
    """Step without contact: leapfrog on velocities, then displacements.

    v += dt M^-1 (load - K u - C (v_old + v_new)/2), then u += dt v. Of a body that turns the centrifugal force,
    softening times the mass, is added to the load. A tridiagonal stiffness is walked as a chain of springs, tied to the
    ground at its ends (and, rarely, inside); a wider one band by band, as springs too.
    """
    n, dt = state.size // 2, parameters[DT]
    u, v = window(state, 0, n), window(state, n, n)
    if parameters[RARE] != 0.0 or parameters[LOADED] != 0.0:
        add_rare(parameters, u, v)
    gain, done = window(parameters, LOAD + n, n), LOAD + 6 * n + 1
    rest = window(parameters, done, parameters.size - done)
    if parameters[BANDWIDTH] == 1.0 and n > 1:
        step_chain(rest, gain, window(parameters, LOAD + 2 * n, n + 1), dt, u, v)
        return
    along_bands(n, int(parameters[BANDWIDTH]), rest, gain, u, v)
    for i in range(n):
        u[i] += dt * v[i]


def free_rigid(parameters: Array, state: Array) -> None:
    """Step one coordinate without springs or dampers, as of a rigid body.

    v += gain times load, then u += dt v.
    """
    state[1] += parameters[LOAD + 1] * parameters[LOAD]
    state[0] += parameters[DT] * state[1]


def measure_rigid(parameters: Array, state: Array, out: Array) -> None:
    """Write the energy of such a coordinate, the work of its load [J], and m v if that is the momentum [N s].

    The energy is m v^2/2.
    """
    momentum = parameters[MASS_OF_ONE] * state[1]
    out[0], out[1] = 0.5 * momentum * state[1], parameters[LOAD] * (state[0] - 0.5 * parameters[DT] * state[1])
    if parameters[LUMPED] != 0.0:
        out[2] = momentum


def measure(parameters: Array, state: Array, out: Array) -> None:
    """Write the energy that leapfrog conserves, the work of its load [J], and M v if that is the momentum [N s].

    The energy is v M v/2 + u_old K u/2.
    """
    n, bandwidth, dt = int(parameters[N]), int(parameters[BANDWIDTH]), parameters[DT]
    load, _, chain, _, ground, mass, bands = split(parameters)
    u, v = window(state, 0, n), window(state, n, n)
    energy = work = momentum = 0.0
    if parameters[SOFT] != 0.0:
        for i in range(n):
            energy -= 0.5 * parameters[SOFT] * mass[i] * (u[i] - dt * v[i]) * u[i]
    if parameters[GROUNDED] != 0.0:
        for i in range(n):
            energy += 0.5 * ground[i] * (u[i] - dt * v[i]) * u[i]
    if parameters[LOADED] != 0.0:
        for i in range(n):
            work += load[i] * (u[i] - 0.5 * dt * v[i])
    if bandwidth == 1 and n > 1:
        twice, momentum = measure_chain(bands, mass, chain, dt, u, v)
        energy += 0.5 * twice
    else:
        for i in range(n):
            energy += 0.5 * mass[i] * v[i] * v[i]
            momentum += mass[i] * v[i]
    if bandwidth > 1:
        for offset in range(1, bandwidth + 1):
            band = bands[(offset - 1) * n : offset * n]
            for i in range(n - offset):
                stretch = u[i + offset] - u[i]
                energy -= 0.5 * band[i] * (stretch - dt * (v[i + offset] - v[i])) * stretch
    out[0], out[1] = energy, work
    if parameters[LUMPED] != 0.0:
        out[2] = momentum


@final
@dataclass(frozen=True)
class CentralDifference(AbstractIntegrator):
    """Central differences: explicit, diagonal mass, stable up to dt = 2/w_max.

    Velocities belong to half steps. The force of a step acts at its start; on a new touch its impulse F dt holds the
    closing jump.

    References
    ----------
    CourantFriedrichsLewy1928 (limit); Bathe1982, section 9.2.
    """

    citations = ("CourantFriedrichsLewy1928",)
    order = 2
    load_point = 0.0
    gains_energy = 0.05
    velocity_point = 0.5
    jump_in_force = True
    kicks_then_drifts = True
    needs_diagonal_mass = True

    def limit(self, system: Operators) -> float:
        return 2.0 / system.highest_frequency if system.highest_frequency > 0.0 else math.inf

    def step(self, system: Operators, dt: float) -> Step:
        if has_coupled_damping(system):
            raise PairingError(
                "integrator 'central_difference' supports only dampers on single coordinates, and this damping "
                "couples them",
                remedy="Use newmark, or a damping proportional to the mass.",
                path="solve.integrator",
            )
        n_dof, bandwidth = system.load.size, system.stiffness.shape[0] - 1
        pulled = multiply(system.stiffness, system.displacement) if np.count_nonzero(system.displacement) else NOTHING
        state, each = np.zeros(2 * n_dof), np.zeros((4, n_dof))
        momentum = NOTHING if system.momentum is None or system.beam_elements is not None else system.momentum
        rows = system.load, system.mass[0], momentum, system.damping[0], pulled, system.displacement, system.velocity
        flags = addresses.entered(write_factors, dt, *map(np.ascontiguousarray, rows), each, state)
        damped, loaded, lumped = flags & 1 != 0, flags & 2 != 0, flags & 4 != 0
        if system.beam_elements is not None:
            return Step(
                free=beam_steps.free,
                measure=beam_steps.measure,
                parameters=beam_steps.packed(system.beam_elements, dt, each, damped, loaded),
                load=slice(beam_steps.LOADED, beam_steps.LOAD + n_dof),
                state=state,
            )
        bands = system.stiffness[1:].ravel()
        springs = bands if bandwidth == 1 and n_dof > 1 else NOTHING
        parameters = np.zeros(LOAD + 6 * n_dof + 1 + 2 * springs.size)
        parameters[:LOAD] = n_dof, bandwidth, dt, damped, 0.0, system.softening, 0.0, lumped, loaded
        size = addresses.entered(write_chain, parameters, each, springs, system.supports())
        parameters = parameters[:size] if springs.size else np.concatenate((parameters, bands))
        rigid = n_dof == 1 and parameters[RARE] == 0.0
        return Step(
            free=free_rigid if rigid else free,
            measure=measure_rigid if rigid else measure,
            parameters=parameters,
            load=slice(LOADED, LOAD + n_dof),
            state=state,
            whole_momentum=lumped,
        )
