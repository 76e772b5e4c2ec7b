"""Base class of meshes, of bars or of beam elements, as the modal model uses them."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from impactlab.models.base import AbstractDiscreteModel
from impactlab.numerics.banded import multiply, solve
from impactlab.scene.bodies import ElasticBody, Profile
from impactlab.types import Array, Quantity

Ints = NDArray[np.int64]


class AbstractMesh(AbstractDiscreteModel):
    """A body in nodal coordinates.

    Attributes
    ----------
    body : ElasticBody
    mass, damping, stiffness : (bandwidth + 1, n_dof)
        Lower banded; a diagonal mass has one row.
    rigid : (n_dof, n_rigid)
        Motions that nothing resists, mass-normalised, a translation first; none of a body that is held.
    pins : tuple of int
        As many coordinates, which together stop these motions.
    lengths : (n_elements,)
        m.
    order : int
        Elements share every ``order``-th node.
    places : tuple of float
        Places [m] of faces without mass.
    motions : tuple of Quantity
        How a node moves: what must be fixed there to cut the body in two.
    """

    motions: ClassVar[tuple[Quantity, ...]] = ("displacement",)

    body: ElasticBody
    mass: Array
    damping: Array
    stiffness: Array
    rigid: Array
    pins: tuple[int, ...]
    lengths: Array
    order: int
    places: tuple[float, ...]

    @abstractmethod
    def coordinates(self, profile: Profile) -> Array:
        """Return the coordinates of a displacement profile, shape (n_dof,)."""

    @abstractmethod
    def quotients(self, shapes: Array) -> Array:
        """Return u K u (n,) of shapes (n_dof, n), as a sum of squares.

        That keeps low frequencies, where the eigenvalues are lost in the rounding of the highest.
        """

    @property
    def is_held(self) -> bool:
        """Whether an end holds the body against every rigid motion."""
        return bool(self.rigid.shape[1] == 0)

    def static(self, force: Array) -> Array:
        """Return the static displacements (n_dof,) under forces on the coordinates.

        A body that nothing holds is taken in the frame that moves with it: the inertia of its rigid acceleration is
        subtracted (inertia relief) and the answer carries no rigid motion.
        """
        if self.is_held:
            return solve(self.stiffness, force)
        inertia = np.column_stack([multiply(self.mass, column) for column in self.rigid.T])
        balanced = force - inertia @ (self.rigid.T @ force)
        # Under balanced forces the springs to the ground at the pins carry nothing, whatever their stiffness.
        grounded = self.stiffness.copy()
        grounded[0, list(self.pins)] *= 2.0
        displacement = solve(grounded, balanced)
        return np.asarray(displacement - self.rigid @ (inertia.T @ displacement))

    def static_answer(self, x: float, quantity: Quantity, face: float) -> float:
        """Return the static answer of the whole mesh at x per unit force to the right at ``face`` [m]."""
        answer = self.row(x, quantity) @ self.static(self.row(face, "displacement"))
        return float(answer) + self.left_out(x, quantity, face)


def sums_without(held: Ints, sums: Array, matrix: Array) -> Array:
    """Return the row sums of a banded matrix (bandwidth + 1, n) without the columns of held coordinates, (n,).

    ``sums`` are those of whole rows, as the model knows them: zero where only differences of displacements count.
    """
    sums, n = sums.copy(), sums.size
    for column in held:
        for offset in range(len(matrix)):
            if column + offset < n:
                sums[column + offset] -= matrix[offset, column]
            if 0 < offset <= column:
                sums[column - offset] -= matrix[offset, column - offset]
    return sums
