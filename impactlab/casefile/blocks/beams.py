"""The block of a beam with its cross section (area, second moment, shear stiffness), and the resulting beam."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from impactlab.casefile.blocks.rotation import RotationBlock, rotation_of
from impactlab.casefile.blocks.shared import (
    PIECES,
    POISSON,
    Area,
    Block,
    Inertia,
    Length,
    Material,
    SegmentedBlock,
    material_values,
)
from impactlab.casefile.text.words import listed
from impactlab.casefile.values.fields import BEAM_END, quantity, words
from impactlab.casefile.values.materials import NAMED
from impactlab.errors import CaseError
from impactlab.scene.bodies import Beam, BeamSegment, End
from impactlab.types import QUANTITIES_OF_BEAM

RECTANGLE, CIRCLE = 5.0 / 6.0, 9.0 / 10.0  # shear factors: the energy of the static shear stress (Timoshenko1921)
WAYS = (("width", "height"), ("diameter",), ("area", "inertia"))
ALLOWED = "{width: m, height: m}, {diameter: m}, or {area: m2, inertia: m4}"


class BeamMaterial(Material):
    """A linear elastic material that may shear."""

    poisson: Annotated[float | None, POISSON] = Field(
        None, description="Poisson's ratio; it gives the shear modulus G = E/(2 (1 + nu))"
    )
    shear_modulus: Annotated[float | None, quantity("Pa", nothing=True, gt=0.0)] = Field(
        None, description="shear modulus G [Pa], in place of poisson"
    )


SHARE = quantity("1", nothing=True, gt=0.0, le=1.0)


class SectionBlock(Block):
    """The cross section of a beam: width and height, a diameter, or area and inertia."""

    width: Length | None = Field(None, description="of a rectangle, across the plane of bending [m]")
    height: Length | None = Field(None, description="in the plane of bending [m]")
    diameter: Length | None = Field(None, description="of a full circle [m]")
    area: Area | None = Field(None, description="area of any other section [m2]")
    inertia: Inertia | None = Field(None, description="second moment of area of any other section [m4]")
    shear_factor: Annotated[float | None, SHARE] = Field(
        None, description="shear correction factor k; of a rectangle 5/6, of a circle 9/10 if not given"
    )


class BeamSegmentBlock(Block):
    """A uniform piece of a beam."""

    length: Length = Field(description="length [m]")
    section: SectionBlock = Field(description="cross section")
    material: Annotated[BeamMaterial, NAMED] = Field(description="material: a name, or constants")


class BeamEndsBlock(Block):
    """The supports of a beam's two ends, and forces across them.

    Forces act from t = 0 on.
    """

    left: Annotated[End, BEAM_END] = Field(End("free"), description="left end, at x = 0; a force acts along +u")
    right: Annotated[End, BEAM_END] = Field(End("free"), description="right end, at x = L; a force acts along +u")


class BeamBlock(SegmentedBlock):
    """A straight elastic beam that bends: length, section and material, or segments."""

    kind: Literal["beam"] = Field(description="beam")
    theory: Annotated[Literal["euler_bernoulli", "timoshenko"], words("euler_bernoulli", "timoshenko")] = Field(
        "euler_bernoulli", description="euler_bernoulli, or timoshenko with shear and rotary inertia"
    )
    section: SectionBlock | None = Field(None, description="cross section")
    material: Annotated[BeamMaterial, NAMED] | None = Field(None, description="material: a name, or constants")
    segments: Annotated[tuple[BeamSegmentBlock, ...] | None, PIECES] = None
    ends: BeamEndsBlock = Field(BeamEndsBlock(), description="supports of the ends; free if not given")
    rotation: RotationBlock | None = Field(None, description="steady rotation; none if not given")
    tension: Annotated[float, quantity("N")] = Field(0.0, description="axial preload [N], positive in tension")

    piece: ClassVar[type[Block]] = BeamSegmentBlock
    shape_keys: ClassVar[tuple[str, ...]] = ("length", "section", "material")
    quantities: ClassVar[tuple[str, ...]] = (*QUANTITIES_OF_BEAM, "stress", "strain")
    both_sides: ClassVar[bool] = True

    def check_piece(self, piece: BeamSegmentBlock, path: str) -> None:
        if piece.section is not None:
            check_section(piece.section, f"{path}.section")
            if piece.material is not None and self.theory == "timoshenko":
                check_shear(piece.section, piece.material, path)

    def lacking(self, quantity: str) -> str:
        sections = [piece.section for piece in self.pieces]
        if quantity not in ("stress", "strain"):
            return ""
        if any(each.height is None and each.diameter is None for each in sections if each is not None):
            return "the height of its section is not known: give it beside area and inertia"
        if len(set(sections)) > 1:
            return "its segments have several sections: probe bending_moment"
        if quantity == "stress":
            return ""
        materials = [piece.material for piece in self.pieces if piece.material is not None]
        if len({each.young for each in materials}) > 1:
            return "its segments have several moduli: probe stress"
        if self.rayleigh.stiffness > 0.0 or any(each.viscosity > 0.0 for each in materials):
            return "its stress has a viscous part, so that it does not follow from the moment: probe stress"
        return ""

    def body(self, name: str, lever_arm: float) -> Beam:
        return Beam(
            name,
            tuple(_segment(piece, self.theory) for piece in self.pieces),
            self.ends.left,
            self.ends.right,
            self.velocity,
            self.profile,
            damping=self.rayleigh,
            theory=self.theory,
            tension=self.tension,
            rotation=rotation_of(self.rotation, "beam", f"bodies.{name}"),
        )

    def described_piece(self, piece: BeamSegmentBlock, segment: BeamSegment) -> dict[str, Any]:
        section, material = {"area": segment.area, "inertia": segment.inertia}, material_values(segment)
        if segment.height > 0.0:
            section["height"] = segment.height
        if self.theory == "timoshenko":
            section["shear_factor"], material["shear_modulus"] = shear_of(piece)
        return {"length": segment.length, "section": section, "material": material}

    def described_theory(self) -> dict[str, Any]:
        return {"theory": self.theory, "tension": self.tension}


def check_section(section: SectionBlock, path: str) -> None:
    """Raise `CaseError` unless the section is given in one way, and whole."""
    shapes = [key for way in WAYS for key in way if getattr(section, key) is not None]
    if section.height is not None and {"area", "inertia"} <= set(shapes) and section.width is None:
        return  # of any section, for its slenderness alone
    if tuple(shapes) not in WAYS:
        given = f"{listed(shapes)} given" if shapes else "nothing given"
        raise CaseError(
            f"{given}, which does not make a section. Allowed: {ALLOWED}", remedy="Give one of the three.", path=path
        )


def check_shear(section: SectionBlock, material: BeamMaterial, path: str) -> None:
    """Raise `CaseError` unless the shear stiffness of a Timoshenko beam is known."""
    if (material.poisson is None) == (material.shear_modulus is None):
        what = "no shear modulus" if material.poisson is None else "poisson and shear_modulus given together"
        raise CaseError(
            f"{what}, and theory timoshenko needs one",
            remedy="Give either poisson or shear_modulus.",
            path=f"{path}.material",
        )
    if section.shear_factor is None and section.area is not None:
        raise CaseError(
            "no shear_factor, and theory timoshenko needs one. It is known of rectangles and circles only",
            remedy="Give shear_factor, the part of the area that carries shear: 5/6 of a rectangle.",
            path=f"{path}.section",
        )


def shear_of(piece: BeamSegmentBlock) -> tuple[float, float]:
    """Return the shear factor and the shear modulus [Pa] of a piece.

    The factor is that of a rectangle or a circle if not given.
    """
    section, material = piece.section, piece.material
    known = math.nan if section.area is not None else CIRCLE if section.diameter is not None else RECTANGLE
    modulus = material.shear_modulus or material.young / (2.0 * (1.0 + (material.poisson or 0.0)))
    return section.shear_factor or known, modulus


def _segment(piece: BeamSegmentBlock, theory: str) -> BeamSegment:
    section, material = piece.section, piece.material
    height = section.height
    if section.width is not None and height is not None:
        area, inertia = section.width * height, section.width * height**3 / 12.0
    elif section.diameter is not None:
        height = section.diameter
        area, inertia = 0.25 * math.pi * height**2, math.pi * height**4 / 64.0
    else:
        area, inertia = section.area or math.nan, section.inertia or math.nan
    sizes = (piece.length, area, material.young, material.density, material.viscosity)
    bending = BeamSegment(*sizes, inertia=inertia, height=height or 0.0)
    if theory == "euler_bernoulli":
        return bending
    factor, modulus = shear_of(piece)
    return replace(bending, shear_stiffness=factor * modulus * area, rotary_inertia=material.density * inertia)
