"""Contacts of a checked case: faces, lever arms, and their rules."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from impactlab.casefile.blocks.beams import BeamBlock
from impactlab.casefile.blocks.shafts import ShaftBlock
from impactlab.casefile.blocks.shared import ElasticBlock
from impactlab.casefile.mechanisms import direction, directions, links_of
from impactlab.casefile.points import Face, name_in, read_face
from impactlab.casefile.schema import CaseBlock, ContactBlock, WallBlock
from impactlab.errors import CaseError
from impactlab.scene.bodies import Mark
from impactlab.scene.problem import Point
from impactlab.startup.cached import cached_property

SAME_DIRECTION = 1e-9  # between two directions of length 1
SAMPLES = 65  # of the displacement of a body at t = 0, for its size


class Faces(NamedTuple):
    """The two faces of a contact."""

    left: Face
    right: Face

    @property
    def names(self) -> tuple[str, str]:
        """Names of the two bodies."""
        return self.left.body, self.right.body


class AllContacts:
    """All contacts of a case, with look-up tables."""

    def __init__(self) -> None:
        self.contacts: list[CaseContact] = []

    @cached_property
    def first(self) -> dict[frozenset[str], int]:
        """The first contact between two faces, by names with six-digit places."""
        found: dict[frozenset[str], int] = {}
        for contact in self.contacts:
            found.setdefault(_labels(contact), contact.number)
        return found

    @cached_property
    def stops(self) -> dict[tuple[int, str, float], list[CaseContact]]:
        """Contacts of walls with a face, by contact side, body and x [m]."""
        found: dict[tuple[int, str, float], list[CaseContact]] = {}
        for contact in self.contacts:
            for place in (0, 1):
                if isinstance(contact.bodies[1 - place], WallBlock):
                    face = contact.faces[place].point
                    found.setdefault((place, face.body, face.x), []).append(contact)
        return found

    @cached_property
    def has_ring(self) -> bool:
        """Whether the order of the bodies closes a ring (topological sorting)."""
        right_of: dict[str, list[str]] = {}
        on_left: dict[str, int] = {}
        for contact in filter(_orders, self.contacts):
            left, right = contact.faces.names
            right_of.setdefault(left, []).append(right)
            on_left[right] = on_left.get(right, 0) + 1
        waiting = [name for name in right_of if name not in on_left]
        while waiting:
            for name in right_of.pop(waiting.pop(), ()):
                on_left[name] -= 1
                if not on_left[name]:
                    del on_left[name]
                    waiting.append(name)
        return bool(on_left)


class CaseContact(NamedTuple):
    """A contact of a case with its faces and bodies, as the rules see it."""

    case: CaseBlock
    number: int
    faces: Faces
    bodies: tuple[Any, Any]  # their blocks: of a body, or of a mechanism
    all_contacts: AllContacts
    joined: bool  # whether it is a link

    @property
    def block(self) -> ContactBlock:
        """Block of the contact in the case file."""
        return self.case.contacts[self.number]

    def refused(self, text: str, remedy: str, key: str = "between") -> CaseError:
        """Return the error of a key of this contact."""
        return CaseError(text, remedy=remedy, path=f"contacts.{self.number}.{key}")


def faces_of(case: CaseBlock, number: int) -> Faces:
    """Return the faces of a contact of the case."""
    left, right = case.contacts[number].between
    path = f"contacts.{number}.between"
    found = Faces(read_face(case, left, f"{path}.0"), read_face(case, right, f"{path}.1"))
    return Faces(*(_on_link(case, number, place, face) for place, face in enumerate(found)))


def _on_link(case: CaseBlock, number: int, place: int, face: Face) -> Face:
    """Return a face of a link as a numbered place of its mechanism."""
    links = links_of(case)
    link = links.get(face.body)
    if link is None:
        return face
    texts = [text for block in case.contacts for text in block.between]
    before = texts[: 2 * number + place]
    count = sum(getattr(links.get(name_in(text)), "mechanism", None) == link.mechanism for text in before)
    return face._replace(point=Point(link.mechanism, float(count), face.point.label))


def marks_of(case: CaseBlock, mechanism: str) -> tuple[Mark, ...]:
    """Return the faces of a mechanism in the order of the contacts."""
    links, found = links_of(case), []
    for number, block in enumerate(case.contacts):
        for place, text in enumerate(block.between):
            face = read_face(case, text, f"contacts.{number}.between.{place}")
            link = links.get(face.body)
            if link is not None and link.mechanism == mechanism:
                found.append(Mark(link.number, face.point.x, direction(block.along), face.point.label))
    return tuple(found)


def mechanisms_have_a_direction(contact: CaseContact) -> None:
    """Refuse a contact on a mechanism without a direction, and a direction where nothing turns."""
    linked = any(name in links_of(contact.case) for name in contact.faces.names)
    if linked and contact.block.along is None:
        raise contact.refused(
            "this key is missing: the contact lies on a mechanism",
            "Give along: x, y or [cos, sin], the direction in which the faces meet.",
            "along",
        )
    if not linked and contact.block.along is not None:
        raise contact.refused(
            "a contact has a direction on chains of links only, and no link meets here", "Remove along.", "along"
        )


def links_meet_others(contact: CaseContact) -> None:
    """Raise `CaseError` where links of one mechanism meet, or directions conflict."""
    links = links_of(contact.case)
    own = [links[name].mechanism for name in contact.faces.names if name in links]
    if len(own) == 2 and own[0] == own[1]:
        raise contact.refused(
            f"both are links of the mechanism {own[0]!r}, which cannot strike itself", "Let a link meet another body."
        )
    for name, block in zip(contact.faces.names, contact.bodies, strict=True):
        if not own or name in links or isinstance(block, WallBlock) or contact.block.along is None:
            continue
        if getattr(block, "rotation", None) is not None:
            text = f"{name!r} has a steady rotation, and a mechanism is computed in a frame at rest"
            raise contact.refused(text, "Remove its rotation.")
        first, here = directions(contact.case)[name], direction(contact.block.along)
        if math.hypot(first[0] - here[0], first[1] - here[1]) > SAME_DIRECTION:
            raise contact.refused(
                f"{name!r} moves along one line, which is [{first[0]:.6g}, {first[1]:.6g}] by its first "
                f"contact with a mechanism and [{here[0]:.6g}, {here[1]:.6g}] by this one",
                "Give all its contacts one direction, or add another body.",
                "along",
            )


def contact_of(case: CaseBlock, number: int, all_contacts: AllContacts, joined: bool) -> CaseContact:
    """Return a contact with its faces and bodies; raise `CaseError` on a wrong name."""
    faces = faces_of(case, number)
    left, right = (case.bodies.get(name) or case.mechanisms[name] for name in faces.names)
    return CaseContact(case, number, faces, (left, right), all_contacts, joined)


def lever_arm_of(case: CaseBlock, name: str) -> float:
    """Return the lever arm [m] of a shaft's contacts; 1 m without one."""
    given = ((number, block.lever_arm) for number, block in enumerate(case.contacts) if block.lever_arm is not None)
    return next((arm for number, arm in given if name in faces_of(case, number).names), 1.0)


