"""The block of a rod, and the rod that it describes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from impactlab.casefile.blocks.rotation import RotationBlock, rotation_of
from impactlab.casefile.blocks.shared import PIECES, Area, Block, Length, Material, SegmentedBlock, material_values
from impactlab.casefile.text.words import listed
from impactlab.casefile.values.fields import END
from impactlab.casefile.values.materials import NAMED
from impactlab.errors import CaseError
from impactlab.scene.bodies import End, Rod, Segment
from impactlab.types import QUANTITIES_OF_ROD

SIZES = ("area", "diameter", "bore", "width", "height")
WAYS = (("area",), ("diameter",), ("diameter", "bore"), ("width", "height"))
MAX_WIDTH = 5.0  # of the length of a rod: a wider section is a unit that was left out; specimens have 2
ALLOWED = "area: m2, diameter: m (of a tube also bore: m), or width: m and height: m"


class CrossSection(Block):
    """The cross section of a rod: area, circle, tube or rectangle.

    A circle has a diameter, a tube also a bore, a rectangle width and height.
    """

    area: Area | None = Field(None, description="area of the cross section [m2]")
    diameter: Length | None = Field(None, description="of a circle or a tube, in place of area [m]")
    bore: Length | None = Field(None, description="inner diameter of a tube, with diameter [m]")
    width: Length | None = Field(None, description="of a rectangle, with height, in place of area [m]")
    height: Length | None = Field(None, description="of a rectangle [m]")


class SegmentBlock(CrossSection):
    """A uniform piece of a rod."""

    length: Length = Field(description="length [m]")
    material: Annotated[Material, NAMED] = Field(description="material: a name, or constants")


class EndsBlock(Block):
    """The supports of a rod's two ends, and forces on them.

    Forces are constant from t = 0 on, or over time.
    """

    left: Annotated[End, END] = Field(End("free"), description="left end, at x = 0; a force [N] is positive along +x")
    right: Annotated[End, END] = Field(End("free"), description="right end, at x = L; a force [N] is positive along +x")


class RodBlock(CrossSection, SegmentedBlock):
    """A straight elastic rod: length, area and material, or segments."""

    kind: Literal["rod"] = Field(description="rod")
    segments: Annotated[tuple[SegmentBlock, ...] | None, PIECES] = None
    ends: EndsBlock = Field(EndsBlock(), description="supports of the ends; free if not given")
    rotation: RotationBlock | None = Field(None, description="steady rotation; none if not given")

    piece: ClassVar[type[Block]] = SegmentBlock
    quantities: ClassVar[tuple[str, ...]] = QUANTITIES_OF_ROD
    shape_words: ClassVar[Mapping[str, str]] = {"area": "section (area, diameter, or width and height)"}

    def gives(self, key: str) -> bool:
        return any(_given(self)) if key == "area" else super().gives(key)

    def check_piece(self, piece: SegmentBlock, path: str) -> None:
        given = _given(piece)
        if given and given not in WAYS:
            raise CaseError(
                f"{listed(given)} given, which does not make the section of a rod. Allowed: {ALLOWED}",
                remedy="Give one of them.",
                path=f"{path}.{given[-1]}",
            )
        if piece.bore is not None and piece.diameter is not None and piece.bore >= piece.diameter:
            raise CaseError(
                f"a bore of {piece.bore:g} m in a diameter of {piece.diameter:g} m leaves no section",
                remedy="Give the inner diameter as bore, smaller than diameter.",
                path=f"{path}.bore",
            )
        if not given and self.segments is not None:
            raise CaseError(
                "this key is missing", remedy=f"A segment has a section. Allowed: {ALLOWED}.", path=f"{path}.area"
            )

    def body(self, name: str, lever_arm: float) -> Rod:
        self._check_width(f"bodies.{name}")
        pieces = tuple(_segment(piece) for piece in self.pieces)
        left, right = bounded(self.ends.left, pieces[0]), bounded(self.ends.right, pieces[-1])
        rotation = rotation_of(self.rotation, "rod", f"bodies.{name}")
        return Rod(name, pieces, left, right, self.velocity, self.profile, damping=self.rayleigh, rotation=rotation)

    def described_piece(self, _piece: SegmentBlock, segment: Segment) -> dict[str, Any]:
        return {"length": segment.length, "area": segment.area, "material": material_values(segment)}

    def _check_width(self, path: str) -> None:
        """Raise `CaseError` where a section is too wide for the rod, as without its unit."""
        length = sum(piece.length for piece in self.pieces)
        for number, piece in enumerate(self.pieces):
            for key in ("diameter", "width", "height"):
                width = getattr(piece, key)
                if width is not None and width > MAX_WIDTH * length:
                    raise CaseError(
                        f"{width:g} m across a rod of {length:g} m. Allowed: at most {MAX_WIDTH:g} times the "
                        "length; waves are plane only in rods that are longer than wide",
                        remedy="Check the units, as in '20 mm'. If the body is meant to be so short, give its area.",
                        path=f"{path}.{key}" if self.segments is None else f"{path}.segments.{number}.{key}",
                    )


def _given(section: CrossSection) -> tuple[str, ...]:
    """Return the keys that give a section."""
    return tuple(key for key in SIZES if getattr(section, key) is not None)


def _segment(piece: SegmentBlock) -> Segment:
    material, area = piece.material, piece.area
    if piece.diameter is not None:
        area = 0.25 * math.pi * (piece.diameter**2 - (piece.bore or 0.0) ** 2)
    elif piece.width is not None and piece.height is not None:
        area = piece.width * piece.height
    return Segment(piece.length, area or math.nan, material.young, material.density, material.viscosity)


def bounded(end: End, segment: Segment) -> End:
    """Return the end of a body of waves as it is held.

    An infinite end is held by a dashpot of its impedance.
    """
    return End("dashpot", segment.impedance, unbounded=True) if end.kind == "infinite" else end
