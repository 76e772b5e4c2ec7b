"""Craig-Bampton modes: constraint modes of the contacts, fixed-interface modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.bases.base import AbstractBasis, Span
from impactlab.bases.shapes import constraint_modes, fixed_modes, still_free, struck, too_few
from impactlab.models.base import Face
from impactlab.models.mesh.base import AbstractMesh
from impactlab.types import Array, Ints


@final
@dataclass(frozen=True)
class CraigBampton(AbstractBasis):
    """Craig-Bampton modes: static shapes of the contact faces, and modes with these faces fixed.

    A static shape moves one contact face by 1. One constraint mode per face (per coordinate of the element, for a face
    inside one) and the fixed-interface modes of lowest frequency. The constraint modes of a free rod hold its rigid
    motion; a free beam struck at one place still turns about it, which is the first of its fixed-interface modes.
    ``modes`` counts both kinds, less one for each rigid motion: N coordinates of a held rod struck at one face are 1
    constraint mode and N - 1 others. Without a contact nothing is fixed, and these are the eigenvectors.

    References
    ----------
    CraigBampton1968.
    """

    citations = ("CraigBampton1968",)
    reads_partners = False
    static_exact = True

    def span(self, mesh: AbstractMesh, modes: int, faces: tuple[Face, ...]) -> Span:
        rigid = mesh.rigid.shape[1]
        kept = struck(mesh, faces)
        loose = still_free(mesh, kept).shape[1]
        if modes + rigid < kept.size + loose:
            raise too_few("craig_bampton", modes, kept.size + loose - rigid, f"{kept.size} constraint modes")
        count = modes + rigid - kept.size
        return Span(np.hstack((constraint_modes(mesh, kept), fixed(mesh, kept, count))))


def fixed(mesh: AbstractMesh, kept: Ints, count: int) -> Array:
    """Return the first eigenvectors (n_mesh_dof, count) of the mesh with some coordinates fixed."""
    shapes = fixed_modes(mesh, np.setdiff1d(np.arange(mesh.mass.shape[1]), kept), count)
    if count:
        loose = still_free(mesh, kept)
        shapes[:, : loose.shape[1]] = loose
    return shapes