def joins_two_bodies(contact: CaseContact) -> None:
    """Refuse a body in contact with itself, two walls, and a pair named twice."""
    left, right = contact.faces.names
    if left == right:
        raise contact.refused(f"the body {left!r} cannot be in contact with itself", "Name two different bodies.")
    if all(isinstance(body, WallBlock) for body in contact.bodies):
        text = f"{left!r} and {right!r} are walls and never move"
        raise contact.refused(text, "A contact needs a body that moves: a rod, a beam, a shaft or a mass.")
    first = contact.all_contacts.first[_labels(contact)]
    if first < contact.number:
        labels = " and ".join(face.point.label for face in contact.faces)
        remedy = "Remove one of the two contacts; for play on both sides of a joint give one contact the law slack."
        raise contact.refused(f"{labels} already meet in contacts.{first}", remedy)


def _labels(contact: CaseContact) -> frozenset[str]:
    """Return the names of both faces, which name the channels of the contact."""
    return frozenset(face.point.label for face in contact.faces)


def faces_are_opposite(contact: CaseContact) -> None:
    """Refuse an end that points away from the other face."""
    for place, (face, body) in enumerate(zip(contact.faces, contact.bodies, strict=True)):
        at_side, facing = ("right", "left") if place else ("left", "right")
        if face.end == at_side and isinstance(body, ElasticBlock) and not body.both_sides:
            between = contact.block.between
            raise contact.refused(
                f"{face.point.label!r} faces away from {between[1 - place]!r}: in `between: [a, b]`, a is on the left "
                f"of b, so the {('first', 'second')[place]} must be a mass, a wall, or the {facing} end of a "
                f"{body.kind}",
                f"Swap the two, [{between[1]}, {between[0]}], or name {face.point.body}.{facing}.",
                f"between.{place}",
            )


