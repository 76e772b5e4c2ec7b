"""Residual coordinates: static shapes of the contacts without the modes kept."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import final

import numpy as np

from impactlab.bases.base import Completable
from impactlab.scene.bodies import Profile
from impactlab.types import Array, Quantity

MIN_RESIDUAL = 1e-9  # of the whole flexibility: a smaller one is rounding
# Squared frequency of the modes left out together, over that of the last one kept. Their shapes have unit mass, so that
# they give the flexibility sum 1/w^2 and, of what follows it with the acceleration of the force, sum 1/w^4.
BENDING, WAVES = 7.0 / 3.0, 3.0  # w as the number squared, of beams that bend alone; as the number


@final
class WithResiduals(Completable):
    """Modes of a body, and a residual coordinate for each contact.

    It moves as the static shape of the modes left out. Together they have the static flexibility of the whole body at
    the contacts. The frequency of the coordinates is that of the modes left out together, as if these went on like the
    last one kept.

    Parameters
    ----------
    basis : Completable
        Modes of the body.
    faces : sequence of float
        Places of the contacts [m], each once, at least one.
    spread : float
        `BENDING` or `WAVES`.
    most : float
        Frequency of the further coordinates, at most [rad/s]: one that a step resolves.

    References
    ----------
    MacNeal1971 (residual flexibility; ours: the residual mass by the frequency of the last mode kept).
    """

    def __init__(self, basis: Completable, faces: Sequence[float], spread: float, most: float = math.inf) -> None:
        self._basis, self._faces = basis, tuple(faces)
        left = np.array([self._left(x, "displacement") for x in self._faces])
        whole = max(basis.static(x, "displacement", x) for x in self._faces)
        sizes, shapes = np.linalg.eigh(0.5 * (left + left.T))
        found = sizes > MIN_RESIDUAL * whole
        own = basis.frequencies
        frequency = min(math.sqrt(spread) * float(own.max(initial=0.0)), most)
        self._shares = shapes[:, found] * (frequency / np.sqrt(sizes[found]))  # (faces, residuals)
        self.frequencies: Array = np.concatenate((own, np.full(self._shares.shape[1], frequency)))
        self._zeros = np.zeros(self._shares.shape[1])

    def row(self, x: float, quantity: Quantity) -> Array:
        quantity = "displacement" if quantity == "velocity" else quantity
        own = self._basis.row(x, quantity)
        return np.concatenate((own, self._left(x, quantity) @ self._shares)) if self._zeros.size else own

    def _left(self, x: float, quantity: Quantity) -> Array:
        """Return the quantity at x that the modes kept leave out, (faces,), per unit force there."""
        return np.array([self._basis.remainder(x, quantity, face) for face in self._faces])

    def remainder(self, x: float, quantity: Quantity, face: float) -> float:
        shared = (self._left(x, quantity) @ self._shares) @ (self._left(face, "displacement") @ self._shares)
        return self._basis.remainder(x, quantity, face) - float(shared / self.frequencies[-1] ** 2)

    def static(self, x: float, quantity: Quantity, face: float) -> float:
        return self._basis.static(x, quantity, face)

    def project(self, profile: Profile) -> Array:
        """Return the coordinates of a displacement profile, none of the modes left out, shape (n_dof,)."""
        return np.concatenate((self._basis.project(profile), self._zeros))

    def project_uniform(self) -> Array:
        """Return the momentum of each coordinate at unit velocity, shape (n_dof,); 0 of modes left out."""
        return np.concatenate((self._basis.project_uniform(), self._zeros))

    def grid(self) -> Array:
        return self._basis.grid()
