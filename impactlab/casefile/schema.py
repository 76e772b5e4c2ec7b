"""The case format, version 1: the keys a case may have, with their units. Parts are read apart, by their own fields."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from impactlab.casefile.values import BEAM_END, END, SHAPE, Allowed, quantity, refuse, words
from impactlab.casefile.values import Reader as Reader
from impactlab.casefile.words import shown
from impactlab.scene.bodies import End
from impactlab.scene.problem import COUNTED, RECORDS
from impactlab.types import QUANTITIES_OF_BEAM, QUANTITIES_OF_ROD

QUANTITIES = tuple(dict.fromkeys((*QUANTITIES_OF_ROD, *QUANTITIES_OF_BEAM)))

Length = Annotated[float, quantity("m", gt=0.0)]
Area = Annotated[float, quantity("m2", gt=0.0)]
Inertia = Annotated[float, quantity("m4", gt=0.0)]
Modulus = Annotated[float, quantity("Pa", gt=0.0)]
Density = Annotated[float, quantity("kg/m3", gt=0.0)]
MassValue = Annotated[float, quantity("kg", gt=0.0)]
Velocity = Annotated[float, quantity("m/s")]
Place = Annotated[float, quantity("m")]
Time = Annotated[float, quantity("s", gt=0.0)]
Instant = Annotated[float, quantity("s", ge=0.0)]
Records = Annotated[int, Allowed("1", (("ge", 100), ("le", 10_000_000)), whole=True).reader()]
Positive = Annotated[float, quantity("1", gt=0.0)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_-]{0,39}$")]
Text = Annotated[str, Field(max_length=2000, pattern=r"^[^\x00-\x08\x0b-\x1f\x7f-\x9f]*$")]


def _read_block(value: Any) -> dict[str, Any]:
    if isinstance(value, dict) and isinstance(value.get("kind"), str):
        return value
    if isinstance(value, str):
        raise refuse(f"{shown(value)} stands where a block is needed. Write {{kind: {value[:30]}}}")
    raise refuse(f"{shown(value)} has no kind. Write {{kind: name, ...}} (see `impactlab plugins` for the names)")


PartBlock = Annotated[
    dict[str, Any], Reader(_read_block, {"type": "object", "properties": {"kind": {"type": "string"}}})
]
"""A part: its kind, and parameters that are read by the part's own fields in a second pass."""


class Block(BaseModel):
    """What all blocks share: frozen, no unknown keys, defaults checked like given values."""

    model_config = ConfigDict(frozen=True, extra="forbid", validate_default=True, arbitrary_types_allowed=True)


class Material(Block):
    """A linear elastic material."""

    young: Modulus = Field(description="Young's modulus E [Pa]")
    density: Density = Field(description="density rho [kg/m3]")
    viscosity: Annotated[float, quantity("Pa s", ge=0.0)] = Field(
        default=0.0, description="viscosity [Pa s]: stress = E strain + viscosity times strain rate (Kelvin and Voigt)"
    )


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


class DampingBlock(Block):
    """Rayleigh damping of a rod: C = mass M + stiffness K."""

    mass: Annotated[float, quantity("1/s", ge=0.0)] = Field(default=0.0, description="share of the mass matrix [1/s]")
    stiffness: Annotated[float, quantity("s", ge=0.0)] = Field(
        default=0.0, description="share of the stiffness matrix [s]"
    )


class ElasticBlock(Block):
    """What rods and beams share."""

    length: Length | None = Field(default=None, description="length [m]")
    material: Material | None = Field(default=None, description="material")
    damping: DampingBlock = Field(default=DampingBlock(), description="Rayleigh damping of the whole body")
    velocity: Velocity = Field(default=0.0, description="velocity at t = 0, uniform [m/s]")
    displacement: Annotated[Any, SHAPE] = Field(
        default=None, description="displacement at t = 0 [m]: a formula of x, or {x: [...], u: [...]}"
    )


class RodBlock(ElasticBlock):
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


class BeamMaterial(Material):
    """A linear elastic material that may shear."""

    poisson: Annotated[float | None, Allowed("1", (("ge", 0.0), ("le", 0.5)), number=True, nothing=True).reader()] = (
        Field(default=None, description="Poisson's ratio; it gives the shear modulus G = E/(2 (1 + nu))")
    )
    shear_modulus: Annotated[float | None, Allowed("Pa", (("gt", 0.0),), number=True, nothing=True).reader()] = Field(
        default=None, description="shear modulus G [Pa], in place of poisson"
    )


