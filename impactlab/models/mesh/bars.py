"""A rod as a row of bar elements, for `finite_element` and for the shapes of `modal`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import final

import numpy as np

from impactlab.errors import CaseError
from impactlab.models.base import Face, Operators
from impactlab.models.mesh.bar_elements import (
    MassMatrix,
    assembled,
    assembled_diagonal,
    laid_out,
    polynomials,
    reference,
)
from impactlab.models.mesh.base import NODE_TOL, AbstractMesh, quadratic_forms, sums_without
from impactlab.models.mesh.massless import MasslessNodes, redistribute, struck_nodes
from impactlab.numerics.banded import multiply, trimmed
from impactlab.scene.bodies import End, Profile, WaveBody
from impactlab.types import Array, Ints, Quantity


@final
class Mesh(AbstractMesh):
    """A rod in nodal displacements, clamped nodes and massless ones left out.

    Displacement and velocity are polynomials of degree ``order`` in an element; strain and stress, one degree lower,
    jump between elements: at a node inside a segment they are the mean of both sides, where segments join and at a
    contact those of the right one. Damping is Rayleigh's (C = mass M +
    stiffness K of the whole body, its ends' springs and masses included), that of the material (Kelvin and Voigt), and
    the dashpots at the ends. Of a rod that turns the stiffness is that of the rotating frame, K - Omega^2 M.

    Parameters
    ----------
    rod : WaveBody
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
        Contacts of the rod, at which stress jumps, and whose nodes are without mass where it is "redistributed".
    """

    def __init__(
        self,
        rod: WaveBody,
        elements: int,
        mass: MassMatrix,
        gravity: float,
        order: int = 1,
        faces: tuple[Face, ...] = (),
    ) -> None:
        self.order, self.element = order, reference(order)
        self.lengths, self.of_segment, self._borders, shortest = laid_out(rod.segments, elements)
        self.near = NODE_TOL * shortest
        self.struck = tuple(face.x for face in faces)
        self.nodes = self._borders
        if order > 1:
            inside = 0.5 * (self.element.nodes[:-1] + 1.0) * self.lengths[:, None] + self._borders[:-1, None]
            self.nodes = np.append(inside.ravel(), rod.length)
            self.nodes[::order] = self._borders
        facts = [(each.young, each.area, each.density, each.viscosity * each.area) for each in rod.segments]
        self._h: Array | float = self.lengths if len(facts) > 1 else float(self.lengths[0])
        # (n_elements,) each, of a uniform rod numbers: sums over its elements then take a third of the time.
        of_elements: Sequence[Array | float] = facts[0] if len(facts) == 1 else [*np.array(facts).T[:, self.of_segment]]
        self._young, self._area, self._density, self._viscous = of_elements
        self.lumped = mass != "consistent"
        self.free_nodes = free_nodes(rod, len(self.nodes))
        self.ends: tuple[tuple[int, End], ...] = ((0, rod.left), (len(self.nodes) - 1, rod.right))
        self.body = self.rod = rod
        self._gravity = gravity
        self._rows = {}
        kinds = self._kinds = {end.kind for _, end in self.ends}
        rayleigh = rod.damping.mass != 0.0 or rod.damping.stiffness != 0.0
        self._damped = rayleigh or "dashpot" in kinds or any(each.viscosity != 0.0 for each in rod.segments)
        *matrices, springs, dashpots = self._assembled()
        struck = np.zeros(0, np.int64)
        if mass == "redistributed":
            struck = struck_nodes(rod, [(face.x, self.nodal_row(face.x, "displacement")) for face in faces])
            redistribute(matrices[0], struck + self.free_nodes.start)
        self._nodal_mass = matrices[0][0] if self.lumped else multiply(matrices[0], np.ones(len(self.nodes)))
        cut, ground = self._of_coordinates(matrices, (dashpots, springs), struck)
        self.mass: Array = cut[0]
        self.damping: Array = trimmed(cut[1])
        self._ground_dashpots, self._ground_springs = ground
        # None acts on a node without mass.
        self._end_dashpots = self.at_nodes(self.at_ends("dashpot")) if "dashpot" in kinds else np.zeros(cut[2].shape[1])
        self.stiffness: Array = cut[2]
        self.places = tuple(dict.fromkeys(face.x for face in faces)) if struck.size else ()
        inertia = self.momentum_row()
        self.rigid, self.pins = np.zeros((inertia.size, 0)), ()
        if not kinds & {"clamped", "spring"}:
            self.rigid, self.pins = np.full((inertia.size, 1), 1.0 / np.sqrt(inertia.sum())), (0,)

    @property
    def young(self) -> Array:
        """Young's modulus of each element, (n_elements,) [Pa]."""
        return np.full(self.lengths.size, self._young)

    @property
    def area(self) -> Array:
        """Section of each element, (n_elements,) [m2]."""
        return np.full(self.lengths.size, self._area)

    @property
    def density(self) -> Array:
        """Density of each element, (n_elements,) [kg/m3]."""
        return np.full(self.lengths.size, self._density)

    def operators(self) -> Operators:
        return self.stated(
            self._highest_frequency(),
            1.0,
            self._gravity,
            self._end_dashpots,
            ground_springs=self._ground_springs,
            ground_dashpots=self._ground_dashpots,
            softening=self.rod.softening,
            massless=tuple((x, self.left_out(x, "displacement", x)) for x in self.places),
        )

    def _row(self, x: float, quantity: Quantity) -> Array:
        row = self.nodal_row(x, quantity)
        return row if self._massless is None else self._massless.folded(row)

    def left_out(self, x: float, quantity: Quantity, face: float) -> float:
        """Return the displacement that a force on a massless node adds at x, per force [m/N]."""
        if self._massless is None or quantity == "velocity":
            return 0.0
        at = self._massless.at
        pressed = self._massless.flexibility * self.nodal_row(face, "displacement")[at]
        return float(self.nodal_row(x, quantity)[at] @ pressed)

    def momentum_row(self) -> Array:
        return self.at_nodes(self._nodal_mass)

    def grid(self) -> Array:
        return self.nodes

    @property
    def borders(self) -> Ints:
        """Return the coordinates (n,) int at element borders, across which nothing couples."""
        numbers = np.arange(0, len(self.nodes), self.order, dtype=np.int64)
        numbers = numbers[(numbers >= self.free_nodes.start) & (numbers < self.free_nodes.stop)] - self.free_nodes.start
        if self._massless is None:
            return numbers
        return np.asarray(np.searchsorted(self._massless.kept, np.setdiff1d(numbers, self._massless.at)), np.int64)

    def at_nodes(self, nodal: Array) -> Array:
        """Return those of the values of all nodes that belong to coordinates, shape (n_dof,)."""
        free = nodal[self.free_nodes]
        return free if self._massless is None else free[self._massless.kept]

    def coordinates(self, profile: Profile) -> Array:
        return self.at_nodes(profile(self.nodes))

    def quotients(self, shapes: Array) -> Array:
        nodal = np.zeros((len(self.nodes), shapes.shape[1]))
        nodal[self.free_nodes] = shapes if self._massless is None else self._massless.unfolded(shapes)
        step, count = self.order, len(self.lengths)
        within = [nodal[i : i + step * count : step] - nodal[: step * count : step] for i in range(step + 1)]
        squares = np.zeros(shapes.shape[1])
        for weight, slope in zip(self.element.weights, self.element.slopes, strict=True):
            stretch = sum(share * part for share, part in zip(slope[1:], within[1:], strict=True))
            squares += (2.0 * weight * self._young * self._area / self.lengths) @ np.square(stretch)
        for node, end in self.ends:
            if end.kind == "spring":
                squares += end.value * nodal[node] ** 2
        if self.rod.softening:
            squares -= self.rod.softening * quadratic_forms(self.mass, shapes)
        return np.asarray(squares)

    def element_matrices(self, number: int) -> tuple[Array, Array]:
        half, segment, element = 0.5 * self.lengths[number], self.rod.segments[self.of_segment[number]], self.element
        mass = element.lumped if self.lumped else element.consistent
        stiffness = segment.young * segment.area / half * element.stiffness
        return stiffness, segment.density * segment.area * half * mass

    def _highest_frequency(self) -> float:
        """Return the highest frequency [rad/s]: exact for 2-node bars of lumped mass, else a bound.

        For 2-node bars of consistent mass the bound is that by rows (Gershgorin).
        """
        from scipy.linalg.lapack import dstebz

        mass, stiffness = self.mass, self.stiffness
        if self.order > 1:
            return self.highest_of_elements()
        if self.lumped:
            if (exact := self._highest_of_uniform()) is not None:
                return exact
            scale = 1.0 / np.sqrt(mass[0])
            off = stiffness[1, :-1] * scale[:-1] * scale[1:] if len(scale) > 1 else np.zeros(1)
            top = mass.shape[1]  # the wrapper of `scipy.linalg.eigvalsh_tridiagonal` takes longer than a small mesh
            return float(np.sqrt(dstebz(stiffness[0] * scale**2, off, 2, 0.0, 1.0, top, top, 0.0, "E")[1][0]))
        rows = [np.abs(matrix[1]) + np.concatenate(([0.0], np.abs(matrix[1, :-1]))) for matrix in (mass, stiffness)]
        return float(np.sqrt(np.max((stiffness[0] + rows[1]) / (mass[0] - rows[0]))))

    def _highest_of_uniform(self) -> float | None:
        """Return the highest frequency of equal bars of lumped mass [rad/s], else None.

        It is w = 2 c/h sin(k pi/(2 n)). None where the ends or the nodes are others.
        """
        kinds, pieces = [end.kind for _, end in self.ends], len(self.rod.segments)
        other = pieces > 1 or self._massless is not None or self.rod.softening != 0.0
        if other or not {*kinds} <= {"free", "dashpot", "clamped"}:
            return None
        segment, count = self.rod.segments[0], len(self.lengths)
        shape = math.cos(0.25 * kinds.count("clamped") * math.pi / count)  # the highest k is n, n - 1/2 or n - 1
        return 2.0 * math.sqrt(segment.young / segment.density) * count / segment.length * shape

    def nodal_row(self, x: float, quantity: Quantity) -> Array:
        """Return the quantity at x [m] as a row over nodes, (n,).

        The nodes are those that are not clamped, massless ones included.
        """
        row, moves = np.zeros(len(self.nodes)), quantity in ("displacement", "velocity")
        if moves and self.order == 1 and (x == 0.0 or x == self._borders[-1]):  # an end, where contacts mostly are
            row[0 if x == 0.0 else -1] = 1.0
            return row[self.free_nodes]
        element = int(self._borders.searchsorted(x + self.near, side="right")) - 1
        element = min(max(element, 0), len(self.lengths) - 1)
        start, h = self._borders[element], self._borders[element + 1] - self._borders[element]
        place = 2.0 * (x - start) / h - 1.0
        node = int(np.abs(self.element.nodes - place).argmin())
        place = self.element.nodes[node] if abs(self.element.nodes[node] - place) <= 2.0 * NODE_TOL else place
        if moves:
            row[element * self.order : (element + 1) * self.order + 1] = polynomials(self.order, float(place))
            return row[self.free_nodes]
        sides = [(element, float(place))]
        if self.is_shared(element, x, float(start)):
            sides.append((element - 1, 1.0))
        for number, at in sides:
            segment = self.rod.segments[self.of_segment[number]]
            size = self._borders[number + 1] - self._borders[number]
            factor = {"strain": 1.0, "stress": segment.young, "force": segment.young * segment.area}[quantity]
            slopes = -2.0 * factor / size * (polynomials(self.order, at) @ self.element.slopes)
            row[number * self.order : (number + 1) * self.order + 1] += slopes / len(sides)
        return row[self.free_nodes]

    def _assembled(self) -> tuple[Array, Array, Array, Array, Array]:
        """Return mass, damping and stiffness of all nodes, ends included, (order + 1, n_nodes) each.

        Then the sums of the rows of stiffness, and of damping without the dashpots at the ends, (n_nodes,) each.
        """
        element, half, count, springs = self.element, 0.5 * self._h, len(self.lengths), self.at_ends("spring")
        inertia = self._density * self._area * half
        stiffness = assembled(element.stiffness, self._young * self._area / half, count)
        if self.lumped:
            mass = assembled_diagonal(element.weights, inertia, count)
        else:
            mass = assembled(element.consistent, inertia, count)
        if "mass" in self._kinds:
            mass[0] += self.at_ends("mass")
        if "spring" in self._kinds:
            stiffness[0] += springs
        if not self._damped:
            return mass, np.zeros((1, len(self.nodes))), stiffness, springs, np.zeros(len(self.nodes))
        damping = assembled(element.stiffness, self._viscous / half, count)
        damping[0] += self.at_ends("dashpot")
        drag, retardation = self.rod.damping.mass, self.rod.damping.stiffness
        added = retardation * stiffness
        added[: len(mass)] += drag * mass
        damping += added
        dashpots = retardation * springs + (drag * multiply(mass, np.ones(len(self.nodes))) if drag else 0.0)
        return mass, damping, stiffness, springs, dashpots

    def _of_coordinates(
        self, matrices: Sequence[Array], sums: tuple[Array, Array], struck: Ints
    ) -> tuple[list[Array], list[Array]]:
        """Return mass, damping and stiffness, and the dashpots and springs to the ground.

        Clamped nodes and those without mass, ``struck``, are left out; the centrifugal force softens the rod.
        """
        free, rod = self.free_nodes, self.rod
        held = [*range(free.start), *range(free.stop, len(self.nodes))]
        ground = [sums_without(held, *each)[free] for each in zip(sums, matrices[1:], strict=True)]
        cut = [self._cut(matrix) for matrix in matrices]
        self._massless = MasslessNodes(struck, cut[2]) if struck.size else None
        if self._massless is not None:
            ground = [self._massless.sums(*each, ground[1]) for each in zip(ground, cut[1:], strict=True)]
            cut = [cut[0][:, self._massless.kept], *map(self._massless.condensed, cut[1:])]
        if rod.softening:
            cut[2][: len(cut[0])] -= rod.softening * cut[0]
            if damping := rod.damping.stiffness * rod.softening:
                cut[1][: len(cut[0])] -= damping * cut[0]
                ground[0] = ground[0] - damping * multiply(cut[0], np.ones(cut[0].shape[1]))
        return cut, ground

    def _cut(self, matrix: Array) -> Array:
        """Return the matrix of the nodes that are not clamped.

        No column keeps a coupling to a node that was left out.
        """
        cut = matrix[:, self.free_nodes].copy()
        for offset in range(1, len(cut)):
            cut[offset, max(0, cut.shape[1] - offset) :] = 0.0
        return cut


def free_nodes(rod: WaveBody, count: int) -> slice[int, int, int]:
    """Return the nodes of a rod that are not clamped; raise `CaseError` if all are."""
    first = 1 if rod.left.kind == "clamped" else 0
    last = count - (1 if rod.right.kind == "clamped" else 0)
    if first == last:
        raise CaseError(
            f"one element between two clamped ends leaves nothing of '{rod.name}' that moves",
            remedy="Give two elements or more.",
            path="solve.model.elements",
        )
    return slice(first, last)
