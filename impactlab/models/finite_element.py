"""The full finite element model of a rod or a beam."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.models.base import AbstractDiscreteModel, AbstractRodModel, Deformed, Face
from impactlab.models.mesh.bar_elements import MassMatrix, check_order, laid_out, node_distance, shortest_transit
from impactlab.models.mesh.bars import Mesh
from impactlab.models.mesh.beams import BeamMesh
from impactlab.models.mesh.contact_nodes import with_nodes_at
from impactlab.scene.bodies import Beam, ElasticBody, WaveBody
from impactlab.types import option


@final
@dataclass(frozen=True)
class FiniteElement(AbstractRodModel):
    """Bar elements of any order (2-node or spectral), or beam elements.

    Every nodal coordinate is kept. Order 2 and above are spectral elements, their nodes those of Gauss-Lobatto-Legendre
    quadrature. A consistent mass is integrated exactly, whatever the order (deviation from the sources, which have the
    lumped one only); a lumped one by the quadrature at the nodes, so that it is diagonal. With ``mass: redistributed``
    (order 1, lumped) the nodes of contacts carry no mass: theirs goes to the neighbours, and they follow statically
    (deviation from the sources, which keep the centre of mass and the moment of inertia too: only the mass is kept).
    The mesh length that ``courant`` counts is the smallest distance between nodes.

    References
    ----------
    Bathe1982, chapters 4 and 9; EscalonaMayoDominguez1999, Eq. 23 (shape functions); Patera1984 and KomatitschTromp1999
    (spectral elements); KhenousLabordeRenard2008 and HagerHueeberWohlmuth2008 (redistributed mass).
    """

    serves_rotation = True
    citations = (
        "Bathe1982",
        "HagerHueeberWohlmuth2008",
        "KhenousLabordeRenard2008",
        "KomatitschTromp1999",
        "Patera1984",
    )
    examples = (
        {"elements": 50},
        {"elements": 50, "mass": "lumped"},
        {"elements": 50, "mass": "redistributed"},
        {"elements": 12, "mass": "lumped", "order": 4},
        {"elements": 12, "order": 3},
    )

    elements: int = option(100, at_least=1, at_most=10_000_000, description="elements over the whole rod")
    mass: MassMatrix = option("consistent", description="mass matrix; redistributed: lumped, with none at the contacts")
    order: int = option(
        1, at_least=1, at_most=12, description="degree of the displacement in an element; from 2 on spectral elements"
    )

    def __post_init__(self) -> None:
        check_order(self.order, self.mass)

    @property
    def reads_partners(self) -> bool:
        return False

    def element_length(self, body: ElasticBody) -> float:
        return laid_out(body.segments, self.elements).shortest * node_distance(self.order)

    def shortest_transit(self, body: ElasticBody) -> float:
        return shortest_transit(body.segments, self.elements, self.order)

    def meshed(self, body: Deformed, faces: tuple[Face, ...]) -> Deformed:
        return with_nodes_at(body, faces, self.elements) if self.mass != "redistributed" else body

    def build(self, rod: WaveBody, gravity: float, faces: tuple[Face, ...] = ()) -> AbstractDiscreteModel:
        return Mesh(self.meshed(rod, faces), self.elements, self.mass, gravity, self.order, faces)

    def build_beam(self, beam: Beam, gravity: float, faces: tuple[Face, ...] = ()) -> AbstractDiscreteModel:
        return BeamMesh(self.meshed(beam, faces), self.elements, self.mass, gravity, self.order, faces=faces)
