"""The block of a rod, and the rod that it describes."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from impactlab.casefile.blocks import PIECES, Area, Block, Length, Material, MovingBlock
from impactlab.casefile.values import END
from impactlab.scene.bodies import End, Rod, Segment
from impactlab.types import QUANTITIES_OF_ROD


class SegmentBlock(Block):
    """A uniform piece of a rod."""

    length: Length = Field(description="length [m]")
    area: Area = Field(description="area of the cross section [m2]")
    material: Material = Field(description="material")


class EndsBlock(Block):
    """The supports of the two ends of a rod, and forces that act on them from t = 0 on."""

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
    segments: Annotated[tuple[SegmentBlock, ...] | None, PIECES] = None
    ends: EndsBlock = Field(default=EndsBlock(), description="supports of the ends; free if not given")

    piece: ClassVar[type[Block]] = SegmentBlock
    quantities: ClassVar[tuple[str, ...]] = QUANTITIES_OF_ROD

    def body(self, name: str, lever_arm: float) -> Rod:
        pieces = tuple(_segment(piece) for piece in self.pieces)
        left, right = bounded(self.ends.left, pieces[0]), bounded(self.ends.right, pieces[-1])
        return Rod(name, pieces, left, right, self.velocity, self.profile, damping=self.rayleigh)


def _segment(piece: SegmentBlock) -> Segment:
    material = piece.material
    return Segment(piece.length, piece.area, material.young, material.density, material.viscosity)


def bounded(end: End, segment: Segment) -> End:
    """Return the end of a body of waves as it is held: where it is infinite, by a dashpot of its impedance."""
    return End("dashpot", segment.impedance) if end.kind == "infinite" else end
