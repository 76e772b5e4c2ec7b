"""A chain of links as a mechanism, and as the flat numbers that `terms` reads."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple, final

import numpy as np

from impactlab.errors import CaseError
from impactlab.mechanisms import layout as at
from impactlab.mechanisms.base import AbstractMechanism, Drive, Motion, Reading
from impactlab.mechanisms.integrals import Integrals, rigid_link
from impactlab.mechanisms.shapes import FlexibleLink, flexible_link
from impactlab.mechanisms.terms import terms
from impactlab.models.base import AbstractRodModel
from impactlab.models.modal import Modal
from impactlab.plugins import kind_of
from impactlab.scene.bodies import Link, Mechanism
from impactlab.types import Array, Quantity


@final
class Chain(AbstractMechanism):
    """A chain with its links in shapes.

    Its readings are the marks in their order, then the angle of each link, then the shortening of each flexible one.

    Parameters
    ----------
    mechanism : Mechanism
    models : mapping
        Descriptions of flexible links by name: modal with elements.

    Raises
    ------
    CaseError
        If the description of a link is not modal.
    """

    terms = staticmethod(terms)

    def __init__(self, mechanism: Mechanism, models: Mapping[str, AbstractRodModel]) -> None:
        self.mechanism = mechanism
        self.flexible = [shapes_of(link, models) for link in mechanism.links]

    @property
    def readings(self) -> tuple[Reading, ...]:
        marks = tuple(Reading(mark.label) for mark in self.mechanism.marks)
        links = self.mechanism.links
        bent = (Reading(f"shortening:{links[number].name}") for number in self.mechanism.bent)
        return (*marks, *(Reading(link.name, is_angle=True) for link in links), *bent)

    @property
    def mass(self) -> float:
        return self.mechanism.moving_mass

    def internal_row(self, gauge: int, quantity: Quantity) -> Array:
        number, x = self.mechanism.gauges[gauge]
        each = [integrals_of(link, shapes) for link, shapes in zip(self.mechanism.links, self.flexible, strict=True)]
        _, firsts, n = coordinates_of(self.mechanism, each)
        shapes, row = self.flexible[number], np.zeros(n)
        assert shapes is not None  # noqa: S101 - a case has probes on flexible links alone
        first = firsts[number] + each[number].a0.size
        row[first : first + each[number].b0.size] = shapes.meshes[0].row(x, quantity) @ shapes.shapes[0]
        return row

    def motion(self, gravity: tuple[float, float]) -> Motion:
        links = self.mechanism.links
        numbers = packed(self.mechanism, self.flexible)
        rates = [abs(link.rate) + abs(link.drive.rate if link.drive is not None else 0.0) for link in links]
        swing = math.sqrt(math.hypot(*gravity) / min(link.length for link in links))
        driven = ((number, links[number].drive) for number in self.mechanism.driven)
        return Motion(
            parameters=numbers.parameters,
            position=numbers.position,
            velocity=numbers.velocity,
            stiffness=numbers.stiffness,
            rate=max(rates) + swing,
            frequency=max([0.0, *(each.frequency for each in self.flexible if each is not None)]),
            drives=tuple(
                Drive(numbers.angles[number], each.rate, each.within) for number, each in driven if each is not None
            ),
        )


def shapes_of(link: Link, models: Mapping[str, AbstractRodModel]) -> FlexibleLink | None:
    """Return a link in shapes, or None for a rigid one.

    Raise `CaseError` where its model has no mesh and modes.
    """
    if link.beam is None:
        return None
    model = models.get(link.name)
    if not isinstance(model, Modal) or model.elements is None:
        raise CaseError(
            f"link '{link.name}' needs modes of a mesh",
            remedy="Give {kind: modal, elements: 160, modes: 20}, for example.",
            path=f"solve.models.{link.name}",
        )
    for name, given, served in (
        ("basis", kind_of(model.basis), "eigenvectors"),
        ("mass", model.mass, "consistent"),
        ("order", model.order, 1),
    ):
        if given != served:
            raise CaseError(
                f"link '{link.name}' needs modes that are eigenvectors of a consistent mesh of order 1, but "
                f"{name} {given} is given",
                remedy=f"Remove {name}.",
                path=f"solve.models.{link.name}.{name}",
            )
    return flexible_link(link, model.elements, model.modes or model.elements)


class PackedChain(NamedTuple):
    """A chain in numbers.

    Its coordinates are, link by link, the angle where it is free or driven, psi's, then phi's.
    """

    parameters: Array  # of `terms`
    stiffness: Array  # (n, n) N/m, of the shapes
    position: Array  # (n,) at t = 0
    velocity: Array  # (n,) at t = 0
    angles: tuple[int, ...]  # coordinate of the angle of each link; -1 where it follows from the others


def angle_kind(mechanism: Mechanism, number: int) -> int:
    """Return how the angle of a link is given: `OWN`, `FIXED` or `SLIDING`."""
    if mechanism.slide is not None and number == len(mechanism.links) - 1:
        return at.SLIDING
    clamped = mechanism.links[number].joint == "clamped" and number > 0
    return at.FIXED if clamped else at.OWN


def coordinates_of(mechanism: Mechanism, each: Sequence[Integrals]) -> tuple[list[int], list[int], int]:
    """Return the coordinate of each angle, -1 where it is none, that of each link's first shape, and their number."""
    angles, firsts, n = [], [], 0
    for number, own in enumerate(each):
        is_free = angle_kind(mechanism, number) == at.OWN
        angles.append(n if is_free else -1)
        n += is_free
        firsts.append(n)
        n += own.a0.size + own.b0.size
    return angles, firsts, n


