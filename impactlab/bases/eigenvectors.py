"""Eigenvectors of the rod with its contacts free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.bases.base import AbstractBasis, Span
from impactlab.bases.shapes import eigenvectors
from impactlab.models.base import Face
from impactlab.models.mesh.base import AbstractMesh


@final
@dataclass(frozen=True)
class Eigenvectors(AbstractBasis):
    """Eigenvectors of the rod with its contact faces free, of lowest frequency.

    Without ``elements`` they are those of the continuous rod, in closed form. ``modes`` counts elastic eigenvectors.

    References
    ----------
    EscalonaMayoDominguez1999, Section 5; Bathe1982, section 9.3.
    """

    citations = ("EscalonaMayoDominguez1999",)
    reads_partners = False
    free_end = True

    def span(self, mesh: AbstractMesh, modes: int, faces: tuple[Face, ...]) -> Span:
        return Span(eigenvectors(mesh, modes + mesh.rigid.shape[1]), uncoupled=True)
