"""A rod as a row of 2-node bars: the mesh that `finite_element` steps and `modal` takes its eigenvectors from."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.linalg import eigvalsh_tridiagonal

from impactlab.banded import multiply, solve
from impactlab.errors import CaseError
from impactlab.models.base import AbstractDiscreteModel, Operators
from impactlab.scene import End, Rod, Segment
from impactlab.types import Array, Quantity


def elements_per_segment(segments: tuple[Segment, ...], elements: int) -> tuple[int, ...]:
    """Return how many elements each segment gets: at least one, shared out by travel time, ``elements`` in all."""
    times = np.array([segment.length / segment.wave_speed for segment in segments])
    shares = elements * times / times.sum()
    counts = np.maximum(1, np.floor(shares)).astype(int)
    while counts.sum() < elements:
        counts[np.argmax(shares - counts)] += 1
    while counts.sum() > elements and counts.max() > 1:
        counts[np.argmax(np.where(counts > 1, counts - shares, -np.inf))] -= 1
    return tuple(int(count) for count in counts)


class Mesh(AbstractDiscreteModel):
    """A rod in nodal displacements, clamped nodes left out.

    Linear elements: displacement and velocity are linear between nodes, strain and stress constant in an element; at
    a node shared by two elements the right one gives them.

    Parameters
    ----------
    rod : Rod
    elements : int
        Elements over the whole rod, shared among segments by travel time.
    mass : "consistent" or "lumped"
    gravity : float
        m/s2, along +x.
    """

    def __init__(self, rod: Rod, elements: int, mass: Literal["consistent", "lumped"], gravity: float) -> None:
        counts = elements_per_segment(rod.segments, elements)
        spread = [np.full(count, segment.length / count) for segment, count in zip(rod.segments, counts, strict=True)]
        of_segment = np.repeat(np.arange(len(counts)), counts)
        self.lengths = np.concatenate(spread)
        self.nodes = np.concatenate(([0.0], np.cumsum(self.lengths)))
        self.nodes[-1] = rod.length
        self.young = np.array([segment.young for segment in rod.segments])[of_segment]
        self.area = np.array([segment.area for segment in rod.segments])[of_segment]
        self.density = np.array([segment.density for segment in rod.segments])[of_segment]
        self._lumped = mass == "lumped"
        self._first = 1 if rod.left.kind == "clamped" else 0
        self._last = len(self.nodes) - (1 if rod.right.kind == "clamped" else 0)
        if self._first == self._last:
            raise CaseError(
                f"one element between two clamped ends leaves nothing of '{rod.name}' that moves",
                remedy="Give two elements or more.",
                path="solve.model.elements",
            )
        self._ends: tuple[tuple[int, End], ...] = ((0, rod.left), (len(self.nodes) - 1, rod.right))
        self._velocity = rod.velocity
        self._profile = rod.displacement
        self._gravity = gravity

    @property
    def free_nodes(self) -> slice:
        """The nodes that are coordinates."""
        return slice(self._first, self._last)

    def operators(self) -> Operators:
        mass, damping, stiffness = self._assembled()
        kept = self.free_nodes
        load = multiply(mass, np.full(mass.shape[1], self._gravity))[kept]
        at_start = np.zeros(len(self.nodes)) if self._profile is None else self._profile(self.nodes)
        n_dof = self._last - self._first
        mass, damping, stiffness = (self._cut(matrix) for matrix in (mass, damping, stiffness))
        highest = self._highest_frequency(mass, stiffness)
        return Operators(
            mass=mass[:1] if self._lumped else mass,
            damping=damping[:1],
            stiffness=stiffness,
            load=load,
            displacement=at_start[kept],
            velocity=np.full(n_dof, self._velocity),
            highest_frequency=highest,
            rule_frequency=highest,
            diagonal_mass=self._lumped,
            modes=False,
        )

    def row(self, x: float, quantity: Quantity) -> Array:
        element = int(np.clip(np.searchsorted(self.nodes, x, side="right") - 1, 0, len(self.lengths) - 1))
        row = np.zeros(len(self.nodes))
        h = self.lengths[element]
        if quantity in ("displacement", "velocity"):
            share = (x - self.nodes[element]) / h
            row[element : element + 2] = 1.0 - share, share
        else:
            factor = {"strain": 1.0, "stress": self.young[element], "force": self.young[element] * self.area[element]}
            row[element : element + 2] = np.array([1.0, -1.0]) * factor[quantity] / h
        return row[self.free_nodes]

    def left_out(self, x: float, quantity: Quantity, face: float) -> float:
        return 0.0

    def momentum_row(self) -> Array:
        mass, _, _ = self._assembled()
        return multiply(mass, np.ones(mass.shape[1]))[self.free_nodes]

    def grid(self) -> Array:
        return self.nodes

    @property
    def is_held(self) -> bool:
        """Whether an end holds the rod against rigid motion."""
        return any(end.kind in ("clamped", "spring") for _, end in self._ends)

    def static(self, force: Array) -> Array:
        """Return the static displacements under nodal forces, shape (n_dof,).

        A rod that nothing holds is taken in the frame that moves with it: the inertia of its mean acceleration is
        subtracted (inertia relief) and the answer carries no rigid motion.
        """
        operators = self.operators()
        mass = operators.mass
        if self.is_held:
            return solve(operators.stiffness, force)
        ones = np.ones(force.size)
        inertia = multiply(mass, ones)
        balanced = force - inertia * (force.sum() / inertia.sum())
        displacement = np.zeros(force.size)
        # A chain of springs: the force through each element is the sum of what acts on its left.
        through = np.cumsum(balanced)[:-1]
        displacement[1:] = np.cumsum(-through / (self.young * self.area / self.lengths))
        displacement -= ones * (inertia @ displacement) / inertia.sum()
        return displacement

    def _assembled(self) -> tuple[Array, Array, Array]:
        """Return mass, damping and stiffness of all nodes with the ends' springs, dashpots and masses, (2, n)."""
        n_nodes = len(self.nodes)
        element_mass = self.density * self.area * self.lengths
        element_stiffness = self.young * self.area / self.lengths
        mass, damping, stiffness = (np.zeros((2, n_nodes)) for _ in range(3))
        on_node, between = (0.5, 0.0) if self._lumped else (1.0 / 3.0, 1.0 / 6.0)
        mass[0, :-1] += on_node * element_mass
        mass[0, 1:] += on_node * element_mass
        mass[1, :-1] = between * element_mass
        stiffness[0, :-1] += element_stiffness
        stiffness[0, 1:] += element_stiffness
        stiffness[1, :-1] = -element_stiffness
        for node, end in self._ends:
            matrix = {"mass": mass, "dashpot": damping, "spring": stiffness}.get(end.kind)
            if matrix is not None:
                matrix[0, node] += end.value
        return mass, damping, stiffness

    def _cut(self, matrix: Array) -> Array:
        """Return the matrix of the free nodes; the last column keeps no coupling to a node that was left out."""
        cut = matrix[:, self.free_nodes].copy()
        cut[1, -1] = 0.0
        return cut

    def _highest_frequency(self, mass: Array, stiffness: Array) -> float:
        """Return the highest frequency, rad/s: exact for a lumped mass, a bound by rows (Gershgorin) otherwise."""
        if self._lumped:
            scale = 1.0 / np.sqrt(mass[0])
            off = stiffness[1, :-1] * scale[:-1] * scale[1:]
            top = mass.shape[1] - 1
            squared = eigvalsh_tridiagonal(stiffness[0] * scale**2, off, select="i", select_range=(top, top))[0]
        else:
            rows = [np.abs(matrix[1]) + np.concatenate(([0.0], np.abs(matrix[1, :-1]))) for matrix in (mass, stiffness)]
            squared = np.max((stiffness[0] + rows[1]) / (mass[0] - rows[0]))
        return float(np.sqrt(squared))
