"""A body's matrices in the flat form that the compiled steps read (`impactlab.integrators.banded_steps`)."""

from __future__ import annotations

import numpy as np

from impactlab.integrators.banded_steps import HEADER, LOADED, WEIGHTS
from impactlab.models.base import Operators
from impactlab.numerics.banded import trimmed, widened
from impactlab.numerics.banded_kernels import factorise
from impactlab.types import Array

NOTHING = np.zeros(0)


def springs_of(system: Operators) -> Array:
    """Return the stiffness as springs: to the ground, then the bands below its diagonal, flat."""
    return np.concatenate((system.springs_to_ground(), trimmed(system.stiffness)[1:].ravel()))


def chain_springs(system: Operators) -> Array:
    """Return `springs_of` a chain, whose stiffness is tridiagonal; of another body nothing."""
    springs = springs_of(system)
    return springs if springs.size == 2 * system.load.size else NOTHING


def dashpots_of(system: Operators) -> Array:
    """Return the damping as dashpots, flat; empty if undamped.

    Those to the ground come first, then the bands below the diagonal.
    """
    if not np.count_nonzero(system.damping):
        return NOTHING
    ground = system.dashpots_inside() + system.dashpots_at_ends()
    return np.concatenate((ground, trimmed(system.damping)[1:].ravel()))


def trimmed_of(system: Operators) -> tuple[Array, Array, Array]:
    """Return mass, damping and stiffness without bands that are zero."""
    return trimmed(system.mass), trimmed(system.damping), trimmed(system.stiffness)


def has_coupled_damping(system: Operators) -> bool:
    """Return whether damping couples coordinates."""
    return len(system.damping) > 1 and bool(np.count_nonzero(system.damping[1:]))


def combined(system: Operators, of_damping: float, of_stiffness: float) -> Array:
    """Return M + a C + b K, lower banded, without zero bands."""
    matrices = trimmed_of(system)
    width = max(map(len, matrices)) - 1
    mass, damping, stiffness = (widened(matrix, width) for matrix in matrices)
    return np.asarray(mass + of_damping * damping + of_stiffness * stiffness)


def packed(
    system: Operators,
    dt: float,
    scheme: tuple[float, ...],
    *rest: Array,
    weights: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
) -> Array:
    """Return the parameters of a kernel: ``scheme`` are its own numbers, ``weights`` those of `measure`.

    ``rest`` are the arrays that it needs beside the body's.
    """
    mass, damping, stiffness = matrices = trimmed_of(system)
    width = max(map(len, matrices)) - 1
    damped = damping.shape[0] - 1 if np.count_nonzero(damping) else -1
    header = np.zeros(HEADER)
    header[:6] = system.load.size, stiffness.shape[0] - 1, damped, mass.shape[0] - 1, width, dt
    header[6 : 6 + len(scheme)] = scheme
    header[WEIGHTS:LOADED], header[LOADED] = weights, np.count_nonzero(system.load) > 0
    momentum = np.zeros(system.load.size) if system.momentum is None else system.momentum
    springs = system.springs_to_ground(), stiffness[1:].ravel()
    dashpots = NOTHING if damped < 0 else dashpots_of(system)
    return np.concatenate((header, system.load, *springs, mass.ravel(), dashpots, momentum, *rest))


def factors(matrix: Array, springs: Array = NOTHING) -> Array:
    """Return the factors of a banded matrix as `impactlab.numerics.banded_kernels.solve` takes them, flat.

    ``springs`` (flat, to the ground, then bands) are those whose forces the step finds along the same runs of rows.
    """
    found = np.concatenate((matrix.ravel(), np.zeros(matrix.shape[1])))
    factorise(matrix.shape[1], matrix.shape[0] - 1, found, springs)
    return found
