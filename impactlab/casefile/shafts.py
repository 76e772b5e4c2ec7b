"""The block of a shaft: its section in torsion, its ends, and the shaft that it describes at its lever arm."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from impactlab.casefile.blocks import Block, Density, ElasticBlock, Inertia, Length, end_values, profile_values
from impactlab.casefile.values import SHAPE, Allowed, EndReader, Reader, quantity, refuse
from impactlab.casefile.words import listed
from impactlab.errors import CaseError
from impactlab.scene.bodies import AtArm, End, Profile, Segment, Shaft, Table, shaft_end, shaft_segment

_SUPPORTS = {"spring": ("spring", "N m"), "dashpot": ("dashpot", "N m s"), "inertia": ("mass", "kg m2")}
_END = EndReader("shaft", ("free", "clamped", "infinite"), supports=_SUPPORTS, load=("torque", "N m"))
SHAFT_END = Reader(_END.read, _END.schema())
OF_BEAMS = ("width", "height", "area", "inertia", "shear_factor")
SECTIONS = "{diameter: m}, {diameter: m, bore: m} with a smaller bore, or {torsion_constant: m4, polar_moment: m4}"
MODULUS = Allowed("Pa", (("gt", 0.0),), number=True, nothing=True).reader()


class ShaftMaterial(Block):
    """A linear elastic material in shear."""

    density: Density = Field(description="density rho [kg/m3]")
    shear_modulus: Annotated[float | None, MODULUS] = Field(default=None, description="shear modulus G [Pa]")
    young: Annotated[float | None, MODULUS] = Field(default=None, description="Young's modulus E [Pa], with poisson")
    poisson: Annotated[float | None, Allowed("1", (("ge", 0.0), ("le", 0.5)), number=True, nothing=True).reader()] = (
        Field(default=None, description="Poisson's ratio, with young: G = E/(2 (1 + nu))")
    )
    viscosity: Annotated[float, quantity("Pa s", ge=0.0)] = Field(
        default=0.0, description="viscosity [Pa s]: shear stress = G shear strain + viscosity times its rate"
    )

    @property
    def shear(self) -> float:
        """Shear modulus G [Pa]; NaN where it is not given in one way."""
        given = self.young is not None, self.poisson is not None, self.shear_modulus is not None
        if given == (False, False, True):
            return self.shear_modulus or math.nan
        return (
            (self.young or math.nan) / (2.0 * (1.0 + (self.poisson or 0.0)))
            if given == (True, True, False)
            else math.nan
        )


class ShaftSection(Block):
    """The cross section of a shaft: a diameter, or torsion constant and polar moment."""

    diameter: Length | None = Field(default=None, description="of a circle [m]")
    bore: Length | None = Field(default=None, description="inner diameter of a tube, with diameter [m]")
    torsion_constant: Inertia | None = Field(default=None, description="St. Venant's J of any other section [m4]")
    polar_moment: Inertia | None = Field(
        default=None, description="polar second moment of area of any other section [m4]; torsion_constant if not given"
    )

    @model_validator(mode="before")
    @classmethod
    def _is_no_beam(cls, given: Any) -> Any:
        foreign = [key for key in OF_BEAMS if isinstance(given, dict) and key in given]
        if foreign:
            raise refuse(
                f"{listed(foreign)} make the section of a beam, which bends, and a shaft twists. Allowed: {SECTIONS}"
            )
        return given

    @property
    def moments(self) -> tuple[float, float]:
        """Torsion constant and polar second moment of area [m4]; NaN where they are not given in one way."""
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
    material: ShaftMaterial = Field(description="material")


class ShaftEndsBlock(Block):
    """The supports of the two ends of a shaft, and torques that act on them from t = 0 on."""

    left: Annotated[End, SHAFT_END] = Field(default=End("free"), description="left end, at x = 0")
    right: Annotated[End, SHAFT_END] = Field(default=End("free"), description="right end, at x = L")


class ShaftBlock(ElasticBlock):
    """A straight elastic shaft in torsion: length, section and material, or segments."""

    kind: Literal["shaft"] = Field(description="shaft")
    section: ShaftSection | None = Field(default=None, description="cross section")
    material: ShaftMaterial | None = Field(default=None, description="material")
    segments: tuple[ShaftSegmentBlock, ...] | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="uniform pieces from left to right, in place of the three",
    )
    ends: ShaftEndsBlock = Field(default=ShaftEndsBlock(), description="supports of the ends; free if not given")
    twist_rate: Annotated[float, quantity("1/s")] = Field(
        default=0.0, description="twist rate at t = 0, uniform [rad/s]"
    )
    twist: Annotated[Any, SHAPE] = Field(
        default=None, description="twist at t = 0 [rad]: a formula of x, or {x: [...], u: [...]}"
    )

    shape_keys: ClassVar[tuple[str, ...]] = ("length", "section", "material")
    profile_key: ClassVar[str] = "twist"
    profile_unit: ClassVar[str] = "rad"
    quantities: ClassVar[tuple[str, ...]] = ("twist", "twist_rate", "torque", "displacement", "velocity")

    def check_pieces(self, path: str) -> None:
        pieces: tuple[ShaftSegmentBlock | ShaftBlock, ...] = (self,) if self.segments is None else self.segments
        for number, piece in enumerate(pieces):
            place = path if self.segments is None else f"{path}.segments.{number}"
            if piece.section is not None and math.isnan(piece.section.moments[0]):
                raise CaseError(
                    f"these keys do not make the section of a shaft. Allowed: {SECTIONS}",
                    remedy="Give one of the three.",
                    path=f"{place}.section",
                )
            if piece.material is not None and math.isnan(piece.material.shear):
                raise CaseError(
                    "a shaft needs its shear modulus, once. Allowed: shear_modulus, or young and poisson",
                    remedy="Give one of the two.",
                    path=f"{place}.material",
                )

    def body(self, name: str, lever_arm: float) -> Shaft:
        pieces = tuple(_segment(each, lever_arm) for each in self.segments or (self,))
        left, right = (
            End("dashpot", piece.impedance) if end.kind == "infinite" else shaft_end(end, lever_arm)
            for end, piece in ((self.ends.left, pieces[0]), (self.ends.right, pieces[-1]))
        )
        rate, shape = lever_arm * self.twist_rate, at_arm(self.profile, lever_arm)
        return Shaft(name, pieces, left, right, rate, shape, damping=self.rayleigh, lever_arm=lever_arm)


def _segment(piece: ShaftSegmentBlock | ShaftBlock, lever_arm: float) -> Segment:
    if piece.length is None or piece.section is None or piece.material is None:
        raise CaseError("a shaft without length, section or material")
    material = piece.material
    sizes = (piece.length, material.shear, material.density, *piece.section.moments)
    return shaft_segment(*sizes, lever_arm, material.viscosity)


def at_arm(twist: Profile | None, lever_arm: float) -> Profile | None:
    """Return the displacement [m] at the lever arm [m] of a twist [rad] along the shaft."""
    if twist is None or isinstance(twist, Table):
        return None if twist is None else Table(twist.x, tuple(lever_arm * u for u in twist.u))
    return AtArm(twist, lever_arm)


def described(shaft: Shaft) -> dict[str, Any]:
    """Return the block of a shaft in SI, its defaults filled in."""
    arm, names = shaft.lever_arm, {kind: key for key, (kind, _) in _SUPPORTS.items()} | {"force": "torque"}
    pieces = [
        {
            "length": piece.length,
            # As density and polar moment act by their product alone, the moment is given as the torsion constant.
            "section": {"torsion_constant": piece.area * arm**2},
            "material": {"shear_modulus": piece.young, "density": piece.density, "viscosity": piece.viscosity},
        }
        for piece in shaft.segments
    ]
    ends = {}
    for side, end in (("left", shaft.left), ("right", shaft.right)):
        given = end_values(End(end.kind, end.value * arm**2, end.force * arm))
        ends[side] = {names[key]: value for key, value in given.items()} if isinstance(given, dict) else given
    shape = shaft.displacement.twist if isinstance(shaft.displacement, AtArm) else shaft.displacement
    if isinstance(shape, Table):
        shape = Table(shape.x, tuple(u / arm for u in shape.u))
    return {
        "kind": "shaft",
        **(pieces[0] if len(pieces) == 1 else {"segments": pieces}),
        "ends": ends,
        "damping": {"mass": shaft.damping.mass, "stiffness": shaft.damping.stiffness},
        "twist_rate": shaft.velocity / arm,
        **profile_values("twist", shape),
    }


def derived_of(shaft: Shaft) -> dict[str, Any]:
    """Return the sizes of a shaft that follow from its block: inertia in kg m2, impedance in N m s/rad."""
    arm = shaft.lever_arm
    return {
        "lever_arm": arm,
        "inertia": shaft.mass * arm**2,
        "torsional_impedance": [piece.impedance * arm**2 for piece in shaft.segments],
    }