SHARE = Allowed("1", (("gt", 0.0), ("le", 1.0)), number=True, nothing=True).reader()


class SectionBlock(Block):
    """The cross section of a beam: width and height, a diameter, or area and inertia."""

    width: Length | None = Field(default=None, description="of a rectangle, across the plane of bending [m]")
    height: Length | None = Field(default=None, description="in the plane of bending [m]")
    diameter: Length | None = Field(default=None, description="of a full circle [m]")
    area: Area | None = Field(default=None, description="area of any other section [m2]")
    inertia: Inertia | None = Field(default=None, description="second moment of area of any other section [m4]")
    shear_factor: Annotated[float | None, SHARE] = Field(
        default=None, description="shear correction factor k; of a rectangle 5/6, of a circle 9/10 if not given"
    )


class BeamSegmentBlock(Block):
    """A uniform piece of a beam."""

    length: Length = Field(description="length [m]")
    section: SectionBlock = Field(description="cross section")
    material: BeamMaterial = Field(description="material")


class BeamEndsBlock(Block):
    """What holds the two ends of a beam, and forces that act across them from t = 0 on."""

    left: Annotated[End, BEAM_END] = Field(default=End("free"), description="left end, at x = 0; a force acts along +u")
    right: Annotated[End, BEAM_END] = Field(
        default=End("free"), description="right end, at x = L; a force acts along +u"
    )


class BeamBlock(ElasticBlock):
    """A straight elastic beam that bends: length, section and material, or segments."""

    kind: Literal["beam"] = Field(description="beam")
    theory: Annotated[str, words("euler_bernoulli", "timoshenko")] = Field(
        default="euler_bernoulli", description="euler_bernoulli, or timoshenko with shear and rotary inertia"
    )
    section: SectionBlock | None = Field(default=None, description="cross section")
    material: BeamMaterial | None = Field(default=None, description="material")
    segments: tuple[BeamSegmentBlock, ...] | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="uniform pieces from left to right, in place of the three",
    )
    ends: BeamEndsBlock = Field(default=BeamEndsBlock(), description="what holds the ends; free if not given")
    tension: Annotated[float, quantity("N")] = Field(default=0.0, description="axial preload [N], positive in tension")


class MassBlock(Block):
    """A rigid body."""

    kind: Literal["mass"] = Field(description="mass")
    mass: MassValue = Field(description="mass [kg]")
    velocity: Velocity = Field(default=0.0, description="velocity at t = 0 [m/s]")


class WallBlock(Block):
    """A rigid body that never moves."""

    kind: Literal["wall"] = Field(description="wall")


BodyBlock = Annotated[RodBlock | BeamBlock | MassBlock | WallBlock, Field(discriminator="kind")]


class ContactBlock(Block):
    """Two faces that may meet."""

    between: tuple[str, str] = Field(description="left and right face: body, body.left, body.right or body.at(x)")
    gap: Place = Field(default=0.0, description="gap at t = 0 [m], positive when open")
    overlap: Annotated[str | None, Allowed(words=("allowed",), nothing=True).reader()] = Field(
        default=None, description="'allowed' lets a gap be negative"
    )
    law: PartBlock | None = Field(
        default=None, description="contact law: kind and its parameters; with solve.tolerance hard contact if not given"
    )


class RoundTrips(Block):
    """A duration in round trips of a rod."""

    round_trips: Positive = Field(description="number of round trips 2L/c of the rod or beam named in round_trips_of")


class StepBlock(Block):
    """How the step is chosen; exactly one of the three."""

    points_per_period: Positive | None = Field(default=None, description="steps in the shortest period of the method")
    dt: Time | None = Field(default=None, description="step [s]")
    courant: Positive | None = Field(default=None, description="c dt/h of the mesh")


