"""Factors of a body's leapfrog step and its first state, in compiled code."""

from __future__ import annotations

from impactlab.integrators.chain_steps import write_runs
from impactlab.numerics.compiling import EXACT_ENTRY
from impactlab.numerics.windows import window
from impactlab.types import Array

N, BANDWIDTH, DT, DAMPED, GROUNDED, SOFT, RARE, LUMPED, LOADED, LOAD = range(10)
"""Places in the parameters; RARE is 1 if damped, grounded or soft, LUMPED if the masses are the momentum row.

They go on with load, gain, chain of springs (n + 1,), share kept of v, ground, mass (n,), and the runs of the chain or
wide bands."""


@EXACT_ENTRY
def write_factors(
    dt: float,
    load: Array,
    mass: Array,
    momentum: Array,
    damping: Array,
    pulled: Array,
    displacement: Array,
    velocity: Array,
    each: Array,
    state: Array,
) -> int:
    """Write the factors of a step, and the state at t = 0.

    The factors (4, n) are load, gain dt/(M + dt C/2), share kept of v, and mass. Velocities start half a step early, so
    that the first full step is centred at t = 0. ``pulled`` are the forces K u at t = 0, empty where there is no
    displacement. Return the sum of
    1 of a body that is damped, 2 of one with a load, and 4 of one whose momentum row is its masses.

    A dashpot brings its coordinate to the velocity at which it holds the other forces. Over half a step the force of
    t = 0 brings it farther than that where x = dt C/(2 M) exceeds 1, as at the end of a mesh under a dashpot stiffer
    than the impedance of the rod: the end would set out in the wrong direction. There the first full step leaves
    1/(1 + x) of the difference to that velocity; this is the share that the exact front leaves, if it crosses an
    element in a step. Just above x = 1 less is left, so that the velocity half a step early stays bounded.
    """
    damped = loaded = False
    lumped = momentum.size > 0
    for i in range(load.size):
        damped, loaded = damped or damping[i] != 0.0, loaded or load[i] != 0.0
        lumped = lumped and momentum[i] == mass[i]
    n, half_step = load.size, 0.5 * dt
    for i in range(n):
        gain, keep, half, internal = dt / mass[i], 1.0, 0.0, load[i]
        if damped:
            half = half_step * damping[i] / mass[i]
            gain, keep = gain / (1.0 + half), (1.0 - half) / (1.0 + half)
            internal -= damping[i] * velocity[i]
        if pulled.size > 0:
            internal -= pulled[i]
        each[0, i], each[1, i], each[2, i], each[3, i] = load[i], gain, keep, mass[i]
        state[i], state[n + i] = displacement[i], velocity[i] - half_step * internal / mass[i]
        if half > 1.0:
            ahead = internal / damping[i]  # of the velocity, that at which the dashpot holds the other forces
            state[n + i] = velocity[i] + ahead + ahead * min(1.0 + half, 1.0 / (half - 1.0))
    return damped + 2 * loaded + 4 * lumped


@EXACT_ENTRY
def write_chain(parameters: Array, each: Array, springs: Array, supports: Array) -> int:
    """Write the parameters of a body whose stiffness is a chain, or wider.

    The header has n and DAMPED. ``springs`` are the band below the diagonal, negative; of a wider stiffness it is
    empty. Return how many numbers were written.
    """
    n = int(parameters[N])
    load, gain = window(parameters, LOAD, n), window(parameters, LOAD + n, n)
    chain, keep = window(parameters, LOAD + 2 * n, n + 1), window(parameters, LOAD + 3 * n + 1, n)
    ground, mass = window(parameters, LOAD + 4 * n + 1, n), window(parameters, LOAD + 5 * n + 1, n)
    for i in range(n):
        load[i], gain[i], keep[i], mass[i] = each[0, i], each[1, i], each[2, i], each[3, i]
        ground[i] = supports[i]
    written = LOAD + 6 * n + 1
    if springs.size > 1:
        for i in range(n - 1):
            chain[i + 1] = -springs[i]
        chain[0], chain[n] = ground[0], ground[n - 1]
        ground[0] = ground[n - 1] = 0.0
        written += write_runs(gain, chain, mass, window(parameters, written, 2 * n))
    for i in range(n):
        if ground[i] != 0.0:
            parameters[GROUNDED] = 1.0
    if parameters[DAMPED] != 0.0 or parameters[GROUNDED] != 0.0 or parameters[SOFT] != 0.0:
        parameters[RARE] = 1.0
    return written