def fixed_ends_have_no_contact(contact: CaseContact) -> None:
    """Refuse a contact at an end that never moves."""
    for place, (face, body) in enumerate(zip(contact.faces, contact.bodies, strict=True)):
        held = getattr(body.ends, face.end).kind if isinstance(body, ElasticBlock) and face.end else ""
        if held in ("clamped", "pinned"):
            raise contact.refused(
                f"the end {face.point.label!r} is {held} and never moves, so a contact there moves no {body.kind}",
                "Free that end, or put a wall in its place.",
                f"between.{place}",
            )


def shaft_has_a_lever_arm(contact: CaseContact) -> None:
    """Refuse a shaft's contact without lever arm, with another arm, or with no rigid partner."""
    names, arm = contact.faces.names, contact.block.lever_arm
    shafts = [name for name, body in zip(names, contact.bodies, strict=True) if isinstance(body, ShaftBlock)]
    if not shafts and arm is not None:
        text = f"lever_arm applies only to contacts of a shaft, and neither {names[0]!r} nor {names[1]!r} is a shaft"
        raise contact.refused(text, "Remove it.", "lever_arm")
    if not shafts:
        return
    shaft = shafts[0]
    other, body = next(each for each in zip(names, contact.bodies, strict=True) if each[0] != shaft)
    if isinstance(body, ElasticBlock):
        raise contact.refused(
            f"the {body.kind} {other!r} meets the shaft {shaft!r}, whose lever arm meets rigid bodies only. "
            "Allowed: a mass or a wall",
            "Put a mass between the two, with a contact to each.",
        )
    if arm is None:
        raise contact.refused(
            f"this key is missing: the contact turns the shaft {shaft!r} at a distance from its axis",
            "Give lever_arm in m, the distance of the contact from the axis of the shaft.",
            "lever_arm",
        )
    if arm != (first := lever_arm_of(contact.case, shaft)):
        raise contact.refused(
            f"the shaft {shaft!r} has a lever arm of {first:g} m at another contact, and {arm:g} m here. "
            "Allowed: one for all contacts of a shaft",
            "Give its contacts the same lever_arm r: a mass m at an arm a acts as a mass m (a/r)^2 at r.",
            "lever_arm",
        )


def stops_have_clearance(contact: CaseContact) -> None:
    """Refuse stops on both sides of a beam that leave no room between them."""
    for place in (0, 1):
        if not (isinstance(contact.bodies[place], BeamBlock) and isinstance(contact.bodies[1 - place], WallBlock)):
            continue
        beam, stop = contact.faces[place].point, contact.faces[1 - place].point.body
        for other in contact.all_contacts.stops.get((1 - place, beam.body, beam.x), []):
            room = other.block.gap + contact.block.gap
            if other.number < contact.number and room < 0.0:
                stops = [(other.block.gap, other.faces[place].point.body), (contact.block.gap, stop)]
                (below, lower), (above, upper) = stops if place == 0 else stops[::-1]
                raise contact.refused(
                    f"the gaps cross: {below:g} m to {lower!r} below and {above:g} m to {upper!r} above leave "
                    f"{room:g} m for {beam.body!r} at {beam.x:g} m between them. Allowed: 0 or more in sum",
                    "Give larger gaps, or swap the two stops.",
                    "gap",
                )


def gap_is_open(contact: CaseContact) -> None:
    """Refuse faces that overlap before the run, unless the contact allows it."""
    if contact.joined:
        return
    gap, moved = contact.block.gap, 0.0
    for face, body, sign in zip(contact.faces, contact.bodies, (-1.0, 1.0), strict=True):
        shape = body.profile if isinstance(body, ElasticBlock) else None
        if shape is not None:
            arm = contact.block.lever_arm or 1.0  # by which a twist moves the face
            shift = arm * float(shape(np.array([face.point.x]))[0])
            gap, moved = gap + sign * shift, max(moved, abs(shift))
    if gap >= -1e-9 * moved or contact.block.overlap is not None:
        return
    # A gap that closes a preload is typed in by hand: its last digits are rounding, as is the zero of a formula.
    if gap < -1e-9 * _largest_displacement(contact):
        shapes = "" if gap == contact.block.gap else " with the displacement at t = 0"
        text = f"the gap is {gap:g} m{shapes}: the faces overlap before the run. Allowed: 0 or more"
        raise contact.refused(text, "Give a gap of 0 or more, or `overlap: allowed` for this contact.", "gap")


