"""MacNeal's modes: eigenvectors with free contacts, and their residual flexibility as a spring without mass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.bases.base import AbstractBasis, Span
from impactlab.bases.shapes import eigenvectors
from impactlab.models.base import Face
from impactlab.models.mesh.base import AbstractMesh


@final
@dataclass(frozen=True)
class Macneal(AbstractBasis):
    """MacNeal's modes: eigenvectors with free contact faces, and residual flexibility without mass.

    The flexibility is that of the eigenvectors left out. Each face lies ahead of its coordinates by flexibility times
    force. ``modes`` counts elastic eigenvectors. Deviation: the flexibility between two faces of one rod is left out.

    References
    ----------
    MacNeal1971 (residual flexibility; the residual mass is not used).
    """

    citations = ("MacNeal1971",)
    reads_partners = False

    def span(self, mesh: AbstractMesh, modes: int, faces: tuple[Face, ...]) -> Span:
        return Span(eigenvectors(mesh, modes + mesh.rigid.shape[1]), uncoupled=True, residual=True)
