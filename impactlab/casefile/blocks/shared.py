"""Keys that several kinds of body share, with their units, and the facts of an elastic body's block."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from impactlab.casefile.blocks.repeat import MAX_REPEAT
from impactlab.casefile.values.faults import refuse
from impactlab.casefile.values.fields import SHAPE, quantity, whole
from impactlab.casefile.values.formula import Formula
from impactlab.casefile.values.loads import load_values
from impactlab.casefile.values.materials import NAMED
from impactlab.scene.bodies import ElasticBody, End, Profile, Rayleigh, Rotation, Segment, Table

MIN_SPEED = 1e-290  # m/s: the displacements of a smaller one have no digits left


def _least_speed(velocity: float) -> float:
    """Return a velocity [m/s], or refuse one whose displacements are too small for a float."""
    if 0.0 < abs(velocity) < MIN_SPEED:
        raise refuse(
            f"{velocity:g} m/s is out of range: its displacements are too small for a float. "
            f"Allowed: 0, or a speed of at least {MIN_SPEED:g} m/s"
        )
    return velocity


Length = Annotated[float, quantity("m", gt=0.0)]
Area = Annotated[float, quantity("m2", gt=0.0)]
Inertia = Annotated[float, quantity("m4", gt=0.0)]
Modulus = Annotated[float, quantity("Pa", gt=0.0)]
Density = Annotated[float, quantity("kg/m3", gt=0.0)]
MassValue = Annotated[float, quantity("kg", gt=0.0)]
Velocity = Annotated[float, quantity("m/s"), AfterValidator(_least_speed)]
Place = Annotated[float, quantity("m")]
Time = Annotated[float, quantity("s", gt=0.0)]
Instant = Annotated[float, quantity("s", ge=0.0)]
Records = Annotated[int, whole(ge=100, le=10_000_000)]
Positive = Annotated[float, quantity("1", gt=0.0)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_-]{0,39}$")]
Text = Annotated[str, Field(max_length=2000, pattern=r"^[^\x00-\x08\x0b-\x1f\x7f-\x9f]*$")]


Repeat = Annotated[int | None, whole(nothing=True, ge=1, le=MAX_REPEAT)]
REPEAT = Field(
    None,
    description="number n of blocks made from this one, i = 1 ... n: strings may be formulas of i and n, "
    "NAME makes NAME_1 ... NAME_n",
)
POISSON = quantity("1", nothing=True, ge=0.0, le=0.5)


class Block(BaseModel):
    """Base of all blocks: frozen, no unknown keys, defaults checked like given values."""

    model_config = ConfigDict(frozen=True, extra="forbid", validate_default=True, arbitrary_types_allowed=True)


class Material(Block):
    """A linear elastic material."""

    young: Modulus = Field(description="Young's modulus E [Pa]")
    density: Density = Field(description="density rho [kg/m3]")
    viscosity: Annotated[float, quantity("Pa s", ge=0.0)] = Field(
        0.0, description="viscosity [Pa s]: stress = E strain + viscosity times strain rate (Kelvin and Voigt)"
    )


class DampingBlock(Block):
    """Rayleigh damping of a rod: C = mass M + stiffness K."""

    mass: Annotated[float, quantity("1/s", ge=0.0)] = Field(0.0, description="share of the mass matrix [1/s]")
    stiffness: Annotated[float, quantity("s", ge=0.0)] = Field(0.0, description="share of the stiffness matrix [s]")


class ElasticBlock(Block):
    """An elastic body: length and material, or segments, damping, initial state."""

    length: Length | None = Field(None, description="length [m]")
    damping: DampingBlock = Field(DampingBlock(), description="Rayleigh damping of the whole body")
    repeat: Repeat = REPEAT

    if TYPE_CHECKING:  # each kind of body has its own
        kind: str
        ends: Any
        segments: tuple[Any, ...] | None

    piece: ClassVar[type[Block]] = Block  # block of one of the segments
    shape_keys: ClassVar[tuple[str, ...]] = ("length", "area", "material")  # of a uniform body; segments replace them
    shape_words: ClassVar[Mapping[str, str]] = {}  # of these keys, where others may stand in their place
    profile_key: ClassVar[str] = "displacement"  # of the shape at t = 0
    profile_unit: ClassVar[str] = "m"
    quantities: ClassVar[tuple[str, ...]] = ()  # that a probe records, unless it is ``lacking``
    both_sides: ClassVar[bool] = False  # True: it can be struck on either side anywhere
    end_keys: ClassVar[Mapping[str, str]] = {}  # of kinds of ends that have other names in this block

    @abstractmethod
    def body(self, name: str, lever_arm: float) -> ElasticBody:
        """Return the checked body in SI."""

    def check_piece(self, piece: Any, path: str) -> None:
        """Raise `CaseError` where section and material of a piece do not make a body."""

    def lacking(self, _quantity: str) -> str:
        """Return why this body lacks one of its `quantities`; empty otherwise."""
        return ""

    @property
    def pieces(self) -> tuple[Any, ...]:
        """The uniform pieces of the body: its segments, or the body itself."""
        whole = {key: getattr(self, key) for key in self.piece.model_fields}
        return self.segments or (self.piece.model_construct(**whole),)

    def gives(self, key: str) -> bool:
        """Return whether one of `shape_keys` is given for the whole body."""
        return getattr(self, key) is not None

    @property
    def total_length(self) -> float:
        """Whole length [m]."""
        return float(self.length or 0.0 if self.segments is None else sum(piece.length for piece in self.segments))

    @property
    def profile(self) -> Profile | None:
        """The shape at t = 0 as a function of x [m]."""
        given = getattr(self, self.profile_key)
        if given is None or isinstance(given, (Formula, Table)):
            return given
        return Formula(str(given), self.total_length)

    def described(self, body: Any) -> dict[str, Any]:
        """Return the block of a body in SI, its defaults filled in."""
        ends = {side: end_values(getattr(self.ends, side), self.end_keys) for side in ("left", "right")}
        return self.model_dump(exclude_none=True) | {"ends": ends} | profile_values(self.profile_key, self.profile)

    @property
    def rayleigh(self) -> Rayleigh:
        """Its damping in the scene."""
        return Rayleigh(self.damping.mass, self.damping.stiffness)


PIECES = Field(min_length=1, max_length=1000, description="uniform pieces from left to right, in place of the three")


class MovingBlock(ElasticBlock):
    """An elastic body that moves along its axis or across it."""

    material: Annotated[Material, NAMED] | None = Field(None, description="material: a name, or constants")
    velocity: Velocity = Field(0.0, description="velocity at t = 0, uniform [m/s]")
    displacement: Annotated[Any, SHAPE] = Field(
        None, description="displacement at t = 0 [m]: a formula of x, or {x: [...], u: [...]}"
    )


class SegmentedBlock(MovingBlock):
    """A rod or a beam, uniform or of segments."""

    @abstractmethod
    def described_piece(self, piece: Any, segment: Any) -> dict[str, Any]:
        """Return the block of a piece in SI, from the segment that it describes."""

    def described_pieces(self, segments: Sequence[Segment]) -> list[dict[str, Any]]:
        """Return the blocks of the pieces in SI, from the segments of the body."""
        return [self.described_piece(*each) for each in zip(self.pieces, segments, strict=True)]

    def described_theory(self) -> dict[str, Any]:
        """Return the keys that only this kind of body has."""
        return {}

    def described(self, body: Any) -> dict[str, Any]:
        pieces = self.described_pieces(body.segments)
        shape: dict[str, Any] = pieces[0] if self.segments is None else {"segments": pieces}
        ends = {"left": end_values(body.left), "right": end_values(body.right)}
        values = {"kind": self.kind, **shape, "ends": ends, **self.described_theory()}
        values["damping"] = {"mass": body.damping.mass, "stiffness": body.damping.stiffness}
        values |= {"velocity": body.velocity, **rotation_values(body.rotation)}
        return values | profile_values("displacement", body.displacement)


def material_values(segment: Segment) -> dict[str, float]:
    """Return the material of a segment as a case gives it."""
    return {"young": segment.young, "density": segment.density, "viscosity": segment.viscosity}


def rotation_values(rotation: Rotation | None) -> dict[str, Any]:
    """Return the rotation of a body as a case gives it; no key for a body at rest."""
    if rotation is None:
        return {}
    plane = {} if rotation.plane == "axial" else {"plane": rotation.plane}
    return {"rotation": {"rate": rotation.rate, "axis_at": rotation.axis_at, **plane}}


def end_values(end: End, names: Mapping[str, str] | None = None) -> Any:
    """Return an end as a case gives it; ``names`` are other keys of its kinds."""
    held: dict[str, Any] = {end.kind: end.value} if end.value > 0.0 else {}
    held |= {"rotational": end.rotational} if end.rotational > 0.0 else {}
    pushed: dict[str, Any] = {"force": end.force} if end.force != 0.0 else {}
    pushed |= {"force": load_values(end.load)} if end.load is not None else {}
    return {(names or {}).get(key, key): value for key, value in {**held, **pushed}.items()} or end.kind


def profile_values(key: str, profile: Profile | None) -> dict[str, Any]:
    """Return a shape at t = 0 as a case gives it under a key."""
    if isinstance(profile, Formula):
        return {key: profile.text}
    return {key: {"x": list(profile.x), "u": list(profile.u)}} if isinstance(profile, Table) else {}
