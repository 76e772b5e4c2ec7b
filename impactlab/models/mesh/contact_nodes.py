"""Nodes at contacts: segments cut at inner faces, so that elements end where forces act."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from impactlab.models.base import Deformed, Face
from impactlab.models.mesh.bar_elements import laid_out
from impactlab.scene.bodies import Beam
from impactlab.scene.facts import cut_at

NODE_TOL = 1e-9  # of the shortest element: a contact so near to a node is on it
MIN_PIECE = 0.1  # of the shortest element: pieces are no shorter, as time steps follow from the shortest element


def with_nodes_at(body: Deformed, faces: Sequence[Face], elements: int) -> Deformed:
    """Return a body with segments cut at the contacts that lie inside its elements; itself where none does.

    A force kinks the displacement of a bar, and the deflection of a beam that shears. Inside an element there is no
    kink: its place then moves by F s (1 - s) h/(E A) too little, or h/(k G A), s from 0 to 1 along the element of
    length h. The elements are shared among the pieces as among segments. A contact nearer than a tenth of an element
    to an end, to a segment's end or to another contact gets no node of its own. A beam without shear has no kink.
    """
    inner = sorted({face.x for face in faces if body.is_inner(face.x)})
    if not inner or (isinstance(body, Beam) and body.theory == "euler_bernoulli"):
        return body
    row = laid_out(body.segments, elements)
    inside = [x for x in inner if float(np.abs(row.borders - x).min()) > NODE_TOL * row.shortest]
    if not inside:
        return body
    fixed = [0.0, *np.cumsum([segment.length for segment in body.segments])]
    places: list[float] = []
    for x in inner:
        if min(abs(x - each) for each in (*fixed, *places)) > MIN_PIECE * row.shortest:
            places.append(x)
    return replace(body, segments=tuple(cut_at(body.segments, places))) if {*places} & {*inside} else body
