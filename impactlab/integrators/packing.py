"""A body's matrices in the flat form that the compiled steps read (`impactlab.integrators.banded_steps`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from impactlab.integrators.banded_steps import HEADER
from impactlab.models.base import Operators
from impactlab.numerics.banded import factorised, grounded, widened
from impactlab.types import Array


class Packed(NamedTuple):
    """Matrices of one bandwidth, to calculate with, and the parameters that every implicit kernel begins with."""

    mass: Array  # (width + 1, n_dof)
    damping: Array  # (width + 1, n_dof)
    stiffness: Array  # (width + 1, n_dof)
    width: int
    header: Array  # (16,)
    arrays: tuple[Array, ...]


def springs(banded: Array) -> Array:
    """Return a matrix as springs: to the ground, then its bands below the diagonal, flat."""
    return np.concatenate((grounded(banded)[None, :], banded[1:])).ravel()


def trimmed(banded: Array) -> Array:
    """Return the matrix without bands that are zero."""
    width = banded.shape[0] - 1
    while width > 0 and not np.any(banded[width]):
        width -= 1
    return banded[: width + 1]


def has_coupled_damping(system: Operators) -> bool:
    """Return whether damping couples coordinates."""
    return bool(np.any(system.damping[1:]))


def packed(
    system: Operators, dt: float, scheme: tuple[float, ...], weights: tuple[float, float, float, float]
) -> Packed:
    """Return a body's matrices for a kernel; ``scheme`` are its own numbers, ``weights`` those of `measure`."""
    mass, damping, stiffness = trimmed(system.mass), trimmed(system.damping), trimmed(system.stiffness)
    width = max(mass.shape[0], damping.shape[0], stiffness.shape[0]) - 1
    damped = damping.shape[0] - 1 if np.any(damping) else -1
    header = np.zeros(HEADER)
    header[:6] = system.load.size, stiffness.shape[0] - 1, damped, mass.shape[0] - 1, width, dt
    header[6 : 6 + len(scheme)] = scheme
    header[12:] = weights
    momentum = np.zeros(system.load.size) if system.momentum is None else system.momentum
    dampers = springs(damping) if damped >= 0 else np.zeros(0)
    return Packed(
        widened(mass, width),
        widened(damping, width),
        widened(stiffness, width),
        width,
        header,
        (system.load, springs(stiffness), mass.ravel(), dampers, momentum),
    )


def factors(matrix: Array) -> tuple[Array, Array]:
    """Return 1/D and the flat bands of L of a matrix's L D L^T."""
    pivot, lower = factorised(matrix)
    return 1.0 / pivot, lower.ravel()
