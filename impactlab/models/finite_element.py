"""The full finite element model of a rod."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, final

from impactlab.models.base import AbstractDiscreteModel, AbstractRodModel, Face
from impactlab.models.mesh import Mesh, elements_per_segment
from impactlab.scene import Rod
from impactlab.types import option


@final
@dataclass(frozen=True)
class FiniteElement(AbstractRodModel):
    """Two-node bar elements, every nodal displacement a coordinate; consistent or lumped mass.

    References
    ----------
    Bathe1982, chapters 4 and 9; EscalonaMayoDominguez1999, Eq. 23 (shape functions).
    """

    citations = ("Bathe1982",)
    examples = ({"elements": 50}, {"elements": 50, "mass": "lumped"})

    elements: int = option(100, at_least=1, at_most=10_000_000, description="elements over the whole rod")
    mass: Literal["consistent", "lumped"] = option("consistent", description="mass matrix")

    @property
    def has_mesh(self) -> bool:
        return True

    def element_length(self, rod: Rod) -> float:
        counts = elements_per_segment(rod.segments, self.elements)
        return min(segment.length / count for segment, count in zip(rod.segments, counts, strict=True))

    def build(self, rod: Rod, gravity: float, faces: tuple[Face, ...] = ()) -> AbstractDiscreteModel:
        return Mesh(rod, self.elements, self.mass, gravity)
