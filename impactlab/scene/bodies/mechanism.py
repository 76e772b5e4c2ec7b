"""Mechanisms: planar chains of rigid and flexible links, each hinged to the end of the one before."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, final

from impactlab.scene.bodies.base import Body
from impactlab.scene.bodies.beam import Beam
from impactlab.startup.cached import cached_property
from impactlab.types import Quantity


class Drive(NamedTuple):
    """A hinge whose angular rate is given: constant, or reached smoothly within a time (`mechanisms.base.Drive`)."""

    rate: float  # rad/s, absolute
    within: float = 0.0  # s; 0: from the start


@dataclass(frozen=True)
class Link:
    """A link of a mechanism: a rigid bar, or a flexible beam.

    A beam bends and, with axial modes, stretches. Angles are absolute, from +x, positive counterclockwise; a torque
    acts on the link from the one before it, or from the ground.
    """

    name: str
    length: float  # m
    mass: float = 0.0  # kg, of a rigid link
    inertia: float = 0.0  # kg m2 about the middle of a rigid link
    beam: Beam | None = None  # of a flexible link
    joint: Literal["hinge", "clamped"] = "hinge"
    angle: float = 0.0  # rad at t = 0
    rate: float = 0.0  # rad/s at t = 0
    torque: float = 0.0  # N m, constant
    drive: Drive | None = None
    end_mass: float = 0.0  # kg, a point at its end
    axial_modes: int = 0

    @property
    def total_mass(self) -> float:
        """Mass with the one at the end [kg]."""
        return (self.mass if self.beam is None else self.beam.mass) + self.end_mass


class Mark(NamedTuple):
    """A place of a link, with a direction in space, that a contact or probe follows."""

    link: int
    x: float  # m along the link
    along: tuple[float, float]  # of length 1
    label: str  # as the case names it: ``rod.right``


class Gauge(NamedTuple):
    """A place of a flexible link whose bending moment or shear force a probe records."""

    link: int
    x: float  # m along the link


@dataclass(frozen=True)
class MechanismBody(Body):
    """A body with a mass matrix of its own at each position.

    Its places, the ``x`` of points and probes, are the numbers of its readings.
    """

    gravity: tuple[float, float] = field(default=(0.0, 0.0), kw_only=True)  # m/s2

    kind = "mechanism"
    changes = True
    falls = False  # its gravity is its own

    @property
    def rigid_mass(self) -> float:
        return math.nan

    @property
    def is_held(self) -> bool:
        return True

    @property
    def is_free(self) -> bool:
        return False


@final
@dataclass(frozen=True)
class Mechanism(MechanismBody):
    """A planar chain of links from the ground on.

    The last end is free or on a slide along x. Its places, the ``x`` of points and probes, are the numbers of its
    ``marks``.
    """

    links: tuple[Link, ...]
    slide: float | None = None  # m, y of the slide of the last end
    marks: tuple[Mark, ...] = ()
    gauges: tuple[Gauge, ...] = ()

    @property
    def moving_mass(self) -> float:
        return sum(link.total_mass for link in self.links)

    @property
    def sliding(self) -> str:
        return "" if self.slide is None else self.links[-1].name

    @property
    def modelled_parts(self) -> tuple[str, ...]:
        return tuple(link.name for link in self.links if link.beam is not None)

    @cached_property
    def driven(self) -> tuple[int, ...]:
        """Numbers of the links whose hinge is driven."""
        return tuple(number for number, link in enumerate(self.links) if link.drive is not None)

    def is_driven(self, x: float) -> bool:
        before = self.links[: self.marks[int(x)].link + 1]
        return all(
            link.beam is None and (link.drive is not None or (number > 0 and link.joint == "clamped"))
            for number, link in enumerate(before)
        )

    @cached_property
    def bent(self) -> tuple[int, ...]:
        """Numbers of the flexible links."""
        return tuple(number for number, link in enumerate(self.links) if link.beam is not None)

    @property
    def lengths_of_bent(self) -> dict[str, float]:
        return {self.links[at].name: self.links[at].length for at in self.bent}

    @property
    def ground_drives(self) -> tuple[tuple[str, str], ...]:
        return tuple((self.links[at].name, self.links[at - 1].name) for at in self.driven if at > 0)

    @property
    def recorded(self) -> tuple[tuple[str, float, Quantity], ...]:
        found: list[tuple[str, float, Quantity]] = []
        for number in range(len(self.marks)):
            place = self._place(number)
            found += [(f"position:{place}", number, "displacement"), (f"velocity:{place}", number, "velocity")]
        for number, link in enumerate(self.links, start=len(self.marks)):
            found += [(f"angle:{link.name}", number, "displacement"), (f"rate:{link.name}", number, "velocity")]
        for number, at in enumerate(self.bent, start=len(self.marks) + len(self.links)):
            found.append((f"shortening:{self.links[at].name}", number, "displacement"))
        found += [(f"drive:{self.links[at].name}", number, "moment") for number, at in enumerate(self.driven)]
        return tuple(found)

    def face_channel(self, x: float) -> str:
        return f"position:{self._place(int(x))}"

    def gauged(self, link: str, x: float, quantity: str) -> tuple[int, Quantity, float]:
        """Return the number of a gauge, and the quantity of its model with the factor for a quantity of a probe."""
        number = next(at for at, each in enumerate(self.links) if each.name == link)
        beam = self.links[number].beam
        assert beam is not None  # noqa: S101 - a case has probes on flexible links alone
        return self.gauges.index(Gauge(number, x)), *beam.reading(quantity)

    def _place(self, number: int) -> str:
        """Return the name of a place in channels.

        It is that of the face, with the direction where it meets in several.
        """
        mark = self.marks[number]
        along = {(1.0, 0.0): "x", (0.0, 1.0): "y"}.get(mark.along, f"{mark.along[0]:.4g} {mark.along[1]:.4g}")
        same = {each.along for each in self.marks if each.label == mark.label}
        return mark.label if len(same) == 1 else f"{mark.label} along {along}"


def mechanism_of(link: str, bodies: Iterable[Body]) -> Mechanism:
    """Return the mechanism that has a link of a name."""
    return next(
        body for body in bodies if isinstance(body, Mechanism) and any(each.name == link for each in body.links)
    )


def links_on_hubs(bodies: Iterable[Body]) -> Iterator[tuple[Mechanism, Link]]:
    """Yield each mechanism of one link clamped to a driven hub, and the link."""
    for body in bodies:
        if isinstance(body, Mechanism) and len(body.links) == 1:
            (link,) = body.links
            if link.joint == "clamped" and link.drive is not None:
                yield body, link