def _read_duration(value: Any) -> Any:
    if isinstance(value, RoundTrips):
        return value
    if isinstance(value, (dict, list)):
        if isinstance(value, dict) and set(value) == {"round_trips"}:
            return RoundTrips(round_trips=Allowed(limits=(("gt", 0.0),), number=True).read(value["round_trips"]))
        raise refuse(f"{shown(value)} is not a duration. Allowed: a number in s, or {{round_trips: number}}")
    return Allowed(unit="s", limits=(("gt", 0.0),), number=True).read(value)


_TRIPS = {"type": "object", "properties": {"round_trips": {"type": "number", "exclusiveMinimum": 0}}}
DURATION = Reader(
    _read_duration,
    {
        "anyOf": [
            Allowed(unit="s", limits=(("gt", 0.0),), number=True).json_schema(),
            {**_TRIPS, "required": ["round_trips"], "additionalProperties": False},
        ]
    },
)


CHOSEN = ("model", "models", "integrator", "step", "events")
"""Keys of `solve` that ``tolerance`` replaces by the automatic choice."""

TOLERANCE = Allowed(limits=(("ge", 1e-8), ("le", 0.5)), number=True, nothing=True).reader()


class SolveBlock(Block):
    """How the scene is solved. All keys but the duration have defaults."""

    duration: Annotated[Any, DURATION] = Field(description="length of the run: seconds, or {round_trips: number}")
    round_trips_of: str | None = Field(default=None, description="whose 2L/c is the round trip; the first rod or beam")
    tolerance: Annotated[float | None, TOLERANCE] = Field(
        default=None,
        description="relative error allowed: model, integrator, step, events and the law of hard contacts are then "
        "chosen automatically",
    )
    tolerance_on: tuple[Annotated[str, words(*COUNTED)], ...] = Field(
        default=COUNTED,
        min_length=1,
        description="quantities whose largest relative error the tolerance bounds; peak forces are compared away from "
        "jumps of the force, by 0.05 T",
    )
    model: PartBlock = Field(
        default={"kind": "modal", "elements": 100, "modes": 40}, description="description of the rods and beams"
    )
    models: dict[Name, PartBlock] = Field(default={}, description="description of single rods and beams, by name")
    integrator: PartBlock | None = Field(default=None, description="time integrator; newmark if not given")
    step: StepBlock = Field(default=StepBlock(points_per_period=10.0), description="step; ten points per period")
    events: Annotated[str, words("dated", "located")] = Field(
        default="dated", description="dated: whole steps, times interpolated; located: steps are cut at events"
    )
    records: Records = Field(
        default=RECORDS, description="instants kept; of more steps every second, third ... is kept, events all"
    )


class ProbeBlock(Block):
    """A quantity at a place, recorded over the run."""

    body: str = Field(description="name of the body")
    at: Place = Field(default=0.0, description="x from the left end [m]")
    quantity: Annotated[str, words(*QUANTITIES)] = Field(
        description=f"of a rod {', '.join(QUANTITIES_OF_ROD)}; of a beam {', '.join(QUANTITIES_OF_BEAM)}"
    )


class CaseBlock(Block):
    """A case: bodies, contacts, how to solve them, what to record."""

    schema_version: Literal[1] = Field(description="version of the format: 1")
    title: Text = Field(default="", description="one line on what the case is")
    source: Text = Field(default="", description="where it comes from: a text, or a key of citations.bib")
    bodies: dict[Name, BodyBlock] = Field(min_length=1, max_length=100, description="bodies by name")
    contacts: tuple[ContactBlock, ...] = Field(default=(), max_length=100, description="pairs of faces that may meet")
    solve: SolveBlock = Field(description="how to solve")
    gravity: Annotated[float, quantity("m/s2")] = Field(
        default=0.0, description="gravity [m/s2], along +x, of beams along +u"
    )
    probes: tuple[ProbeBlock, ...] = Field(default=(), max_length=1000, description="what to record")
    snapshots: tuple[Instant, ...] = Field(default=(), max_length=10000, description="times of fields [s]")
    metrics: tuple[Name, ...] = Field(
        default=(), max_length=100, description="metrics of plugins to measure; impactlab's own are always measured"
    )
    methods: dict[Name, dict[str, Any]] = Field(
        default={}, max_length=1000, description="named ways to solve it: {dotted.path: value} each"
    )
    variants: dict[Name, dict[str, Any]] = Field(
        default={}, max_length=1000, description="named scenes beside the one written: {dotted.path: value} each"
    )
