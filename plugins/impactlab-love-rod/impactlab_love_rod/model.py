"""A rod whose section moves sideways as it is pressed: Love's correction of the bar."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.models.base import AbstractDiscreteModel, AbstractRodModel, Deformed, Face, Operators
from impactlab.models.mesh.bar_elements import elements_per_segment
from impactlab.models.mesh.bars import Mesh
from impactlab.models.mesh.contact_nodes import with_nodes_at
from impactlab.models.modal_body import ModalBody
from impactlab.numerics.banded import widened
from impactlab.scene import ElasticBody, End, Segment, WaveBody
from impactlab.types import Array, Quantity, option
from impactlab_love_rod.modes import LoveModes


@final
@dataclass(frozen=True)
class LoveRod(AbstractRodModel):
    """Love's rod: 2-node bars with the inertia of lateral motion in a consistent mass.

    A point at distance r from the axis moves sideways by -nu r u'. Its kinetic energy adds nu^2 r_p^2 rho A/2 times the
    integral of (du'/dt)^2, with r_p the polar radius of gyration of the section; long waves travel at c, short ones
    slower: w = c k/sqrt(1 + nu^2 r_p^2 k^2). With ``modes`` a uniform rod stands in its modes, known in closed form.
    Forces and stresses read are those of the axial strain, E u'; the part that the lateral inertia adds to the force
    through a section is not in them.

    References
    ----------
    Love1927, section 278; Graff1975, section 2.5.
    """

    citations = ("Love1927", "Graff1975")
    examples = (
        {"elements": 60},
        {"elements": 60, "poisson": 0.0},
        {"elements": 60, "radius_of_gyration": 0.02},
        {"modes": 20},
    )

    theory = "love"

    elements: int = option(100, at_least=1, at_most=10_000_000, description="elements over the whole rod")
    poisson: float = option(0.3, at_least=0.0, below=0.5, description="Poisson's ratio")
    radius_of_gyration: float | None = option(
        None, unit="m", above=0.0, description="polar radius of gyration of the section; default that of a circle"
    )

    modes: int | None = option(
        None, at_least=1, at_most=100_000, description="analytic modes of a uniform rod, instead of elements"
    )

    @property
    def has_mesh(self) -> bool:
        return self.modes is None

    def element_length(self, body: ElasticBody) -> float:
        if self.modes is not None:
            return body.length / self.modes
        counts = elements_per_segment(body.segments, self.elements)
        return min(segment.length / count for segment, count in zip(body.segments, counts, strict=True))

    def meshed(self, body: Deformed, faces: tuple[Face, ...]) -> Deformed:
        return body if self.modes is not None else with_nodes_at(body, faces, self.elements)

    def build(self, rod: WaveBody, gravity: float, faces: tuple[Face, ...] = ()) -> AbstractDiscreteModel:
        if self.modes is not None:
            segment = rod.segments[0]
            basis = LoveModes(rod, self.modes, self.lateral_length(segment))
            return ModalBody(rod, gravity, basis, False, waves=basis.waves(segment))
        return LoveBody(self, self.meshed(rod, faces), gravity, faces)

    def lateral_length(self, segment: Segment) -> float:
        """Return nu r_p, the length over which lateral inertia acts on waves [m]."""
        # A circle of area A has r_p^2 = R^2/2 = A/(2 pi).
        radius = (
            math.sqrt(segment.area / (2.0 * math.pi)) if self.radius_of_gyration is None else self.radius_of_gyration
        )
        return self.poisson * radius

    def exact_frequencies(self, rod: WaveBody, count: int) -> Array:
        """Return the frequencies of a uniform rod, free or clamped, (count,) [rad/s].

        w = c k/sqrt(1 + nu^2 r_p^2 k^2).
        """
        segment = rod.segments[0]
        quarter = (rod.left.kind == "clamped") != (rod.right.kind == "clamped")
        wave_number = (np.arange(1, count + 1) - (0.5 if quarter else 0.0)) * np.pi / rod.length
        short = self.lateral_length(segment) * wave_number
        return np.asarray(segment.wave_speed * wave_number / np.sqrt(1.0 + short**2))


@final
class LoveBody(AbstractDiscreteModel):
    """A mesh of bars whose mass holds the lateral inertia."""

    def __init__(self, model: LoveRod, rod: WaveBody, gravity: float, faces: tuple[Face, ...]) -> None:
        self._mesh = Mesh(rod, model.elements, "consistent", gravity, faces=faces)
        counts = elements_per_segment(rod.segments, model.elements)
        lateral = np.repeat([model.lateral_length(segment) for segment in rod.segments], counts)
        self._lateral: Array = self._mesh.density * self._mesh.area * lateral**2 / self._mesh.lengths  # kg, an element
        self._ends = (rod.left, rod.right)
        self._drag = rod.damping.mass  # 1/s, Rayleigh's share of the mass, lateral inertia included

    def operators(self) -> Operators:
        plain = self._mesh.operators()
        n_nodes, kept = len(self._mesh.nodes), self._mesh.free_nodes
        extra = np.zeros((2, n_nodes))
        extra[0, :-1] += self._lateral
        extra[0, 1:] += self._lateral
        extra[1, :-1] = -self._lateral
        extra = extra[:, kept].copy()
        extra[1, -1] = 0.0
        highest = self._highest_frequency()
        damping = widened(plain.damping, 1) + self._drag * extra if self._drag else plain.damping
        return plain._replace(
            mass=plain.mass + extra,
            damping=damping,
            ground_dashpots=None,
            highest_frequency=highest,
            rule_frequency=highest,
        )

    def row(self, x: float, quantity: Quantity) -> Array:
        return self._mesh.row(x, quantity)

    def left_out(self, x: float, quantity: Quantity, face: float) -> float:
        return 0.0

    def momentum_row(self) -> Array:
        # A motion of the whole rod strains nothing: the lateral inertia has no part in the momentum.
        return self._mesh.momentum_row()

    def grid(self) -> Array:
        return self._mesh.grid()

    def _highest_frequency(self) -> float:
        """Return the highest frequency of any single element: a bound [rad/s].

        Loads at its ends are included.
        """
        mesh = self._mesh
        element_mass = mesh.density * mesh.area * mesh.lengths
        spring = mesh.young * mesh.area / mesh.lengths
        diagonal, beside = element_mass / 3.0 + self._lateral, element_mass / 6.0 - self._lateral
        squared = 4.0 * spring / (2.0 * (diagonal - beside))  # of the motion (1, -1) of its nodes
        for element, node, end in ((0, 0, self._ends[0]), (-1, 1, self._ends[1])):
            squared[element] = max(
                squared[element], loaded(spring[element], diagonal[element], beside[element], node, end)
            )
        return float(np.sqrt(np.max(squared)))


def loaded(spring: float, diagonal: float, beside: float, node: int, end: End) -> float:
    """Return the largest squared frequency of one element whose node carries a spring."""
    stiffness = np.array([[spring, -spring], [-spring, spring]])
    mass = np.array([[diagonal, beside], [beside, diagonal]])
    stiffness[node, node] += end.value if end.kind == "spring" else 0.0
    return float(np.max(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real))
