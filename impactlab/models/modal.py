"""The modal model: a rod in the coordinates of its free-end eigenvectors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, final

import numpy as np

from impactlab.bases.analytic import AnalyticBasis
from impactlab.bases.eigenvectors import MeshBasis
from impactlab.errors import CaseError, PairingError
from impactlab.models.base import AbstractDiscreteModel, AbstractRodModel, Face, Operators
from impactlab.scene import Rod
from impactlab.types import Array, Quantity, option


@final
@dataclass(frozen=True)
class Modal(AbstractRodModel):
    """Eigenvectors of the rod with its contact faces free: of a mesh, or analytic without ``elements``.

    Rigid-body modes are kept and not counted in ``modes``.

    References
    ----------
    EscalonaMayoDominguez1999, Section 5.
    """

    citations = ("EscalonaMayoDominguez1999",)
    examples = ({"modes": 20}, {"elements": 60, "modes": 20}, {"elements": 60})

    elements: int | None = option(
        None, at_least=1, at_most=2000, description="elements of the mesh behind the modes; without it analytic modes"
    )
    modes: int | None = option(
        None, at_least=1, at_most=100_000, description="elastic modes kept; default all of the mesh"
    )
    mass: Literal["consistent", "lumped"] = option("consistent", description="mass matrix of the mesh")

    @property
    def has_mesh(self) -> bool:
        return self.elements is not None

    def element_length(self, rod: Rod) -> float:
        return rod.length / (self.elements or self.modes or 1)

    def build(self, rod: Rod, gravity: float, faces: tuple[Face, ...] = ()) -> AbstractDiscreteModel:
        for end in (rod.left, rod.right):
            if end.kind == "dashpot":
                raise PairingError(
                    f"model 'modal' cannot hold the dashpot at an end of '{rod.name}': it has no undamped modes",
                    remedy="Use finite_element or continuous for this body.",
                    path="solve.model",
                )
        if self.elements is not None:
            return ModalBody(rod, gravity, MeshBasis(rod, self.elements, self.modes, self.mass))
        if self.modes is None:
            raise CaseError(
                "modal needs 'modes' (analytic) or 'elements'",
                remedy="Give modes: 40, for example.",
                path="solve.model",
            )
        return ModalBody(rod, gravity, AnalyticBasis(rod, self.modes))


@final
class ModalBody(AbstractDiscreteModel):
    """A rod in mass-normalised modal coordinates: unit mass, squared frequencies as stiffness."""

    def __init__(self, rod: Rod, gravity: float, basis: MeshBasis | AnalyticBasis) -> None:
        self._rod = rod
        self._gravity = gravity
        self._basis = basis

    def operators(self) -> Operators:
        basis, rod = self._basis, self._rod
        n_dof = basis.frequencies.size
        elastic = int(np.count_nonzero(basis.frequencies))
        uniform = len(rod.segments) == 1
        highest = float(basis.frequencies.max(initial=0.0))
        # The paper's rule (Eq. 24) counts the continuous rod's period whatever the mesh.
        rule = (2 * elastic + 1) * np.pi * rod.segments[0].wave_speed / (2.0 * rod.length) if uniform else highest
        rigid = basis.project_uniform()
        return Operators(
            mass=np.ones((1, n_dof)),
            damping=np.zeros((1, n_dof)),
            stiffness=basis.frequencies[None, :] ** 2,
            load=rigid * self._gravity,
            displacement=np.zeros(n_dof) if rod.displacement is None else basis.project(rod.displacement),
            velocity=rigid * rod.velocity,
            highest_frequency=highest,
            rule_frequency=float(rule),
            diagonal_mass=True,
            modes=True,
        )

    def row(self, x: float, quantity: Quantity) -> Array:
        return self._basis.row(x, quantity)

    def left_out(self, x: float, quantity: Quantity, face: float) -> float:
        """Return static answer minus that of the elastic modes kept (mode acceleration)."""
        elastic = self._basis.frequencies > 0.0
        kept = self._basis.row(x, quantity)[elastic] * self._basis.row(face, "displacement")[elastic]
        return self._basis.static(x, quantity, face) - float(np.sum(kept / self._basis.frequencies[elastic] ** 2))

    def momentum_row(self) -> Array:
        return self._basis.project_uniform()

    def grid(self) -> Array:
        return self._basis.grid()
