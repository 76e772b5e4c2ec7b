"""The block of the steady rotation of a rod or a beam, and its rotation record."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from impactlab.casefile.blocks.shared import Block, Place
from impactlab.casefile.values.fields import quantity, words
from impactlab.errors import CaseError
from impactlab.scene.bodies import Rotation


class RotationBlock(Block):
    """A steady rotation about a fixed axis.

    All quantities of the body count from its steady state.
    """

    rate: Annotated[float | None, quantity("rad/s", nothing=True)] = Field(
        None, description="angular velocity [rad/s]; a mass without it takes that of the body that it meets"
    )
    axis_at: Place | None = Field(
        None,
        description="place of the axis in the body's own x [m]; a mass without it takes its distance from the face "
        "that it meets",
    )
    plane: Annotated[Literal["chord", "flap"] | None, words("chord", "flap", nothing=True)] = Field(
        None, description="of a beam and of masses that strike it: chord, in the plane of rotation, or flap, across it"
    )


def rotation_of(block: RotationBlock | None, kind: str, path: str) -> Rotation | None:
    """Return the rotation of a rod or a beam, None at rest.

    Raise `CaseError` where a key is missing or one too many.
    """
    if block is None:
        return None
    path = f"{path}.rotation"
    needed = {
        "rate": "Give the rate in rad/s, or as a string such as '600 rpm'.",
        "axis_at": "Give the place of the axis in the body's own x [m]: 0 at its left end, L at its right end.",
        "plane": "Give chord (the beam bends in the plane of rotation) or flap (across it).",
    }
    for key, remedy in needed.items():
        if getattr(block, key) is None and (key, kind) != ("plane", "rod"):
            raise CaseError("this key is missing", remedy=remedy, path=f"{path}.{key}")
    if kind == "rod" and block.plane is not None:
        raise CaseError(
            "`plane` applies only to beams; a rotating rod moves only along its radius",
            remedy="Remove it, or describe the body as a beam.",
            path=f"{path}.plane",
        )
    return Rotation(block.rate, block.axis_at or 0.0, block.plane or "axial") if block.rate else None