def packed(mechanism: Mechanism, flexible: Sequence[FlexibleLink | None]) -> PackedChain:
    """Return a chain in numbers.

    Raise `CaseError` where its slide is out of reach at t = 0.
    """
    links = mechanism.links
    kinds = [angle_kind(mechanism, number) for number in range(len(links))]
    each = [integrals_of(link, shapes) for link, shapes in zip(links, flexible, strict=True)]
    angles, firsts, n = coordinates_of(mechanism, each)
    head, out, place = np.zeros(at.CHAIN), [], at.CHAIN
    stiffness, position, velocity = np.zeros((n, n)), np.zeros(n), np.zeros(n)
    room = 0
    before = 0.0
    for number, (link, own, kind) in enumerate(zip(links, each, kinds, strict=True)):
        na, nb, header = own.a0.size, own.b0.size, np.zeros(at.LINK)
        header[at.AXIAL], header[at.BENDING], header[at.FIRST] = na, nb, firsts[number]
        header[at.ANGLE], header[at.ANGLE_AT], header[at.LENGTH] = kind, angles[number], link.length
        header[at.END_MASS], header[at.TORQUE] = link.end_mass, link.torque
        header[at.MASS : at.LINK] = own.moments
        angle = link.angle
        if kind == at.SLIDING:
            angle = reached(mechanism)
            header[at.SLIDE], header[at.SIDE] = mechanism.slide or 0.0, math.cos(angle)
        header[at.TURN] = angle - before if kind == at.FIXED else 0.0
        before = angle
        if kind == at.OWN:
            position[angles[number]] = angle
            velocity[angles[number]] = link.rate if link.drive is None or link.drive.within else link.drive.rate
        numbers = np.concatenate([array.ravel() for array in own[1:]])
        place += header.size + numbers.size
        header[at.NEXT] = place
        out += [header, numbers]
        first, m = firsts[number], na + nb
        stiffness[first : first + na, first : first + na] = own.ka
        stiffness[first + na : first + m, first + na : first + m] = np.diag(own.kb)
        room = max(room, at.room_of(na, nb, n))
    head[at.READINGS_AT], head[at.LINKS_AT], head[at.LINKS] = place, at.CHAIN, len(links)
    head[at.COORDINATES], head[at.READINGS] = n, len(mechanism.marks) + len(links) + len(mechanism.bent)
    head[at.GRAVITY_X], head[at.GRAVITY_Y] = mechanism.gravity
    for mark in mechanism.marks:
        shapes = flexible[mark.link]
        out += [
            np.array([at.FACE, mark.link, *mark.along, mark.x]),
            np.zeros(0) if shapes is None else shapes.place(mark.x),
        ]
    out += [np.array([at.TURNED, number, 0.0, 0.0, 0.0]) for number in range(len(links))]
    out += [np.array([at.SHORTENED, number, 0.0, 0.0, 0.0]) for number in mechanism.bent]
    head[at.ROOM_AT] = at.CHAIN + sum(array.size for array in out)
    parameters = np.concatenate([head, *out, np.zeros(len(links) * at.size_of(n) + room)])
    return PackedChain(parameters, stiffness, position, velocity, tuple(angles))


def integrals_of(link: Link, shapes: FlexibleLink | None) -> Integrals:
    """Return the integrals of a rigid or flexible link."""
    return rigid_link(link.mass, link.length, link.inertia) if shapes is None else shapes.integrals


def reached(mechanism: Mechanism) -> float:
    """Return the angle of the last link that puts its end on the slide.

    The link is straight, and on the side of its own angle.
    """
    y = sum(link.length * math.sin(link.angle) for link in mechanism.links[:-1])
    last = mechanism.links[-1]
    height = ((mechanism.slide or 0.0) - y) / last.length
    if abs(height) >= 1.0:
        raise CaseError(
            f"the slide at y = {mechanism.slide:g} m is out of reach of link '{last.name}', which begins at "
            f"y = {y:.6g} m and is {last.length:g} m long",
            remedy="Give another slide or angle, or a longer link.",
            path=f"mechanisms.{mechanism.name}.end",
        )
    tilt = math.asin(height)
    return tilt if math.cos(last.angle) >= 0.0 else math.pi - tilt
