"""A chain of links as a mechanism: equations of motion, readings, initial state."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import final

from impactlab.errors import CaseError
from impactlab.mechanisms.base import AbstractMechanism, Drive, Motion, Reading
from impactlab.mechanisms.flat_chain import packed
from impactlab.mechanisms.shapes import FlexibleLink, flexible_link
from impactlab.mechanisms.terms import terms
from impactlab.models.base import AbstractRodModel
from impactlab.models.modal import Modal
from impactlab.plugins import kind_of
from impactlab.scene.bodies import Link, Mechanism


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
        bent = (Reading(f"shortening:{links[at].name}") for at in self.mechanism.bent)
        return (*marks, *(Reading(link.name, is_angle=True) for link in links), *bent)

    @property
    def mass(self) -> float:
        return self.mechanism.moving_mass

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
            drives=tuple(Drive(numbers.angles[at], each.rate, each.within) for at, each in driven if each is not None),
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
