"""Base class of bases: shapes in which a mesh may move, possibly coupled."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

import numpy as np

from impactlab.types import Array, Quantity

if TYPE_CHECKING:
    from impactlab.models.base import Face
    from impactlab.models.mesh.base import AbstractMesh
    from impactlab.scene.bodies import Profile


class Span(NamedTuple):
    """Linearly independent shapes of a mesh, as columns; those of a free rod span its rigid motion."""

    shapes: Array  # (n_mesh_dof, n)
    uncoupled: bool = False  # they are eigenvectors of the mesh, mass-normalised, rigid motion first
    residual: bool = False  # the static compliance of the modes left out acts at the contacts as a spring without mass
    closed: tuple[int, Array] | None = None  # number of a contact, and the shapes (n_mesh_dof, n) while it is closed


class Coordinates(Protocol):
    """Uncoupled, mass-normalised coordinates of a body, for `ModalBody`."""

    frequencies: Array  # (n_dof,) rad/s; exactly zero for rigid motions

    def row(self, x: float, quantity: Quantity) -> Array:
        """Return the quantity at x [m] of each coordinate, shape (n_dof,)."""

    def static(self, x: float, quantity: Quantity, face: float) -> float:
        """Return the static quantity at x per unit force on the whole body.

        The force acts to the right at ``face`` [m]. A body that moves freely is taken in the frame of its mean
        acceleration, without rigid motion.
        """

    def project(self, profile: Profile) -> Array:
        """Return the coordinates of a displacement profile, shape (n_dof,)."""

    def project_uniform(self) -> Array:
        """Return the momentum of each coordinate at unit velocity, shape (n_dof,)."""

    def grid(self) -> Array:
        """Return the places at which fields are given, shape (n,) [m]."""


class Completable(Coordinates, Protocol):
    """Coordinates that static shapes of those left out may complete (`impactlab.bases.residual`)."""

    def remainder(self, x: float, quantity: Quantity, face: float) -> float:
        """Return the part of `static` that the elastic coordinates do not hold."""
        elastic = self.frequencies > 0.0
        kept = self.row(x, quantity)[elastic] * self.row(face, "displacement")[elastic]
        return self.static(x, quantity, face) - float(np.sum(kept / self.frequencies[elastic] ** 2))


def quadrature(length: float, modes: int) -> tuple[Array, Array]:
    """Return places [m] and weights [m], (n,) each, of Gauss quadrature fine enough for ``modes``."""
    cells = 4 * modes + 64
    nodes, weights = np.polynomial.legendre.leggauss(8)
    h = length / cells
    x = (np.arange(cells)[:, None] * h + (nodes + 1.0) * h / 2.0).ravel()
    return x, np.tile(weights * h / 2.0, cells)


def even_grid(length: float, modes: int) -> Array:
    """Return even places fine enough for the shortest of some modes, shape (n,) [m]."""
    return np.linspace(0.0, length, max(200, 4 * modes) + 1)


class AbstractBasis(ABC):
    """A basis of the modal model: a frozen dataclass of options.

    To write one, supply `span`. The modal model solves the small eigenvalue problem of the mesh in these shapes, so
    that every basis gives unit mass and squared frequencies. ``modes`` counts the shapes beside the rigid motion of a
    rod that nothing holds, whatever they are: n = modes, plus 1 for such a rod.
    """

    citations: ClassVar[tuple[str, ...]] = ()
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({},)  # options that its contract suite tries, one by one
    static_exact: ClassVar[bool] = False  # a steady force at a contact of a held rod moves it as the whole mesh
    complete: ClassVar[bool] = True  # as many modes as the mesh has are the mesh itself
    gains_energy: ClassVar[float] = 0.0  # declared bound on the gain that a change of coordinates may add, relative
    finer: ClassVar[str] = "more modes"  # a setting that brings the modes nearer to those of the mesh, in messages
    free_end: ClassVar[bool] = False  # eigenvectors with free contacts alone: a uniform rod's are known in closed form
    reads_partners: ClassVar[bool] = True  # False: `span` does not depend on the masses that the body meets

    @abstractmethod
    def span(self, mesh: AbstractMesh, modes: int, faces: tuple[Face, ...]) -> Span:
        """Return the shapes: ``modes``, plus 1 for a rod without supports.

        ``modes`` fits the mesh. ``faces`` are the rod's contacts. Raise `CaseError` where the basis does not support
        them.
        """
