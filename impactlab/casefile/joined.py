"""Links of a checked case, and contacts along a body.

A link is a contact whose law acts in both directions; a contact along a body has equal pieces.
"""

from __future__ import annotations

from impactlab.casefile.points import Face, name_in
from impactlab.casefile.schema import CaseBlock, ContactBlock
from impactlab.errors import CaseError, ImpactlabError
from impactlab.numerics.unions import Unions
from impactlab.plugins import LAWS, Registry
from impactlab.scene.problem import Point

BOND = "bonded"


def is_joined(block: ContactBlock, registry: Registry) -> bool:
    """Return whether the law of a contact makes it a link.

    False for a law that is not known, which is refused later.
    """
    try:
        return bool(block.law and registry.load(LAWS, block.law["kind"]).two_sided)
    except ImpactlabError:
        return False


def points_of(left: Face, right: Face, pieces: int) -> list[tuple[Point, Point]]:
    """Return the pairs of points of a contact.

    They are its faces, or the centres of equal pieces along one of its bodies.
    """
    span = left.span or right.span
    if span is None:
        return [(left.point, right.point)]
    start, end = span
    places = [start + (end - start) * (number + 0.5) / pieces for number in range(pieces)]
    return [(_at(left, x), _at(right, x)) for x in places]


def _at(face: Face, x: float) -> Point:
    name = face.point.body
    return face.point if face.span is None else Point(name, x, f"{name}.at({x:.6g})")


def check_bonds(case: CaseBlock) -> None:
    """Refuse bonds that close a ring."""
    groups = Unions[str]()
    for number, block in enumerate(case.contacts):
        if block.law is None or block.law["kind"] != BOND:
            continue
        path = f"contacts.{number}.between"
        one, other = (name_in(text) for text in block.between)
        if not groups.join(one, other):
            text = f"{one!r} and {other!r} move as one by the other bonds already, and this one closes a ring"
            raise CaseError(text, remedy="Remove one bond of the ring.", path=path)
