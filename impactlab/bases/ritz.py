"""Vectors that the load itself calls for, one after the other."""

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

LOST = 1e-10  # of its length: what is left of a vector whose direction was already there


@final
@dataclass(frozen=True)
class Ritz(AbstractBasis):
    """Load-dependent Ritz vectors: the static answer to the contact force, then the static answers to its inertia.

    x_1 = K^-1 f, x_(k+1) = K^-1 M x_k, each made M-orthogonal to all before, twice; several faces make a block. A rod
    that nothing holds takes its rigid motion first, and static answers in its moving frame (inertia relief).
    ``modes`` counts vectors beside that motion.

    References
    ----------
    WilsonYuanDickens1982; EscalonaMayoDominguez1999, Section 1 (on their use for impact by Lee and Yoon).
    """

    citations = ("WilsonYuanDickens1982", "EscalonaMayoDominguez1999")
    static_exact = True

    def span(self, mesh: AbstractMesh, modes: int, faces: tuple[Face, ...]) -> Span:
        if not faces:
            raise no_contact("ritz")
        found: list[Array] = list(mesh.rigid.T)
        count = modes + len(found)
        waiting = [mesh.static(mesh.row(x, "displacement")) for x in dict.fromkeys(face.x for face in faces)]
        while len(found) < count:
            if not waiting:
                raise CaseError(
                    f"the contacts of this rod give {len(found)} Ritz vectors; {count} are needed",
                    remedy="Give fewer modes.",
                    path="solve.model.modes",
                )
            vector = orthonormal(waiting.pop(0), found, mesh.mass)
            if vector is not None:
                found.append(vector)
                waiting.append(mesh.static(multiply(mesh.mass, vector)))
        return Span(np.array(found).T)


def orthonormal(vector: Array, found: list[Array], mass: Array) -> Array | None:
    """Return the part of a vector that is M-orthogonal to those found, of unit mass; None where nothing is left."""
    begun = float(np.sqrt(vector @ multiply(mass, vector)))
    rest = vector / begun
    for _ in range(2):
        for other in found:
            rest = rest - other * (other @ multiply(mass, rest))
    length = float(np.sqrt(rest @ multiply(mass, rest)))
    return rest / length if length > LOST else None
