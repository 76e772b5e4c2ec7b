"""Rayleigh-Ritz reduction: a mesh in uncoupled coordinates of a few of its shapes."""

from __future__ import annotations

from typing import final

import numpy as np

from impactlab.bases.base import Completable
from impactlab.bases.shapes import upright, with_rigid_motions
from impactlab.models.mesh.base import AbstractMesh
from impactlab.numerics.banded import multiply
from impactlab.numerics.threads import one_thread
from impactlab.scene.bodies import Profile
from impactlab.types import Array, Quantity


@final
class ReducedMesh(Completable):
    """A mesh that moves in the span of some shapes only.

    Its coordinates are uncoupled and of unit mass.

    Parameters
    ----------
    mesh : Mesh
    shapes : (n_mesh_dof, n)
    uncoupled : bool
        They are eigenvectors already, mass-normalised, the rigid motion first.

    Attributes
    ----------
    shapes : (n_mesh_dof, n)
        Of the coordinates, mass-normalised, rigid motion first.
    frequencies : (n,)
        rad/s; exactly zero for rigid motions.
    uncoupled : bool
    """

    def __init__(self, mesh: AbstractMesh, shapes: Array, uncoupled: bool) -> None:
        self.mesh, self.uncoupled = mesh, uncoupled
        rigid = mesh.rigid.shape[1]
        if not uncoupled:
            shapes = self._uncoupled(shapes)
        squared = mesh.quotients(shapes)
        squared[:rigid] = 0.0
        self.shapes = shapes
        self.frequencies: Array = np.sqrt(squared)
        self._beyond: dict[float, Array] = {}  # static shapes by their face, less what these shapes hold

    def _uncoupled(self, shapes: Array) -> Array:
        """Return the eigenvectors of the mesh within the span of shapes."""
        from scipy.linalg import eigh

        mesh = self.mesh
        unit = shapes / np.sqrt(np.einsum("ij,ij->j", shapes, multiply(mesh.mass[..., None], shapes)))
        with one_thread():
            mass, stiffness = (unit.T @ multiply(matrix[..., None], unit) for matrix in (mesh.mass, mesh.stiffness))
            _, turned = eigh(0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T))
            return with_rigid_motions(mesh, upright(unit @ turned))

    def iterated(self) -> tuple[Array, Array]:
        """Return shapes and frequencies [rad/s] after one inverse iteration on the mesh.

        Their shapes are (n_mesh_dof, n) and (n,). Eigenvectors of the mesh stay as they are, and so do rigid motions.
        Quotients y K y / y M y of the new shapes lie between the frequencies here and those of the mesh.
        """
        shapes, frequencies = self.shapes.copy(), self.frequencies.copy()
        for number in np.flatnonzero(frequencies):
            inertia_force = multiply(self.mesh.mass, shapes[:, number]) * frequencies[number] ** 2
            shape = self.mesh.static(inertia_force)
            frequencies[number] = np.sqrt(shape @ inertia_force / (shape @ multiply(self.mesh.mass, shape)))
            shapes[:, number] = shape
        return shapes, frequencies

    def row(self, x: float, quantity: Quantity) -> Array:
        return np.asarray(self.mesh.row(x, quantity) @ self.shapes)

    def static(self, x: float, quantity: Quantity, face: float) -> float:
        return self.mesh.static_compliance(x, quantity, face)

    def remainder(self, x: float, quantity: Quantity, face: float) -> float:
        """Return the part of `static` that the coordinates lack, free of the rounding of a soft body."""
        mesh = self.mesh
        if face not in self._beyond:
            pressed = mesh.static(mesh.row(face, "displacement"))
            self._beyond[face] = pressed - self.shapes @ (self.shapes.T @ multiply(mesh.mass, pressed))
        return float(mesh.row(x, quantity) @ self._beyond[face]) + mesh.left_out(x, quantity, face)

    def project(self, profile: Profile) -> Array:
        return np.asarray(self.shapes.T @ multiply(self.mesh.mass, self.mesh.coordinates(profile)))

    def project_uniform(self) -> Array:
        return np.asarray(self.shapes.T @ self.mesh.momentum_row())

    def grid(self) -> Array:
        return self.mesh.grid()
