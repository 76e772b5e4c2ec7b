"""The block of a shaft: torsion section, ends, and the resulting shaft, described at its lever arm."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from impactlab.casefile.blocks.rods import bounded
from impactlab.casefile.blocks.shared import (
    PIECES,
    POISSON,
    Block,
    Density,
    ElasticBlock,
    Inertia,
    Length,
)
from impactlab.casefile.text.words import listed
from impactlab.casefile.values.faults import refuse
from impactlab.casefile.values.fields import TWIST, EndReader, quantity
from impactlab.casefile.values.formula import Formula
from impactlab.casefile.values.materials import NAMED
from impactlab.errors import CaseError
from impactlab.scene.bodies import End, Profile, Segment, Shaft, Table, shaft_end, shaft_segment

_SUPPORTS = {"spring": ("spring", "N m"), "dashpot": ("dashpot", "N m s"), "inertia": ("mass", "kg m2")}
SHAFT_END = EndReader("shaft", ("free", "clamped", "infinite"), supports=_SUPPORTS, load=("torque", "N m")).reader()
OF_BEAMS = ("width", "height", "area", "inertia", "shear_factor")
SECTIONS = "{diameter: m}, {diameter: m, bore: m} with a smaller bore, or {torsion_constant: m4, polar_moment: m4}"
RATE = quantity("1/s")
MODULUS = quantity("Pa", nothing=True, gt=0.0)


class ShaftMaterial(Block):
    """A linear elastic material in shear."""

    density: Density = Field(description="density rho [kg/m3]")
    shear_modulus: Annotated[float | None, MODULUS] = Field(None, description="shear modulus G [Pa]")
    young: Annotated[float | None, MODULUS] = Field(None, description="Young's modulus E [Pa], with poisson")
    poisson: Annotated[float | None, POISSON] = Field(None, description="Poisson's ratio: G = E/(2 (1 + nu))")
    viscosity: Annotated[float, quantity("Pa s", ge=0.0)] = Field(
        0.0, description="viscosity [Pa s]: shear stress = G shear strain + viscosity times its rate"
    )

    @property
    def shear(self) -> float:
        """Shear modulus G [Pa]; NaN where it is not given in one way."""
        if self.young is None and self.poisson is None:
            return self.shear_modulus or math.nan
        both = self.young is not None and self.poisson is not None and self.shear_modulus is None
        return (self.young or 0.0) / (2.0 * (1.0 + (self.poisson or 0.0))) if both else math.nan


class ShaftSection(Block):
    """The cross section of a shaft: a diameter, or torsion constant and polar moment."""

    diameter: Length | None = Field(None, description="of a circle [m]")
    bore: Length | None = Field(None, description="inner diameter of a tube, with diameter [m]")
    torsion_constant: Inertia | None = Field(None, description="St. Venant's J of any other section [m4]")
    polar_moment: Inertia | None = Field(
        None, description="polar second moment of area of any other section [m4]; torsion_constant if not given"
    )

    @model_validator(mode="before")
    @classmethod
    def _is_no_beam(cls, given: Any) -> Any:
        foreign = [key for key in OF_BEAMS if isinstance(given, dict) and key in given]
        if foreign:
            words = "belongs" if len(foreign) == 1 else "belong"
            raise refuse(
                f"{listed(foreign)} {words} to the section of a beam, not to that of a shaft. Allowed: {SECTIONS}"
            )
        return given

    @property
    def moments(self) -> tuple[float, float]:
        """Torsion constant and polar second moment of area [m4]; NaN unless given in exactly one way."""
        if self.diameter is not None and self.torsion_constant is None and self.polar_moment is None:
            circle = math.pi / 32.0 * (self.diameter**4 - (self.bore or 0.0) ** 4)
            return (circle, circle) if circle > 0.0 else (math.nan, math.nan)
        if self.diameter is None and self.bore is None and self.torsion_constant is not None:
            return self.torsion_constant, self.polar_moment or self.torsion_constant
        return math.nan, math.nan


class ShaftSegmentBlock(Block):
    """A uniform piece of a shaft."""

    length: Length = Field(description="length [m]")
    section: ShaftSection = Field(description="cross section")
    material: Annotated[ShaftMaterial, NAMED] = Field(description="material: a name, or constants")


class ShaftEndsBlock(Block):
    """The supports of a shaft's two ends, and torques on them.

    Torques act from t = 0 on.
    """

    left: Annotated[End, SHAFT_END] = Field(End("free"), description="left end, at x = 0")
    right: Annotated[End, SHAFT_END] = Field(End("free"), description="right end, at x = L")


class ShaftBlock(ElasticBlock):
    """A straight elastic shaft in torsion: length, section and material, or segments."""

    kind: Literal["shaft"] = Field(description="shaft")
    section: ShaftSection | None = Field(None, description="cross section")
    material: Annotated[ShaftMaterial, NAMED] | None = Field(None, description="material: a name, or constants")
    segments: Annotated[tuple[ShaftSegmentBlock, ...] | None, PIECES] = None
    ends: ShaftEndsBlock = Field(ShaftEndsBlock(), description="supports of the ends; free if not given")
    twist_rate: Annotated[float, RATE] = Field(0.0, description="twist rate at t = 0, uniform [rad/s]")
    twist: Annotated[Any, TWIST] = Field(None, description="twist at t = 0 [rad]: a formula of x, or a table")

    piece: ClassVar[type[Block]] = ShaftSegmentBlock
    shape_keys: ClassVar[tuple[str, ...]] = ("length", "section", "material")
    profile_key: ClassVar[str] = "twist"
    profile_unit: ClassVar[str] = "rad"
    quantities: ClassVar[tuple[str, ...]] = ("twist", "twist_rate", "torque", "displacement", "velocity")
    end_keys: ClassVar[Mapping[str, str]] = {kind: key for key, (kind, _) in _SUPPORTS.items()} | {"force": "torque"}

    def check_piece(self, piece: ShaftSegmentBlock, path: str) -> None:
        if piece.section is not None and math.isnan(piece.section.moments[0]):
            text = f"these keys do not make the section of a shaft. Allowed: {SECTIONS}"
            raise CaseError(text, remedy="Give one of the three.", path=f"{path}.section")
        if piece.material is not None and math.isnan(piece.material.shear):
            text = "a shaft needs its shear modulus, once. Allowed: shear_modulus, or young and poisson"
            raise CaseError(text, remedy="Give one of the two.", path=f"{path}.material")

    def body(self, name: str, lever_arm: float) -> Shaft:
        pieces = tuple(_segment(piece, lever_arm) for piece in self.pieces)
        left = bounded(shaft_end(self.ends.left, lever_arm), pieces[0])
        right = bounded(shaft_end(self.ends.right, lever_arm), pieces[-1])
        rate, shape = lever_arm * self.twist_rate, _at_arm(self.profile, lever_arm, self.total_length)
        return Shaft(name, pieces, left, right, rate, shape, damping=self.rayleigh, lever_arm=lever_arm)


def _segment(piece: ShaftSegmentBlock, lever_arm: float) -> Segment:
    material = piece.material
    sizes = (piece.length, material.shear, material.density, *piece.section.moments)
    return shaft_segment(*sizes, lever_arm, material.viscosity)


def _at_arm(twist: Profile | None, lever_arm: float, length: float) -> Profile | None:
    """Return the displacement at the lever arm [m] for a twist [rad].

    Both are shapes along the shaft.
    """
    if isinstance(twist, Table):
        return Table(twist.x, tuple(lever_arm * u for u in twist.u))
    return Formula(f"{lever_arm!r}*({twist.text})", length) if isinstance(twist, Formula) else None
