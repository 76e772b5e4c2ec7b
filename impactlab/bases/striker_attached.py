"""Eigenvectors with the striker's mass on the face, while they are in contact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.bases.base import AbstractBasis, Span
from impactlab.bases.shapes import eigenvectors, lowest, no_contact
from impactlab.errors import CaseError
from impactlab.models.base import Face
from impactlab.models.mesh.base import AbstractMesh
from impactlab.numerics.banded import full


@final
@dataclass(frozen=True)
class StrikerAttached(AbstractBasis):
    """Eigenvectors with the striker's mass on the face while the contact is closed, without it while open.

    While closed they are the eigenvectors with this mass on the face, else those with a free end. There are equally
    many in both phases. The striker stays a body of its own that the contact law ties to the face; its mass shapes the
    basis only. At a change of phase the motion is projected orthogonally, velocities in the mass and displacements in
    the stiffness, so that the part dropped has positive energy. ``modes`` counts elastic eigenvectors. One contact,
    with a mass.

    References
    ----------
    KhuliefShabana1986 (coordinates that change with the kinematic structure); EscalonaMayoDominguez1999, Section 1.
    """

    citations = ("KhuliefShabana1986",)
    # A change of coordinates moves the face, and with it the energy of a contact: 0.001 was measured with springs, 0.1
    # with a constraint, 0.45 with laws that read the stress at the face (docs/matrix.md).
    gains_energy = 0.6

    def span(self, mesh: AbstractMesh, modes: int, faces: tuple[Face, ...]) -> Span:
        if not faces:
            raise no_contact("striker_attached")
        if len(faces) > 1:
            raise CaseError(
                f"basis 'striker_attached' supports only one contact of a rod, but this rod has {len(faces)}",
                remedy="Use basis craig_bampton or eigenvectors.",
                path="solve.model.basis",
            )
        face = faces[0]
        if not math.isfinite(face.partner_mass):
            partner = "a wall" if math.isinf(face.partner_mass) else "a rod"
            raise CaseError(
                f"basis 'striker_attached' puts the mass of the striker on the face, and this one meets {partner}",
                remedy="Use basis craig_bampton or eigenvectors.",
                path="solve.model.basis",
            )
        count = modes + mesh.rigid.shape[1]
        row = mesh.row(face.x, "displacement")
        mass = full(mesh.mass) + face.partner_mass * np.outer(row, row)
        attached = lowest(mass.copy(), full(mesh.stiffness), count)
        return Span(eigenvectors(mesh, count), uncoupled=True, closed=(face.contact, attached))
