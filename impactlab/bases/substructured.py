"""Substructuring: Craig-Bampton modes of the pieces of a body, many where it is struck."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.bases.base import AbstractBasis, Span
from impactlab.bases.shapes import constraint_modes, fixed_modes, pieces, struck, too_few
from impactlab.errors import CaseError
from impactlab.models.base import Face
from impactlab.models.mesh.base import AbstractMesh
from impactlab.numerics.banded import multiply
from impactlab.types import Ints, option


@final
@dataclass(frozen=True)
class Substructured(AbstractBasis):
    """Wu and Haug's substructures: many modes in the pieces with contacts, few in the others.

    Each border of a piece and each contact face has a constraint mode; each piece has modes with its borders fixed:
    ``others`` where nothing strikes, and all other ``modes``, in equal shares, where a contact is, as far as
    those pieces have so many; the rest goes to the others.
    ``modes`` counts constraint modes and fixed-interface modes, less one for each rigid motion. A border of a beam has
    two constraint modes, its deflection and its rotation, and a contact face one.
    Deviations: straight rods and beams; the pieces are Craig and Bampton's, of equal numbers of elements, and the set
    of modes stays the same through the run (the source may add and drop pieces' modes as waves pass).

    References
    ----------
    WuHaug1990; CraigBampton1968.
    """

    citations = ("WuHaug1990", "CraigBampton1968")
    reads_partners = False
    static_exact = True
    finer = "more `others`, and as many more modes for each piece"
    examples = ({}, {"pieces": 3, "others": 0})

    pieces: int = option(4, at_least=2, at_most=1000, description="pieces the rod is cut into, of equal elements")
    others: int = option(1, at_least=0, at_most=1000, description="fixed-interface modes of a piece without contact")

    def span(self, mesh: AbstractMesh, modes: int, faces: tuple[Face, ...]) -> Span:
        at_contacts = struck(mesh, faces)
        kept = np.union1d(self._cuts(mesh), at_contacts)
        runs = pieces(mesh, kept)
        near = [touches(mesh, run, at_contacts) or not at_contacts.size for run in runs]
        sizes = [run.size for run in runs]
        coarse = [0 if refined else min(self.others, size) for refined, size in zip(near, sizes, strict=True)]
        rigid = mesh.rigid.shape[1]
        left = modes + rigid - kept.size - sum(coarse)
        if left < 0:
            what = f"{kept.size} constraint modes and {sum(coarse)} of the pieces without contact"
            raise too_few("substructured", modes, modes - left, what)
        fine = shared([size if refined else 0 for refined, size in zip(near, sizes, strict=True)], left)
        rest = [size - one - other for size, one, other in zip(sizes, coarse, fine, strict=True)]
        fine = [one + other for one, other in zip(fine, shared(rest, left - sum(fine)), strict=True)]
        counts = [one + other for one, other in zip(coarse, fine, strict=True)]
        modal = [fixed_modes(mesh, run, count) for run, count in zip(runs, counts, strict=True)]
        return Span(np.hstack((constraint_modes(mesh, kept), *modal)))

    def _cuts(self, mesh: AbstractMesh) -> Ints:
        """Return the coordinates at the cuts."""
        elements = len(mesh.lengths)
        if self.pieces > elements:
            raise CaseError(
                f"{self.pieces} pieces of a mesh of {elements} elements. Allowed: up to one piece for each element",
                remedy=f"Give pieces: {elements} or fewer, or more elements.",
                path="solve.model.basis.pieces",
            )
        places = mesh.grid()[:: mesh.order][np.arange(1, self.pieces) * elements // self.pieces]
        rows = [np.flatnonzero(mesh.row(float(x), motion)) for x in places for motion in mesh.motions]
        return np.unique(np.concatenate(rows))


def touches(mesh: AbstractMesh, run: Ints, at_contacts: Ints) -> bool:
    """Return whether a contact acts on a group of coordinates at once."""
    struck = np.zeros(mesh.mass.shape[1])
    struck[at_contacts] = 1.0
    bands = np.ones((len(mesh.stiffness), struck.size)) * (mesh.stiffness != 0.0)
    return bool(np.any(multiply(bands, struck)[run]))


def shared(rooms: list[int], total: int) -> list[int]:
    """Return equal shares of ``total`` up to the room of each, the first served first."""
    shares = [0] * len(rooms)
    while total and any(share < room for share, room in zip(shares, rooms, strict=True)):
        for number, room in enumerate(rooms):
            if total and shares[number] < room:
                shares[number] += 1
                total -= 1
    return shares
