"""Eigenfunctions of a uniform beam, in closed form."""

from __future__ import annotations

from typing import final

from impactlab.errors import CaseError
from impactlab.scene import Beam, Profile
from impactlab.types import Array, Quantity


@final
class BeamModes:
    """The first modes of a uniform beam, mass-normalised, rigid motions first and not counted."""

    frequencies: Array

    def __init__(self, beam: Beam, modes: int) -> None:
        raise CaseError(
            f"{modes} analytic modes of '{beam.name}' are not known",
            remedy="Give 'elements' for the eigenvectors of a mesh.",
            path="solve.model",
        )

    def row(self, x: float, quantity: Quantity) -> Array:
        """Return the quantity at x [m] of each mode, shape (n_dof,)."""
        raise NotImplementedError

    def static(self, x: float, quantity: Quantity, face: float) -> float:
        """Return the exact static answer at x per unit force at ``face``."""
        raise NotImplementedError

    def project(self, profile: Profile) -> Array:
        """Return the modal coordinates of a deflection, shape (n_dof,)."""
        raise NotImplementedError

    def project_uniform(self) -> Array:
        """Return the momentum of each mode at unit modal velocity, shape (n_dof,)."""
        raise NotImplementedError

    def grid(self) -> Array:
        """Return places fine enough for the shortest mode, shape (n,) [m]."""
        raise NotImplementedError
