"""Rotating bodies: their steady states, and the positions of masses.

Masses stand in a steady state by the faces that they meet.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING

from impactlab.casefile.blocks.rotation import RotationBlock
from impactlab.casefile.blocks.shared import ElasticBlock
from impactlab.casefile.schema import CaseBlock
from impactlab.errors import CaseError
from impactlab.scene.bodies import Beam, Body, Mass, Rotation
from impactlab.scene.bodies.rotation import Plane
from impactlab.scene.problem import Contact
from impactlab.startup.lazy import lazy

if TYPE_CHECKING:
    from impactlab.models.mesh import beams as meshes
else:  # matrices, which no other check needs
    meshes = lazy("impactlab.models.mesh.beams")

PLACE_TOL = 1e-6  # of a distance from the axis or a length: places nearer than this agree
ELEMENTS = 40  # of the mesh on which a beam's steady state is examined


def turning(case: CaseBlock, bodies: Mapping[str, Body], contacts: tuple[Contact, ...]) -> Mapping[str, Body]:
    """Return the bodies with the rotations of masses.

    These follow from their contacts; the bodies are the same where none turns.

    Raises
    ------
    CaseError
        Where a body has no steady state, bodies that meet turn or move otherwise than one another, or gravity acts in
        the plane of rotation.
    """
    blocks: dict[str, RotationBlock] = {}
    for name, block in case.bodies.items():
        given = getattr(block, "rotation", None)
        if isinstance(given, RotationBlock):
            blocks[name] = given
    if not blocks:
        return bodies
    for name in blocks:
        _check_steady(bodies[name], case.bodies[name])
    rates = _rates(bodies, contacts, blocks)
    _check_rates(bodies, contacts, rates)
    found = _with_masses(bodies, contacts, blocks, rates)
    for number, contact in enumerate(contacts):
        _check_contact(found, contact, number)
    for name, body in found.items():
        if case.gravity and body.softening:
            raise CaseError(
                f"gravity acts along the motion of '{name}', which lies in the plane of rotation: its direction would "
                "change with the angle",
                remedy="Leave gravity out, or let the beam bend across the plane of rotation (plane: flap)."
                if any(isinstance(each, Beam) for each in found.values())
                else "Leave gravity out.",
                path="gravity",
            )
    return found


def _check_steady(body: Body, block: object) -> None:
    """Raise `CaseError` where a body that turns has no steady state."""
    rotation, elastic, path = body.rotation, body.elastic, f"bodies.{body.name}"
    if rotation is None or elastic is None or not isinstance(block, ElasticBlock):
        return
    if "infinite" in (block.ends.left.kind, block.ends.right.kind):
        raise CaseError(
            f"'{body.name}' turns and has an infinite end, where the centrifugal force has no bound",
            remedy="Give the end another support.",
            path=f"{path}.ends",
        )
    if not elastic.is_held_along:
        raise CaseError(
            f"'{body.name}' turns, and nothing holds it along its axis, so that it has no steady state. "
            "Only masses may be free",
            remedy=f"Let one of its ends be {'clamped or pinned' if body.bends else 'clamped or on a spring'}.",
            path=f"{path}.ends",
        )
    if abs(rotation.rate) >= (limit := elastic.limit_rate):
        raise CaseError(
            f"'{body.name}' turns at {abs(rotation.rate):.6g} rad/s. Allowed: below {limit:.6g} "
            "rad/s, from which on it has no steady state: the centrifugal force then grows faster "
            "with the stretch than the elastic force",
            remedy="Give a lower rate.",
            path=f"{path}.rotation.rate",
        )
    if isinstance(elastic, Beam):
        meshes.BeamMesh(elastic, ELEMENTS, "consistent", 0.0)  # raises where the stiffness is not positive


def _rates(
    bodies: Mapping[str, Body], contacts: tuple[Contact, ...], blocks: Mapping[str, RotationBlock]
) -> dict[str, float]:
    """Return the rates of the bodies with a rotation [rad/s].

    A mass without one takes that of a body that it meets.
    """
    rates = {name: block.rate for name, block in blocks.items() if block.rate is not None}
    waiting = [name for name in blocks if name not in rates]
    pairs = [(contact.left.body, contact.right.body) for contact in contacts]
    pairs = [pair for pair in pairs if all(bodies[name].moves for name in pair)]
    while waiting:
        met = {
            own: rates.get(other, 0.0)
            for pair in pairs
            for own, other in (pair, pair[::-1])
            if own in waiting and other not in waiting
        }
        if not met:
            raise CaseError(
                f"this key is missing: '{waiting[0]}' meets no body whose rate is known",
                remedy="Give the rate in rad/s, or as a string such as '600 rpm'.",
                path=f"bodies.{waiting[0]}.rotation.rate",
            )
        rates |= met
        waiting = [name for name in waiting if name not in rates]
    return rates


def _check_rates(bodies: Mapping[str, Body], contacts: tuple[Contact, ...], rates: Mapping[str, float]) -> None:
    """Raise `CaseError` where bodies, except walls, that meet turn at different rates [rad/s]."""
    for number, contact in enumerate(contacts):
        names = contact.left.body, contact.right.body
        left, right = (rates.get(name, 0.0) for name in names)
        if left != right and all(bodies[name].moves for name in names):
            raise CaseError(
                f"'{names[0]}' at {left:.6g} rad/s and '{names[1]}' at {right:.6g} rad/s meet and turn at different "
                "rates. Allowed: one rate for all bodies that meet",
                remedy="Give both the same rotation.rate.",
                path=f"contacts.{number}.between",
            )


def _with_masses(
    bodies: Mapping[str, Body],
    contacts: tuple[Contact, ...],
    blocks: Mapping[str, RotationBlock],
    rates: Mapping[str, float],
) -> dict[str, Body]:
    """Return the bodies with the rotations of masses.

    First come those that state their place, then others from face to face.
    """
    found = dict(bodies)
    waiting = {name: block for name, block in blocks.items() if isinstance(bodies[name], Mass) and rates[name]}
    while waiting:
        placed = [name for name in waiting if _met(name, found, contacts) is not None]
        stated = [name for name, block in waiting.items() if block.axis_at is not None or block.plane == "flap"]
        name = next(iter([*placed, *stated]), "")
        if not name:
            name = next(iter(waiting))
            raise CaseError(
                f"this key is missing: '{name}' meets no body whose distance from the axis is known",
                remedy="Give the place of the axis in its own x [m]: -0.3 for a mass 0.3 m from it towards +x.",
                path=f"bodies.{name}.rotation.axis_at",
            )
        block = waiting.pop(name)
        axis, plane = _met(name, found, contacts) or (0.0, "axial")
        axis, plane = axis if block.axis_at is None else block.axis_at, block.plane or plane
        found[name] = dataclasses.replace(found[name], rotation=Rotation(rates[name], axis, plane))
    return found


def _met(name: str, bodies: Mapping[str, Body], contacts: tuple[Contact, ...]) -> tuple[float, Plane] | None:
    """Return ``axis_at`` [m] and the plane of a mass by its contacts.

    They follow from the first face that it meets whose place is known.
    """
    for contact in contacts:
        for own, other, sign in ((contact.left, contact.right, -1.0), (contact.right, contact.left, 1.0)):
            rotation = bodies[other.body].rotation
            if own.body == name and rotation is not None:
                return -(bodies[other.body].steady_place(other.x) + sign * contact.gap), rotation.plane
    return None


def _check_contact(bodies: Mapping[str, Body], contact: Contact, number: int) -> None:
    """Raise `CaseError` where bodies that meet do not turn alike.

    They move in different directions, or a mass does not stand at its gap.
    """
    left, right = (bodies[point.body] for point in contact.faces)
    if left.rotation is None or right.rotation is None:
        return
    if bool(left.softening) != bool(right.softening):
        inside, across = (left, right) if left.softening else (right, left)
        raise CaseError(
            f"'{inside.name}' moves in the plane of rotation, and '{across.name}' across it",
            remedy="Give both the same plane: chord or flap. Rods move in the plane of rotation.",
            path=f"contacts.{number}.between",
        )
    if not left.softening or not (isinstance(left, Mass) or isinstance(right, Mass)):
        return
    places = left.steady_place(contact.left.x), right.steady_place(contact.right.x)
    mass, other, stands, expected = (
        (right, left, places[1], places[0] + contact.gap)
        if isinstance(right, Mass)
        else (left, right, places[0], places[1] - contact.gap)
    )
    if abs(stands - expected) > PLACE_TOL * max(abs(expected), abs(contact.gap), other.length):
        raise CaseError(
            f"'{mass.name}' is at {stands:.9g} m from the axis by its axis_at, but by the face of '{other.name}' in "
            f"its steady state and the gap of {contact.gap:.6g} m it is at {expected:.9g} m",
            remedy=f"Leave axis_at out, or give {-expected:.9g}.",
            path=f"bodies.{mass.name}.rotation.axis_at",
        )
