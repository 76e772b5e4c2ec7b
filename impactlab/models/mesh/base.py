"""Base class of meshes of bars and beams: statics, a bound of frequencies, cuts of banded matrices."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from impactlab.models.base import AbstractDiscreteModel, Operators
from impactlab.numerics.banded import multiply, solve
from impactlab.scene.bodies import ElasticBody, End, Profile
from impactlab.types import Array, Ints, Quantity

NODE_TOL = 1e-9  # of an element: a place so near to a node is that node
FULL_RANK = 1e-6  # of the largest entry squared: two rows with such a determinant are no multiples of each other


class AbstractMesh(AbstractDiscreteModel):
    """A body in nodal coordinates.

    Attributes
    ----------
    body : ElasticBody
    mass, damping, stiffness : (bandwidth + 1, n_dof)
        Lower banded; a diagonal mass has one row.
    rigid : (n_dof, n_rigid)
        Motions without strain or support, mass-normalised, a translation first; none of a body that is held.
    pins : tuple of int
        As many coordinates, which together stop these motions.
    lengths, of_segment : (n_elements,)
        Of the elements [m], and the number of the segment of each.
    ends : tuple of (int, End)
        Node and support.
    order : int
        Elements share every ``order``-th node.
    places : tuple of float
        Places [m] of faces without mass.
    near : float
        Distance [m] within which a place is that of a node.
    struck : tuple of float
        Places [m] of contacts, at which internal forces jump.
    motions : tuple of Quantity
        The motions of a node; all of them fixed, the body is cut in two.
    """

    motions: ClassVar[tuple[Quantity, ...]] = ("displacement",)

    body: ElasticBody
    lumped: bool
    mass: Array
    damping: Array
    stiffness: Array
    rigid: Array
    pins: tuple[int, ...]
    lengths: Array
    of_segment: Ints
    ends: tuple[tuple[int, End], ...]
    order: int
    places: tuple[float, ...]
    near: float
    struck: tuple[float, ...]
    _rows: dict[tuple[float, Quantity], Array]  # that were read

    def row(self, x: float, quantity: Quantity) -> Array:
        quantity = "displacement" if quantity == "velocity" else quantity  # the same row
        if (row := self._rows.get((x, quantity))) is None:
            row = self._rows[x, quantity] = self._row(x, quantity)
            row.flags.writeable = False  # every caller gets the same array
        return row

    @abstractmethod
    def _row(self, x: float, quantity: Quantity) -> Array:
        """Return a new array for `row`, which keeps it."""

    @abstractmethod
    def coordinates(self, profile: Profile) -> Array:
        """Return the coordinates of a displacement profile, shape (n_dof,)."""

    @abstractmethod
    def quotients(self, shapes: Array) -> Array:
        """Return u K u (n,) of shapes (n_dof, n), as a sum of squares.

        Of a body that turns the centrifugal part is subtracted.

        That keeps low frequencies, where the eigenvalues are lost in the rounding of the highest.
        """

    @abstractmethod
    def element_matrices(self, number: int) -> tuple[Array, Array]:
        """Return stiffness and mass of a single free element, (m, m) each.

        Its coordinates are in the order of nodes.
        """

    def highest_of_elements(self) -> float:
        """Return the highest frequency of any single element [rad/s].

        It is a bound above that of the mesh. An end's spring is borne by its one element; an end's mass only lowers
        frequencies.

        References
        ----------
        IronsTreharne1971.
        """
        from scipy.linalg import eigh
        from scipy.linalg.lapack import dsygvd

        one = len(self.body.segments) == 1
        unlike = set() if one else set((np.flatnonzero(self.of_segment[1:] != self.of_segment[:-1]) + 1).tolist())
        squared, seen = 0.0, set()
        for number in unlike | {0, int(self.lengths.argmin()), len(self.lengths) - 1}:
            stiffness, mass = self.element_matrices(number)
            for node, end in self.ends:
                if end.kind == "spring" and number == (0 if node == 0 else len(self.lengths) - 1):
                    corner = 0 if node == 0 else len(stiffness) - len(self.motions)
                    for at, spring in enumerate((end.value, end.rotational)[: len(self.motions)], start=corner):
                        stiffness[at, at] += spring
            same = stiffness.tobytes(), mass.tobytes()
            if same in seen:
                continue
            seen.add(same)
            values, _, fault = dsygvd(stiffness, mass, jobz="N", uplo="L")  # `eigh` itself checks for ten times as long
            values = eigh(stiffness, mass, eigvals_only=True) if fault else values
            squared = max(squared, float(values[-1]))
        return math.sqrt(squared)

    def is_shared(self, element: int, x: float, start: float) -> bool:
        """Return whether x [m] is the node between an element and the one before.

        The element starts at ``start`` [m]. Both lie in one segment, and no contact acts there, so that internal forces
        jump by the error of the mesh alone.
        """
        if not 0.0 < x < self.body.length or abs(x - start) > self.near:
            return False
        same = self.of_segment[element - 1] == self.of_segment[element]
        return bool(same) and all(abs(x - place) > self.near for place in self.struck)

    def stated(
        self, highest: float, uniform: Array | float, gravity: float, end_dashpots: Array, **more: Any
    ) -> Operators:
        """Return the operators of the mesh.

        ``uniform`` are its velocities where it moves as a whole by 1. ``more`` are operators by name that a mesh has
        beside those of every one.
        """
        profile, n_dof = self.body.displacement, self.mass.shape[1]
        velocity = np.zeros(n_dof)
        if self.body.velocity != 0.0:
            velocity += uniform * self.body.velocity
        forces = gravity != 0.0 or self.body.left.force != 0.0 or self.body.right.force != 0.0
        return Operators(
            mass=self.mass,
            damping=self.damping,
            stiffness=self.stiffness,
            load=self.momentum_row() * gravity + end_load(self, self.body) if forces else np.zeros(n_dof),
            displacement=np.zeros(n_dof) if profile is None else self.coordinates(profile),
            velocity=velocity,
            highest_frequency=highest,
            rule_frequency=highest,
            diagonal_mass=self.lumped,
            end_dashpots=end_dashpots,
            modes=False,
            momentum=self.momentum_row(),
            **more,
        )

    def at_ends(self, kind: str) -> Array:
        """Return masses, dashpots or springs of the ends on all nodes, held ones included."""
        per = len(self.motions)
        values = np.zeros(per * (self.ends[1][0] + 1))
        for node, end in self.ends:
            if end.kind == kind:
                values[per * node : per * (node + 1)] = (end.value, end.rotational)[:per]
        return values

    @property
    def is_held(self) -> bool:
        """Whether an end holds the body against every rigid motion."""
        return bool(self.rigid.shape[1] == 0)

    def static(self, force: Array) -> Array:
        """Return the static displacements (n_dof,) under forces on the coordinates.

        A free body is taken in the frame that moves with it: the inertia of its rigid acceleration is
        subtracted (inertia relief) and the displacements hold no rigid motion.
        """
        if self.is_held:
            return solve(self.stiffness, force)
        inertia = np.column_stack([multiply(self.mass, column) for column in self.rigid.T])
        balanced = force - inertia @ (self.rigid.T @ force)
        # Under balanced forces the springs to the ground at the pins carry nothing, at any stiffness.
        grounded = self.stiffness.copy()
        grounded[0, list(self.pins)] *= 2.0
        displacement = solve(grounded, balanced)
        return np.asarray(displacement - self.rigid @ (inertia.T @ displacement))

    def static_compliance(self, x: float, quantity: Quantity, face: float) -> float:
        """Return the static quantity at x per unit force, to the right, at ``face`` [m]."""
        moved = self.row(x, quantity) @ self.static(self.row(face, "displacement"))
        return float(moved) + self.left_out(x, quantity, face)


def end_load(model: AbstractDiscreteModel, body: ElasticBody) -> Array:
    """Return the forces on the ends as loads on the model's coordinates, shape (n_dof,) [N]."""
    if body.left.force == 0.0 == body.right.force:
        return np.zeros(model.momentum_row().size)
    load = body.left.force * model.row(0.0, "displacement")
    return load if body.right.force == 0.0 else load + body.right.force * model.row(body.length, "displacement")


