"""Stops on both sides of one place of a beam: they must leave room between them."""

from __future__ import annotations

from impactlab.casefile.beams import BeamBlock
from impactlab.casefile.points import read_face
from impactlab.casefile.schema import CaseBlock, WallBlock
from impactlab.errors import CaseError


def stops_leave_room(case: CaseBlock) -> None:
    """Raise `CaseError` where the stop below a place of a beam would lie above the stop on its other side."""
    below: dict[tuple[str, float], tuple[int, str, float]] = {}
    above: dict[tuple[str, float], tuple[int, str, float]] = {}
    for number, contact in enumerate(case.contacts):
        left, right = (
            read_face(case, label, f"contacts.{number}.between.{side}").point
            for side, label in enumerate(contact.between)
        )
        if isinstance(case.bodies[left.body], WallBlock) and isinstance(case.bodies[right.body], BeamBlock):
            below[right.body, right.x] = (number, left.body, contact.gap)
        if isinstance(case.bodies[right.body], WallBlock) and isinstance(case.bodies[left.body], BeamBlock):
            above[left.body, left.x] = (number, right.body, contact.gap)
    for place in below.keys() & above.keys():
        (first, lower, gap), (second, upper, other) = below[place], above[place]
        if gap + other < 0.0:
            raise CaseError(
                f"the gaps cross: {gap:g} m to {lower!r} below and {other:g} m to {upper!r} above leave "
                f"{gap + other:g} m for {place[0]!r} at {place[1]:g} m between them. Allowed: 0 or more in sum",
                remedy="Give larger gaps, or swap the two stops.",
                path=f"contacts.{max(first, second)}.gap",
            )
