"""Static shapes of held rods and beams under a force at one place, per displacement there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from impactlab.models.mesh.beam_elements import matrices
from impactlab.scene.bodies import Beam, WaveBody
from impactlab.scene.bodies.pieces import Segment
from impactlab.scene.facts import cut_at


def sides_of(rod: WaveBody, x: float) -> tuple[list[Segment], list[Segment]]:
    """Return the pieces of a rod left and right of x [m], nearest first."""
    pieces: list[Segment] = list(cut_at(rod.segments, [x]))
    places = np.cumsum([0.0, *(piece.length for piece in pieces)])
    at = int(np.abs(places - x).argmin())
    return pieces[:at][::-1], pieces[at:]


def stretch(rod: WaveBody, x: float) -> float:
    """Return the largest strain per displacement by a static force at x [1/m].

    It is 0 for a rod that is not held.
    """
    found = 0.0
    for pieces, end in zip(sides_of(rod, x), (rod.left, rod.right), strict=True):
        held = end.kind == "clamped" or (end.kind == "spring" and end.value > 0.0)
        if held and pieces:
            soft = sum(piece.length / (piece.young * piece.area) for piece in pieces)
            soft += 1.0 / end.value if end.kind == "spring" else 0.0
            found = max(found, *(1.0 / (soft * piece.young * piece.area) for piece in pieces))
    return found


class Bow(NamedTuple):
    """The static shape of a beam under a force, per deflection at the force."""

    curvature: float  # 1/m2, the largest
    shortening: float  # 1/m, per deflection squared


def bow(beam: Beam, x: float) -> Bow:
    """Return the static bow under a force at x [m]; zero if the beam may move as a whole."""
    ends = beam.left, beam.right
    held = sum(end.kind in ("clamped", "pinned") or (end.kind == "spring" and end.value > 0.0) for end in ends)
    if held + any(end.kind == "clamped" or end.rotational > 0.0 for end in ends) < 2:
        return Bow(0.0, 0.0)
    pieces = list(cut_at(beam.segments, [x]))  # elements that are exact for loads at their nodes
    each = [matrices(piece, piece.length) for piece in pieces]
    size = 2 * len(pieces) + 2
    stiffness, slopes, fixed = np.zeros((size, size)), np.zeros((size, size)), list[int]()
    for first, element in zip(range(0, size, 2), each, strict=False):
        stiffness[first : first + 4, first : first + 4] += element.stiffness
        slopes[first : first + 4, first : first + 4] += element.tension
    for first, end in zip((0, size - 2), ends, strict=True):
        if end.kind == "spring":
            stiffness[[first, first + 1], [first, first + 1]] += end.value, end.rotational
        fixed += {"clamped": [first, first + 1], "pinned": [first]}.get(end.kind, [])
    places = np.cumsum([0.0, *(piece.length for piece in pieces)])
    struck = 2 * int(np.abs(places - x).argmin())
    if struck in fixed:
        return Bow(0.0, 0.0)
    force = np.zeros(size)
    force[struck] = 1.0
    for place in fixed:  # no displacement there
        stiffness[place, :] = stiffness[:, place] = 0.0
        stiffness[place, place] = 1.0
    moved = np.linalg.solve(stiffness, force)
    moved /= moved[struck]
    curvature = 0.0
    for number, (one, piece) in enumerate(zip(each, pieces, strict=True)):
        _, left, _, right = (one.stiffness @ moved[2 * number : 2 * number + 4]).tolist()  # forces and moments
        curvature = max(curvature, abs(left) / piece.bending_stiffness, abs(right) / piece.bending_stiffness)
    return Bow(curvature, 0.5 * float(moved @ slopes @ moved))
