"""A rod as a row of bar elements: the mesh that `finite_element` steps and `modal` takes its shapes from."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.linalg import eigh, eigvalsh_tridiagonal

from impactlab.banded import multiply, solve
from impactlab.errors import CaseError
from impactlab.models.base import AbstractDiscreteModel, Face, Operators
from impactlab.models.elements import assembled, elements_per_segment, polynomials, reference
from impactlab.models.massless import Ints, MasslessNodes
from impactlab.scene import End, Rod
from impactlab.types import Array, Quantity

MassMatrix = Literal["consistent", "lumped", "redistributed"]
NEAR = 1e-9  # of an element: a place so near to a node is that node


class Mesh(AbstractDiscreteModel):
    """A rod in nodal displacements, clamped nodes and massless ones left out.

    Displacement and velocity are polynomials of degree ``order`` in an element; strain and stress, one degree lower,
    jump between elements: at a node shared by two the right one gives them. Damping is Rayleigh's (C = mass M +
    stiffness K of the whole body, its ends' springs and masses included), that of the material (Kelvin and Voigt), and
    the dashpots at the ends.

    Parameters
    ----------
    rod : Rod
    elements : int
        Elements over the whole rod, shared among segments by travel time.
    mass : "consistent" (exact integrals), "lumped" (quadrature at the nodes: diagonal) or "redistributed"
        The last: lumped, and the nodes of the contacts give their mass to their neighbours, so that they follow without
        inertia; order 1 only. Rows are those without the contact's force; `left_out` gives its share. Damping of a
        massless node acts as if it followed its neighbours statically.
    gravity : float
        m/s2, along +x.
    order : int
        Degree of the polynomials; 1 are 2-node bars.
    faces : tuple of Face
        Contacts of the rod, for the mass "redistributed".
    """

    def __init__(
        self,
        rod: Rod,
        elements: int,
        mass: MassMatrix,
        gravity: float,
        order: int = 1,
        faces: tuple[Face, ...] = (),
    ) -> None:
        counts = elements_per_segment(rod.segments, elements)
        spread = [np.full(count, segment.length / count) for segment, count in zip(rod.segments, counts, strict=True)]
        of_segment = np.repeat(np.arange(len(counts)), counts)
        self.order, self._element = order, reference(order)
        self.lengths = np.concatenate(spread)
        self._borders = np.concatenate(([0.0], np.cumsum(self.lengths)))
        self._borders[-1] = rod.length
        inside = 0.5 * (self._element.nodes[:-1] + 1.0) * self.lengths[:, None] + self._borders[:-1, None]
        self.nodes = np.append(inside.ravel(), rod.length)
        self.nodes[::order] = self._borders
        self.young = np.array([segment.young for segment in rod.segments])[of_segment]
        self.area = np.array([segment.area for segment in rod.segments])[of_segment]
        self.density = np.array([segment.density for segment in rod.segments])[of_segment]
        self._viscous = np.array([segment.viscosity * segment.area for segment in rod.segments])[of_segment]
        self._lumped = mass != "consistent"
        first = 1 if rod.left.kind == "clamped" else 0
        last = len(self.nodes) - (1 if rod.right.kind == "clamped" else 0)
        if first == last:
            raise CaseError(
                f"one element between two clamped ends leaves nothing of '{rod.name}' that moves",
                remedy="Give two elements or more.",
                path="solve.model.elements",
            )
        self.free_nodes = slice(first, last)
        self._ends: tuple[tuple[int, End], ...] = ((0, rod.left), (len(self.nodes) - 1, rod.right))
        self._rod, self._gravity = rod, gravity
        matrices = self._assembled()
        struck = np.zeros(0, np.int64)
        if mass == "redistributed":
            struck = self._struck(faces)
            redistribute(matrices[0], struck + first)
        self._nodal_mass = multiply(matrices[0], np.ones(len(self.nodes)))
        cut = [self._cut(matrix) for matrix in matrices]
        self._massless = MasslessNodes(struck, cut[2]) if struck.size else None
        if self._massless is not None:
            cut = [cut[0][:, self._massless.kept], *(self._massless.condensed(matrix) for matrix in cut[1:])]
        self.mass: Array = cut[0][:1] if self._lumped else cut[0]
        self.damping: Array = narrowed(cut[1])
        self.stiffness: Array = cut[2]
        self.places = tuple(dict.fromkeys(face.x for face in faces)) if struck.size else ()

    def operators(self) -> Operators:
        highest = self._highest_frequency()
        profile = self._rod.displacement
        return Operators(
            mass=self.mass,
            damping=self.damping,
            stiffness=self.stiffness,
            load=self.momentum_row() * self._gravity,
            displacement=self.at_nodes(np.zeros(len(self.nodes)) if profile is None else profile(self.nodes)),
            velocity=np.full(self.mass.shape[1], self._rod.velocity),
            highest_frequency=highest,
            rule_frequency=highest,
            diagonal_mass=self._lumped,
            modes=False,
            massless=tuple((x, self.left_out(x, "displacement", x)) for x in self.places),
        )

    def row(self, x: float, quantity: Quantity) -> Array:
        row = self._nodal_row(x, quantity)
        return row if self._massless is None else self._massless.folded(row)

    def left_out(self, x: float, quantity: Quantity, face: float) -> float:
        """Return what a massless node adds at x per unit force on it; no mode is left out."""
        if self._massless is None or quantity == "velocity":
            return 0.0
        at = self._massless.at
        pressed = self._massless.flexibility * self._nodal_row(face, "displacement")[at]
        return float(self._nodal_row(x, quantity)[at] @ pressed)

    def momentum_row(self) -> Array:
        return self.at_nodes(self._nodal_mass)

    def grid(self) -> Array:
        return self.nodes

    @property
    def is_held(self) -> bool:
        """Whether an end holds the rod against rigid motion."""
        return any(end.kind in ("clamped", "spring") for _, end in self._ends)

    @property
    def borders(self) -> Ints:
        """The coordinates at the borders of elements, (n,) int: the rod's matrices couple nothing across one."""
        numbers = np.arange(0, len(self.nodes), self.order, dtype=np.int64)
        numbers = numbers[(numbers >= self.free_nodes.start) & (numbers < self.free_nodes.stop)] - self.free_nodes.start
        if self._massless is None:
            return numbers
        return np.asarray(np.searchsorted(self._massless.kept, np.setdiff1d(numbers, self._massless.at)), np.int64)

    def at_nodes(self, nodal: Array) -> Array:
        """Return those of the values of all nodes that belong to coordinates, shape (n_dof,)."""
        free = nodal[self.free_nodes]
        return free if self._massless is None else free[self._massless.kept]

    def static(self, force: Array) -> Array:
        """Return the static displacements (n_dof,) under forces on the coordinates.

        A rod that nothing holds is taken in the frame that moves with it: the inertia of its mean acceleration is
        subtracted (inertia relief) and the answer carries no rigid motion.
        """
        if self.is_held:
            return solve(self.stiffness, force)
        inertia = self.momentum_row()
        balanced = force - inertia * (force.sum() / inertia.sum())
        displacement = np.zeros(force.size)
        displacement[1:] = solve(np.ascontiguousarray(self.stiffness[:, 1:]), balanced[1:])
        return np.asarray(displacement - (inertia @ displacement) / inertia.sum())

    def static_answer(self, x: float, quantity: Quantity, face: float) -> float:
        """Return the static answer of the whole mesh at x per unit force to the right at ``face`` [m]."""
        answer = self.row(x, quantity) @ self.static(self.row(face, "displacement"))
        return float(answer) + self.left_out(x, quantity, face)

    def quotients(self, shapes: Array) -> Array:
        """Return u K u (n,) of shapes (n_dof, n), as a sum of squares.

        That keeps low frequencies, where the eigenvalues are lost in the rounding of the highest.
        """
        nodal = np.zeros((len(self.nodes), shapes.shape[1]))
        nodal[self.free_nodes] = shapes if self._massless is None else self._massless.unfolded(shapes)
        step, count = self.order, len(self.lengths)
        within = [nodal[i : i + step * count : step] - nodal[: step * count : step] for i in range(step + 1)]
        squares = np.zeros(shapes.shape[1])
        for weight, slope in zip(self._element.weights, self._element.slopes, strict=True):
            stretch = sum(share * part for share, part in zip(slope[1:], within[1:], strict=True))
            squares += (2.0 * weight * self.young * self.area / self.lengths) @ np.square(stretch)
        for node, end in self._ends:
            if end.kind == "spring":
                squares += end.value * nodal[node] ** 2
        return np.asarray(squares)

    def _nodal_row(self, x: float, quantity: Quantity) -> Array:
        """Return the quantity at x as a row over the nodes that are not clamped."""
        near = NEAR * float(self.lengths.min())
        element = int(np.clip(np.searchsorted(self._borders, x + near, side="right") - 1, 0, len(self.lengths) - 1))
        start, h = self._borders[element], self._borders[element + 1] - self._borders[element]
        place = 2.0 * (x - start) / h - 1.0
        node = int(np.argmin(np.abs(self._element.nodes - place)))
        place = self._element.nodes[node] if abs(self._element.nodes[node] - place) <= 2.0 * NEAR else place
        values = polynomials(self.order, float(place))
        if quantity not in ("displacement", "velocity"):
            young, area = self.young[element], self.area[element]
            factor = {"strain": 1.0, "stress": young, "force": young * area}[quantity]
            values = -2.0 * factor / h * (values @ self._element.slopes)
        row = np.zeros(len(self.nodes))
        row[element * self.order : (element + 1) * self.order + 1] = values
        return row[self.free_nodes]

    def _assembled(self) -> tuple[Array, Array, Array]:
        """Return mass, damping and stiffness of all nodes, ends included, (order + 1, n_nodes) each."""
        element, half = self._element, 0.5 * self.lengths
        mass = assembled(element.lumped if self._lumped else element.consistent, self.density * self.area * half)
        stiffness = assembled(element.stiffness, self.young * self.area / half)
        damping = assembled(element.stiffness, self._viscous / half)
        for node, end in self._ends:
            matrix = {"mass": mass, "dashpot": damping, "spring": stiffness}.get(end.kind)
            if matrix is not None:
                matrix[0, node] += end.value
        damping += self._rod.damping.mass * mass + self._rod.damping.stiffness * stiffness
        return mass, damping, stiffness

    def _cut(self, matrix: Array) -> Array:
        """Return the matrix of the nodes that are not clamped; no column keeps a coupling to one that was left out."""
        cut = matrix[:, self.free_nodes].copy()
        for offset in range(1, len(cut)):
            cut[offset, max(0, cut.shape[1] - offset) :] = 0.0
        return cut

    def _struck(self, faces: tuple[Face, ...]) -> Ints:
        """Return the numbers of the contacts' nodes among those not clamped, or raise where they cannot lose mass."""
        struck, path, remedy = [], "solve.model.mass", "Give mass: lumped or consistent."
        for face in faces:
            row = self._nodal_row(face.x, "displacement")
            if np.count_nonzero(row) != 1:
                raise CaseError(
                    f"mass 'redistributed' needs a node at every contact, and x = {face.x:.6g} m of "
                    f"'{self._rod.name}' lies inside an element",
                    remedy="Give a number of elements that puts a node there, or mass: lumped.",
                    path=path,
                )
            struck.append(int(np.argmax(row)))
            ends = {0.0: self._rod.left, self._rod.length: self._rod.right}
            held = ends.get(face.x, End("free")).kind
            if held in ("mass", "dashpot"):
                raise CaseError(
                    f"mass 'redistributed' takes the inertia from a struck face, and that of '{self._rod.name}' at "
                    f"x = {face.x:.6g} m carries a {held}",
                    remedy=remedy,
                    path=path,
                )
        at = np.unique(np.array(struck, np.int64))
        if np.any(np.diff(at) == 1) or at.size >= self.free_nodes.stop - self.free_nodes.start:
            raise CaseError(
                f"mass 'redistributed' needs a node with mass between two contacts of '{self._rod.name}'",
                remedy="Give more elements.",
                path="solve.model.elements",
            )
        return at

    def _highest_frequency(self) -> float:
        """Return the highest frequency, rad/s: exact for 2-node bars of lumped mass, else a bound.

        For 2-node bars of consistent mass the bound is that by rows (Gershgorin); for elements of higher order the
        highest frequency of any one element alone (IronsTreharne1971).
        """
        mass, stiffness = self.mass, self.stiffness
        if self.order > 1:
            squared = max(self._element_frequency(k) for k in {0, len(self.lengths) - 1, *self._unlike()})
        elif self._lumped:
            scale = 1.0 / np.sqrt(mass[0])
            off = stiffness[1, :-1] * scale[:-1] * scale[1:]
            top = mass.shape[1] - 1
            squared = eigvalsh_tridiagonal(stiffness[0] * scale**2, off, select="i", select_range=(top, top))[0]
        else:
            rows = [np.abs(matrix[1]) + np.concatenate(([0.0], np.abs(matrix[1, :-1]))) for matrix in (mass, stiffness)]
            squared = np.max((stiffness[0] + rows[1]) / (mass[0] - rows[0]))
        return float(np.sqrt(squared))

    def _unlike(self) -> list[int]:
        """Return the first element of each segment."""
        each = (self.lengths, self.young, self.area, self.density)
        changes = np.array([np.diff(values) != 0.0 for values in each])
        return [0, *(np.flatnonzero(changes.any(axis=0)) + 1)]

    def _element_frequency(self, number: int) -> float:
        """Return the highest squared frequency of an element cut free, with the spring of its end."""
        half, element = 0.5 * self.lengths[number], self._element
        stiffness = self.young[number] * self.area[number] / half * element.stiffness
        mass = (
            self.density[number] * self.area[number] * half * (element.lumped if self._lumped else element.consistent)
        )
        for node, end in self._ends:
            if end.kind == "spring" and number == (0 if node == 0 else len(self.lengths) - 1):
                corner = 0 if node == 0 else self.order
                stiffness[corner, corner] += end.value
        return float(eigh(stiffness, mass, eigvals_only=True)[-1])


def redistribute(mass: Array, at: Ints) -> None:
    """Take the mass of nodes and give it to their neighbours, in place; ``mass`` (2, n) is diagonal.

    KhenousLabordeRenard2008; HagerHueeberWohlmuth2008. Deviation: the sources also keep the centre of mass and the
    moment of inertia; in a rod with uniform nodes only the sum is kept.
    """
    last = mass.shape[1] - 1
    for node in at:
        neighbours = [other for other in (node - 1, node + 1) if 0 <= other <= last]
        mass[0, neighbours] += mass[0, node] / len(neighbours)
        mass[0, node] = 0.0


def narrowed(matrix: Array) -> Array:
    """Return the matrix without its outermost bands that are zero, shape (bandwidth + 1, n)."""
    used = [offset for offset in range(1, len(matrix)) if np.any(matrix[offset])]
    return matrix[: 1 + max(used, default=0)]
