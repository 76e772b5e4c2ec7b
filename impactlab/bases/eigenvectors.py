"""Eigenvectors of a mesh of bars with its contact faces free."""

from __future__ import annotations

from typing import Literal, final

import numpy as np
from scipy.linalg import eigh
from threadpoolctl import threadpool_limits

from impactlab.banded import multiply
from impactlab.errors import CaseError
from impactlab.models.mesh import Mesh
from impactlab.scene import Profile, Rod
from impactlab.types import Array, Quantity


def full(banded: Array) -> Array:
    """Return the symmetric matrix of a lower banded form, shape (n, n)."""
    matrix = np.diag(banded[0])
    for offset in range(1, banded.shape[0]):
        matrix += np.diag(banded[offset, :-offset], -offset) + np.diag(banded[offset, :-offset], offset)
    return matrix


@final
class MeshBasis:
    """The lowest eigenvectors of a mesh, mass-normalised, rigid modes first.

    Attributes
    ----------
    frequencies : (n_dof,)
        rad/s; exactly zero for a rigid mode.
    """

    def __init__(self, rod: Rod, elements: int, modes: int | None, mass: Literal["consistent", "lumped"]) -> None:
        self.mesh = Mesh(rod, elements, mass, gravity=0.0)
        operators = self.mesh.operators()
        rigid = 0 if self.mesh.is_held else 1
        available = operators.load.size - rigid
        if modes is not None and modes > available:
            raise CaseError(
                f"{modes} modes asked for, but the mesh of {elements} elements has {available} elastic modes",
                remedy=f"Give modes: {available} or fewer, or more elements.",
                path="solve.model.modes",
            )
        kept = rigid + (available if modes is None else modes)
        # One thread: eigenvectors differ in their last bits with the number of threads.
        with threadpool_limits(limits=1):
            _, shapes = eigh(full(operators.stiffness), full(operators.mass), subset_by_index=(0, kept - 1))
        squared = self._quotients(rod, shapes)
        squared[:rigid] = 0.0
        if rigid:
            ones = np.ones(shapes.shape[0])
            shapes[:, 0] = ones / np.sqrt(ones @ multiply(operators.mass, ones))
        signs = np.sign(shapes[np.argmax(np.abs(shapes) > 1e-3 * np.abs(shapes).max(axis=0), axis=0), np.arange(kept)])
        self._shapes = shapes * signs
        self._mass = operators.mass
        self.frequencies: Array = np.sqrt(squared)

    def _quotients(self, rod: Rod, shapes: Array) -> Array:
        """Return the squared frequencies (n_dof,) by Rayleigh's quotient of mass-normalised shapes.

        A sum of squares keeps low frequencies, where the eigenvalues are lost in the rounding of the highest.
        """
        mesh = self.mesh
        nodal = np.zeros((len(mesh.nodes), shapes.shape[1]))
        nodal[mesh.free_nodes] = shapes
        squared = (mesh.young * mesh.area / mesh.lengths) @ np.diff(nodal, axis=0) ** 2
        for node, end in ((0, rod.left), (-1, rod.right)):
            if end.kind == "spring":
                squared += end.value * nodal[node] ** 2
        return np.asarray(squared)

    def row(self, x: float, quantity: Quantity) -> Array:
        """Return the quantity at x [m] of each mode, shape (n_dof,)."""
        return np.asarray(self.mesh.row(x, quantity) @ self._shapes)

    def static(self, x: float, quantity: Quantity, face: float) -> float:
        """Return the static answer of the whole mesh at x per unit force to the right at ``face``."""
        return float(self.mesh.row(x, quantity) @ self.mesh.static(self.mesh.row(face, "displacement")))

    def project(self, profile: Profile) -> Array:
        """Return the modal coordinates of a displacement profile, shape (n_dof,)."""
        nodal = profile(self.mesh.nodes)[self.mesh.free_nodes]
        return np.asarray(self._shapes.T @ multiply(self._mass, nodal))

    def project_uniform(self) -> Array:
        """Return the momentum of each mode at unit modal velocity, shape (n_dof,)."""
        return np.asarray(self._shapes.T @ self.mesh.momentum_row())

    def grid(self) -> Array:
        """Return the nodes, shape (n,) [m]."""
        return self.mesh.grid()