def sums_without(held: Sequence[int] | Ints, sums: Array, matrix: Array) -> Array:
    """Return the row sums of a banded matrix without the columns of held coordinates.

    The matrix is of shape (bandwidth + 1, n), the sums of shape (n,). ``sums`` are those of whole rows, zero where only
    differences of displacements count.
    """
    sums, n = sums.copy(), sums.size
    for column in held:
        for offset in range(len(matrix)):
            if column + offset < n:
                sums[column + offset] -= matrix[offset, column]
            if 0 < offset <= column:
                sums[column - offset] -= matrix[offset, column - offset]
    return sums


def part(matrix: Array, inside: Ints) -> Array:
    """Return the banded matrix of some coordinates, sorted (n,)."""
    if inside.size and inside[-1] - inside[0] + 1 == inside.size:
        cut = matrix[:, inside[0] : inside[-1] + 1].copy()
        for offset in range(1, len(cut)):
            cut[offset, max(0, inside.size - offset) :] = 0.0
        return cut
    cut = np.zeros((len(matrix), inside.size))
    for offset in range(min(len(matrix), inside.size)):
        columns, apart = inside[: inside.size - offset], inside[offset:] - inside[: inside.size - offset]
        coupled = apart < len(matrix)  # coordinates left out lie between others, which a band may then not join
        cut[offset, : columns.size][coupled] = matrix[apart[coupled], columns[coupled]]
    return cut


def quadratic_forms(matrix: Array, shapes: Array) -> Array:
    """Return u A u (n,) of shapes (n_dof, n) under a banded matrix."""
    products = np.column_stack([multiply(matrix, shape) for shape in shapes.T])
    return np.asarray(np.einsum("ij,ij->j", shapes, products))


def null_space(rows: Array) -> Array:
    """Return orthonormal vectors (n, n_null) that the rows (m, n) send to zero."""
    n = rows.shape[1]
    if (
        n == len(rows[:2]) == 2
        and abs(rows[0, 0] * rows[1, 1] - rows[0, 1] * rows[1, 0]) > FULL_RANK * np.abs(rows).max() ** 2
    ):
        return np.zeros((2, 0))  # of a body that is held, without the decomposition
    _, sizes, vectors = np.linalg.svd(rows)
    rank = int(np.count_nonzero(sizes > 1e-9 * sizes.max()))
    return np.asarray(vectors[rank:].T)
