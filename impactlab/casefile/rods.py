"""The block of a rod, and the rod that it describes."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from impactlab.casefile.blocks import Area, Block, Length, Material, MovingBlock
from impactlab.casefile.values import END
from impactlab.errors import CaseError
from impactlab.scene.bodies import End, Rod, Segment
from impactlab.types import QUANTITIES_OF_ROD


class SegmentBlock(Block):
    """A uniform piece of a rod."""

    length: Length = Field(description="length [m]")
    area: Area = Field(description="area of the cross section [m2]")
    material: Material = Field(description="material")


class EndsBlock(Block):
    """What holds the two ends of a rod, and forces that act on them from t = 0 on."""

    left: Annotated[End, END] = Field(
        default=End("free"), description="left end, at x = 0; a force [N] is positive along +x"
    )
    right: Annotated[End, END] = Field(
        default=End("free"), description="right end, at x = L; a force [N] is positive along +x"
    )


class RodBlock(MovingBlock):
    """A straight elastic rod: length, area and material, or segments."""

    kind: Literal["rod"] = Field(description="rod")
    area: Area | None = Field(default=None, description="area of the cross section [m2]")
    segments: tuple[SegmentBlock, ...] | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="uniform pieces from left to right, in place of the three",
    )
    ends: EndsBlock = Field(default=EndsBlock(), description="what holds the ends; free if not given")

    quantities: ClassVar[tuple[str, ...]] = QUANTITIES_OF_ROD

    def body(self, name: str, lever_arm: float) -> Rod:
        pieces = tuple(_segment(each) for each in self.segments or (self,))
        left, right = (
            _bounded(end, piece) for end, piece in ((self.ends.left, pieces[0]), (self.ends.right, pieces[-1]))
        )
        return Rod(name, pieces, left, right, self.velocity, self.profile, damping=self.rayleigh)


def _segment(piece: SegmentBlock | RodBlock) -> Segment:
    if piece.length is None or piece.area is None or piece.material is None:
        raise CaseError("a rod without length, area or material")
    material = piece.material
    return Segment(piece.length, piece.area, material.young, material.density, material.viscosity)


def _bounded(end: End, segment: Segment) -> End:
    """Return the end of a rod as it is held; a rod that is infinite there is held by a dashpot of its impedance."""
    return End("dashpot", segment.impedance) if end.kind == "infinite" else end