def _largest_displacement(contact: CaseContact) -> float:
    """Return the largest displacement of a contact's bodies at t = 0 [m]."""
    found = 0.0
    for face, body in zip(contact.faces, contact.bodies, strict=True):
        shape = body.profile if isinstance(body, ElasticBlock) else None
        if shape is not None:
            places = np.append(np.linspace(0.0, body.total_length, SAMPLES), face.point.x)
            found = max(found, (contact.block.lever_arm or 1.0) * float(np.abs(shape(places)).max()))
    return found


def links_have_no_gap(contact: CaseContact) -> None:
    """Raise `CaseError` where a link, joined from the start, has a gap."""
    for key in ("gap", "overlap"):
        if contact.joined and getattr(contact.block, key):
            kind = contact.block.law["kind"] if contact.block.law else ""
            raise contact.refused(
                f"law {kind!r} joins its faces from t = 0, so there is no {key} between them",
                f"Remove {key}. For a joint with play use law slack; soil or a specimen separates with tension: false.",
                key,
            )


def pieces_lie_along_a_body(contact: CaseContact) -> None:
    """Raise `CaseError` unless pieces have exactly one face along a body."""
    along = [face for face in contact.faces if face.span is not None]
    if not along and contact.block.pieces is not None:
        raise contact.refused(
            "`pieces` divides a contact along a body, and neither face of this contact extends along a body",
            "Write between: [body.along(from, to), other], or remove pieces.",
            "pieces",
        )
    if along and contact.block.pieces is None:
        raise contact.refused(
            f"this key is missing: {along[0].point.label} is a range of places",
            "Give pieces: the number of equal pieces, each with a link at its centre.",
            "pieces",
        )
    if len(along) == 2:
        raise contact.refused("both faces lie along a body", "Let one of the two be a mass, a wall or one place.")


def order_is_possible(contact: CaseContact) -> None:
    """Refuse the contact that closes a ring.

    An example is a left of b, b left of a; walls may stand on both sides.
    """
    left, right = contact.faces.names
    if left == right or not contact.all_contacts.has_ring or not _orders(contact):
        return
    right_of: dict[str, set[str]] = {}
    for other in filter(_orders, (each for each in contact.all_contacts.contacts if each.number < contact.number)):
        right_of.setdefault(other.faces.names[0], set()).add(other.faces.names[1])
    seen, front = set[str](), {right}
    while front:
        seen |= front
        front = {after for name in front for after in right_of.get(name, ())} - seen
    if left in seen:
        text = f"this contact places {left!r} on the left of {right!r}, and the other contacts place it on the right"
        raise contact.refused(text, "In `between: [a, b]`, a is on the left of b: swap one pair.")


def _orders(contact: CaseContact) -> bool:
    """Return whether a contact fixes which of its bodies lies on the left.

    It does not with a wall, at an inner point, or on a mechanism.
    """
    links, mechanisms = links_of(contact.case), contact.case.mechanisms
    turns = any(name in links or name in mechanisms for name in contact.faces.names)
    inner = any("(" in face.point.label for face in contact.faces)  # rod.at(x)
    return not (turns or inner or any(isinstance(body, WallBlock) for body in contact.bodies))


def has_a_law(contact: CaseContact) -> None:
    """Refuse a contact without a law, unless a tolerance makes it a hard one."""
    if contact.block.law is None and contact.case.solve.tolerance is None:
        remedy = (
            "Name a law: law: {kind: addition_deletion} for hard contact, on continuous rods with a step "
            "{kind: wave_identification}. Or give solve.tolerance, with which a contact without a law is hard."
        )
        raise contact.refused("this key is missing", remedy, "law")


RULES_OF_CONTACTS = (
    mechanisms_have_a_direction,
    links_meet_others,
    joins_two_bodies,
    faces_are_opposite,
    fixed_ends_have_no_contact,
    shaft_has_a_lever_arm,
    stops_have_clearance,
    gap_is_open,
    links_have_no_gap,
    pieces_lie_along_a_body,
    order_is_possible,
    has_a_law,
)
