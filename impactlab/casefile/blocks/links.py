"""The blocks of mechanisms: links, hinges, drives and ends, and directions of contacts on them."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from impactlab.casefile.blocks.shared import Block, Length, MassValue, Name, Time
from impactlab.casefile.text.words import shown
from impactlab.casefile.values.faults import refuse
from impactlab.casefile.values.fields import Allowed, Reader, quantity, whole, words

MAX_LINKS, MAX_AXIAL = 100, 200
Rate = Annotated[float, quantity("rad/s")]
Angle = Annotated[float, quantity("rad")]


class LinkBlock(Block):
    """A rigid link of a mechanism: a straight bar whose mass centre is its middle."""

    kind: Literal["link"] = Field(description="link")
    length: Length = Field(description="length [m]")
    mass: MassValue = Field(description="mass [kg]")
    inertia: Annotated[float | None, quantity("kg m2", nothing=True, gt=0.0)] = Field(
        None, description="moment of inertia about the middle [kg m2]; that of a uniform bar if not given"
    )

    quantities: ClassVar[tuple[str, ...]] = ()

    def described(self, link: Any) -> dict[str, Any]:
        """Return the block of a link in SI."""
        return {"kind": "link", "length": link.length, "mass": link.mass, "inertia": link.inertia}

    @property
    def total_length(self) -> float:
        """Its length [m]."""
        return self.length


class DriveBlock(Block):
    """A hinge whose angular rate is given."""

    rate: Rate = Field(description="angular rate of the link [rad/s]")
    within: Time | None = Field(None, description="time within which it is reached smoothly [s]; at once without")


class JointBlock(Block):
    """A link of a mechanism, and its joint to the link before.

    The first link is tied to the ground.
    """

    body: Name = Field(description="name of the link: a body of kind link or beam")
    joint: Annotated[str, words("hinge", "clamped")] = Field(
        "hinge", description="hinge, or clamped to the end before it; to a driven hub if the hinge is driven"
    )
    angle: Angle = Field(
        0.0, description="angle at t = 0 [rad], from +x, counterclockwise; of a clamped link that of the link before it"
    )
    rate: Rate = Field(0.0, description="angular rate at t = 0 [rad/s]")
    torque: Annotated[float, quantity("N m")] = Field(
        0.0, description="torque on the link from the one before it [N m]"
    )
    drive: DriveBlock | None = Field(
        None, description="given angular rate of the link; the moment that keeps it acts from the ground"
    )
    end_mass: Annotated[float, quantity("kg", ge=0.0)] = Field(0.0, description="point mass at its end [kg]")
    axial_modes: Annotated[int, whole(ge=0, le=MAX_AXIAL)] = Field(
        0, description="axial shapes of a beam; without one it keeps its length"
    )


def _read_end(value: Any) -> Any:
    if value == "free":
        return value
    if isinstance(value, dict) and set(value) == {"slide"}:
        return {"slide": Allowed("m", number=True).read(value["slide"])}
    raise refuse(
        f"{shown(value)} is not a valid end of a mechanism. Allowed: free, or {{slide: y}} along x at the height y [m]"
    )


END = Reader(
    _read_end, {"anyOf": [{"const": "free"}, {"type": "object", "properties": {"slide": {}}, "required": ["slide"]}]}
)


class MechanismBlock(Block):
    """A planar chain of links, each tied to the one before.

    The first is tied to the ground at x = y = 0.
    """

    links: tuple[JointBlock, ...] = Field(min_length=1, max_length=MAX_LINKS, description="links from the ground on")
    end: Annotated[Any, END] = Field("free", description="free, or {slide: y}: the end moves along x at y [m]")


def _read_along(value: Any) -> Any:
    if value is None or value in ("x", "y"):
        return value
    if isinstance(value, (list, tuple)) and len(value) == 2:
        x, y = (Allowed("1", number=True).read(each) for each in value)
        if math.hypot(x, y) > 0.0:
            return (x, y)
        raise refuse("the direction [0, 0] has no length")
    raise refuse(f"{shown(value)} is not a direction. Allowed: x, y, or [cos, sin]")


ALONG = Reader(
    _read_along,
    {"anyOf": [{"enum": ["x", "y"]}, {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}]},
)
