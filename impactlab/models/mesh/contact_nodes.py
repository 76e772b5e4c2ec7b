"""Nodes at contacts: segments cut at inner faces, so that elements end where forces act."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from impactlab.models.base import Deformed, Face
from impactlab.models.mesh.bar_elements import elements_per_segment, laid_out
from impactlab.scene.bodies import Beam, Segment
from impactlab.scene.facts import cut_at

NODE_TOL = 1e-9  # of the shortest element: a contact so near to a node is on it
MIN_PIECE = 0.1  # of the shortest element: pieces are no shorter, as time steps follow from the shortest element
# The same where nothing shears: explicit steps follow from the square of the shortest element, and deflections are
# right without a node, so that the mesh pays at most a quarter of the step for the moment and the shear force.
MIN_SLENDER_PIECE = 0.5
MAX_STRETCH = 2.0  # of a beam that does not shear: time of a wave through an element, over that in a mesh without nodes


def with_nodes_at(body: Deformed, faces: Sequence[Face], elements: int) -> Deformed:
    """Return a body with segments cut at contacts inside its elements.

    It is the body itself where no contact lies inside one. A force kinks the displacement of a bar, and the deflection
    of a beam that shears. Inside an element there is no kink: its place then moves by F s (1 - s) h/(E A) too little,
    or h/(k G A), s from 0 to 1 along the element of length h. Of a beam that does not shear the moment has the kink and
    the shear force a jump of F, which an element does not have. The elements are shared among the pieces as among
    segments.

    A contact nearer than a tenth of an element, or half of one where nothing shears, to an end, to a segment's end or
    to another contact gets no node of its own. Elements of a beam that does not shear stay as they are where contacts
    stand so close together that nodes at them would take the elements away from the rest of it.
    """
    inner = sorted({face.x for face in faces if body.is_inner(face.x)})
    if not inner:
        return body
    row = laid_out(body.segments, elements)
    inside = [x for x in inner if float(np.abs(row.borders - x).min()) > NODE_TOL * row.shortest]
    if not inside:
        return body
    slender = isinstance(body, Beam) and body.theory == "euler_bernoulli"
    shortest = (MIN_SLENDER_PIECE if slender else MIN_PIECE) * row.shortest
    fixed = [0.0, *np.cumsum([segment.length for segment in body.segments])]
    places: list[float] = []
    for x in inner:
        if min(abs(x - each) for each in (*fixed, *places)) > shortest:
            places.append(x)
    if not {*places} & {*inside}:
        return body
    cut = tuple(cut_at(body.segments, places))
    if slender and _longest_transit(cut, elements) > MAX_STRETCH * _longest_transit(body.segments, elements):
        return body
    return replace(body, segments=cut)


def _longest_transit(segments: tuple[Segment, ...], elements: int) -> float:
    """Return the longest time [s] of a wave through an element; inf with too few elements."""
    counts = elements_per_segment(segments, elements)
    if sum(counts) > elements:
        return float("inf")
    return max(each.length / count / each.wave_speed for each, count in zip(segments, counts, strict=True))
