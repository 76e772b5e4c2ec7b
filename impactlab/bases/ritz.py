"""Load-dependent Ritz vectors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.bases.base import AbstractBasis, Span
from impactlab.bases.shapes import no_contact
from impactlab.errors import CaseError
from impactlab.models.base import Face
from impactlab.models.mesh.base import AbstractMesh
from impactlab.numerics.banded import multiply
from impactlab.types import Array

MIN_REST = 1e-10  # of its length: a smaller rest of a vector is rounding


@final
@dataclass(frozen=True)
class Ritz(AbstractBasis):
    """Load-dependent Ritz vectors: static displacements under the contact force, then under the inertia of those.

    x_1 = K^-1 f, x_(k+1) = K^-1 M x_k, each made M-orthogonal to all before, twice; several faces make a block. A rod
    that nothing holds takes its rigid motion first, and displacements in its moving frame (inertia relief).
    ``modes`` counts vectors beside that motion.

    References
    ----------
    WilsonYuanDickens1982; EscalonaMayoDominguez1999, Section 1 (on their use for impact by Lee and Yoon).
    """

    citations = ("WilsonYuanDickens1982", "EscalonaMayoDominguez1999")
    reads_partners = False
    static_exact = True

    def span(self, mesh: AbstractMesh, modes: int, faces: tuple[Face, ...]) -> Span:
        if not faces:
            raise no_contact("ritz")
        found: list[Array] = list(mesh.rigid.T)
        rigid = len(found)
        count = modes + rigid
        waiting = [mesh.static(mesh.row(x, "displacement")) for x in dict.fromkeys(face.x for face in faces)]
        while len(found) < count:
            if not waiting:
                raise CaseError(
                    f"the contacts of this rod give {len(found) - rigid} Ritz vectors; {modes} modes are given",
                    remedy=f"Give modes: {len(found) - rigid} or fewer.",
                    path="solve.model.modes",
                )
            vector = orthonormal(waiting.pop(0), found, mesh.mass)
            if vector is not None:
                found.append(vector)
                waiting.append(mesh.static(multiply(mesh.mass, vector)))
        return Span(np.array(found).T)


def orthonormal(vector: Array, found: list[Array], mass: Array) -> Array | None:
    """Return the M-orthogonal part of a vector, of unit mass; None where nothing is left."""
    begun = float(np.sqrt(vector @ multiply(mass, vector)))
    rest = vector / begun
    for _ in range(2):
        for other in found:
            rest = rest - other * (other @ multiply(mass, rest))
    length = float(np.sqrt(rest @ multiply(mass, rest)))
    return rest / length if length > MIN_REST else None
