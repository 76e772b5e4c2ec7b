"""The modal model: a rod or a beam in a few uncoupled coordinates."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, final

from impactlab.bases.analytic import AnalyticBasis
from impactlab.bases.base import AbstractBasis, Completable, Coordinates
from impactlab.bases.beams.modes import BeamModes
from impactlab.bases.craig_bampton import CraigBampton
from impactlab.bases.eigenvectors import Eigenvectors
from impactlab.bases.reduced import ReducedMesh
from impactlab.bases.residual import BENDING, WAVES, WithResiduals
from impactlab.errors import CaseError, PairingError
from impactlab.models.base import AbstractDiscreteModel, AbstractRodModel, Deformed, Face
from impactlab.models.mesh.bar_elements import MassMatrix, check_order, laid_out, node_distance, shortest_transit
from impactlab.models.mesh.bars import Mesh
from impactlab.models.mesh.base import AbstractMesh
from impactlab.models.mesh.beams import BeamMesh
from impactlab.models.mesh.contact_nodes import with_nodes_at
from impactlab.models.modal_body import ModalBody, reduced_body
from impactlab.plugins import kind_of
from impactlab.scene.bodies import Beam, ElasticBody, WaveBody
from impactlab.types import option

MAX_COORDINATES = 2000  # coordinates of the mesh behind the modes, as the matrices are full


@final
@dataclass(frozen=True)
class Modal(AbstractRodModel):
    """A few uncoupled modes, by default free-end eigenvectors, of a mesh or analytic.

    Without a mesh they are analytic. ``modes`` counts coordinates beside the rigid motions that nothing holds, which
    are kept and not counted, whatever the basis: one of a rod, up to two of a beam. Damping must leave the modes
    uncoupled: Rayleigh's, or one viscosity over young for all. With ``residual`` each contact has a coordinate more,
    which moves as the static shape of the eigenvectors left out (`impactlab.bases.residual`): the flexibility at
    contacts is then that of the whole body.

    References
    ----------
    EscalonaMayoDominguez1999, Section 5.
    """

    serves_rotation = True
    citations: ClassVar[tuple[str, ...]] = ("EscalonaMayoDominguez1999",)
    examples = (
        {"modes": 20},
        {"modes": 20, "residual": True},
        {"elements": 60, "modes": 20},
        {"elements": 60},
        {"elements": 60, "modes": 20, "mass": "redistributed"},
        {"elements": 12, "modes": 20, "order": 4},
        {"elements": 60, "modes": 20, "basis": CraigBampton()},
        {"elements": 60, "modes": 20, "residual": True},
    )

    elements: int | None = option(
        None, at_least=1, at_most=2000, description="elements of the mesh behind the modes; without it analytic modes"
    )
    modes: int | None = option(
        None, at_least=1, at_most=100_000, description="elastic modes kept; default all of the mesh"
    )
    mass: MassMatrix = option(
        "consistent", description="mass matrix of the mesh; redistributed: lumped, with none at the contacts"
    )
    basis: AbstractBasis = option(
        Eigenvectors(), group="impactlab.bases", description="shapes of the mesh that the coordinates stand for"
    )
    order: int = option(1, at_least=1, at_most=12, description="degree of the displacement in an element of the mesh")
    residual: bool = option(
        False, description="add a coordinate for each contact: the static shape of the eigenvectors left out"
    )
    residual_frequency: float | None = option(
        None, unit="rad/s", above=0.0, description="of these coordinates, at most: one that the step resolves"
    )

    def __post_init__(self) -> None:
        check_order(self.order, self.mass)
        if self.elements is None:
            self._check_analytic()
        if self.residual and not (self.basis.free_end and self.mass != "redistributed"):
            raise CaseError(
                "residual: true replaces eigenvectors that are left out, of a body whose faces have "
                f"mass. Given: basis '{kind_of(self.basis)}' and mass '{self.mass}'",
                remedy="Use basis eigenvectors, and mass consistent or lumped, or leave out residual.",
                path="residual",
            )
        if self.residual_frequency is not None and not self.residual:
            raise CaseError(
                f"residual_frequency is {self.residual_frequency:g} rad/s, and without residual: true it has no effect",
                remedy="Give residual: true, or leave out residual_frequency.",
                path="residual_frequency",
            )
        if self.residual:
            object.__setattr__(self, "citations", (*type(self).citations, "MacNeal1971"))

    def _check_analytic(self) -> None:
        """Raise `CaseError` where analytic modes would ignore an option of the mesh."""
        for name, default in (("mass", "consistent"), ("order", 1)):
            if (given := getattr(self, name)) != default:
                raise CaseError(
                    f"{name} is {given}, an option of the mesh behind the modes; without elements the modes are "
                    "analytic, and it has no effect",
                    remedy=f"Give elements: 200, for example, or leave out {name}.",
                    path=name,
                )

    @property
    def has_mesh(self) -> bool:
        return self.elements is not None

    @property
    def reads_partners(self) -> bool:
        return self.elements is not None and self.basis.reads_partners

    def element_length(self, body: ElasticBody) -> float:
        if self.elements is None:
            return body.length / (self.modes or 1) * node_distance(self.order)
        return laid_out(body.segments, self.elements).shortest * node_distance(self.order)

    def shortest_transit(self, body: ElasticBody) -> float:
        if self.elements is None:
            return super().shortest_transit(body)
        return shortest_transit(body.segments, self.elements, self.order)

    def meshed(self, body: Deformed, faces: tuple[Face, ...]) -> Deformed:
        if self.elements is None or self.mass == "redistributed":
            return body
        return with_nodes_at(body, faces, self.elements)

    def build(self, rod: WaveBody, gravity: float, faces: tuple[Face, ...] = ()) -> AbstractDiscreteModel:
        self._check_ends(rod)
        if self.elements is None:
            return ModalBody(rod, gravity, self._completed(AnalyticBasis(rod, self._analytic()), rod, faces), True)
        mesh = Mesh(self.meshed(rod, faces), self.elements, self.mass, 0.0, self.order, faces)
        return self._reduced(mesh, gravity, self.basis.free_end, faces)

    def build_beam(self, beam: Beam, gravity: float, faces: tuple[Face, ...] = ()) -> AbstractDiscreteModel:
        self._check_ends(beam)
        if self.elements is None:
            return ModalBody(beam, gravity, self._completed(BeamModes(beam, self._analytic()), beam, faces), False)
        mesh = BeamMesh(self.meshed(beam, faces), self.elements, self.mass, 0.0, self.order, faces=faces)
        return self._reduced(mesh, gravity, False, faces)

    def _check_ends(self, body: ElasticBody) -> None:
        for side, end in (("left", body.left), ("right", body.right)):
            if end.kind in ("dashpot", "infinite"):
                infinite = end.unbounded or end.kind == "infinite"
                held = f"the infinite end ({side})" if infinite else f"the dashpot at the {side} end"
                raise PairingError(
                    f"model 'modal' does not support {held} of '{body.name}', with which the body has no "
                    "undamped modes",
                    remedy="Use finite_element or continuous for this body.",
                    path="solve.model",
                )

    def _analytic(self) -> int:
        """Return the number of analytic modes; raise where they cannot be."""
        if not self.basis.free_end:
            raise CaseError(
                "only free-end eigenvectors are known without a mesh",
                remedy="Give elements: 200, for example.",
                path="solve.model",
            )
        if self.modes is None:
            raise CaseError(
                "modal needs 'modes' (analytic) or 'elements'",
                remedy="Give modes: 40, for example.",
                path="solve.model",
            )
        return self.modes

    def _reduced(
        self, mesh: AbstractMesh, gravity: float, paper_rule: bool, faces: tuple[Face, ...]
    ) -> AbstractDiscreteModel:
        """Return the body of a mesh in its modes.

        Raise `CaseError` where the mesh is too large or has too few modes.
        """
        n_dof = mesh.mass.shape[1]
        if n_dof > MAX_COORDINATES + len(mesh.motions):
            raise CaseError(
                f"a mesh of {n_dof} coordinates is too large for its modes. "
                f"Allowed: elements times order up to {MAX_COORDINATES // len(mesh.motions)}",
                remedy="Give fewer elements, or use finite_element.",
                path="solve.model.elements",
            )
        available = n_dof - mesh.rigid.shape[1]
        if self.modes is not None and self.modes > available:
            raise CaseError(
                f"{self.modes} modes given, but the mesh of {self.elements} elements has {available} elastic modes",
                remedy=f"Give modes: {available} or fewer, or more elements.",
                path="solve.model.modes",
            )
        span = self.basis.span(mesh, available if self.modes is None else self.modes, faces)
        if self.residual:
            modes = ReducedMesh(mesh, span.shapes, span.uncoupled)
            return ModalBody(mesh.body, gravity, self._completed(modes, mesh.body, faces), paper_rule)
        return reduced_body(gravity, mesh, span, paper_rule, faces)

    def _completed(self, modes: Completable, body: ElasticBody, faces: tuple[Face, ...]) -> Coordinates:
        """Return a body's modes with `residual`, the left-out modes' static shapes, at its contacts."""
        if not self.residual or not faces:
            return modes
        bends = isinstance(body, Beam) and body.theory == "euler_bernoulli"
        return WithResiduals(
            modes,
            tuple(dict.fromkeys(face.x for face in faces)),
            BENDING if bends else WAVES,
            self.residual_frequency or math.inf,
        )
