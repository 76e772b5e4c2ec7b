"""The case format, version 1: the allowed keys and their units, without those of parts."""

from __future__ import annotations

import numbers
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, ValidationInfo, field_validator, model_validator

from impactlab.casefile.blocks.beams import BeamBlock
from impactlab.casefile.blocks.links import ALONG, LinkBlock, MechanismBlock
from impactlab.casefile.blocks.repeat import MAX_REPEAT
from impactlab.casefile.blocks.rods import RodBlock
from impactlab.casefile.blocks.rotation import RotationBlock
from impactlab.casefile.blocks.shafts import ShaftBlock
from impactlab.casefile.blocks.shared import (
    REPEAT,
    Block,
    Instant,
    Length,
    MassValue,
    Name,
    Place,
    Positive,
    Records,
    Repeat,
    Text,
    Time,
    Velocity,
    rotation_values,
)
from impactlab.casefile.text.words import shown
from impactlab.casefile.values.faults import refuse
from impactlab.casefile.values.fields import Allowed, Reader, object_schema, positive, quantity, whole, words
from impactlab.casefile.values.units import strain_of
from impactlab.errors import CaseError
from impactlab.history.units import UNITS
from impactlab.scene.bodies import Body
from impactlab.scene.method import COUNTED
from impactlab.scene.problem import RECORDS

KINDS = {"rod": RodBlock.quantities, "beam": BeamBlock.quantities, "shaft": ShaftBlock.quantities}
QUANTITIES = tuple(dict.fromkeys(quantity for quantities in KINDS.values() for quantity in quantities))


def _read_block(value: Any) -> dict[str, Any]:
    if isinstance(value, dict) and isinstance(value.get("kind"), str):
        return value
    if value is None:
        raise refuse("null is given where a block is needed. Write {kind: name, ...}, or leave the key out")
    if isinstance(value, str):
        raise refuse(f"{shown(value)} is given where a block is needed. Write {{kind: {value[:30]}}}")
    raise refuse(f"{shown(value)} has no kind. Write {{kind: name, ...}} (see `impactlab plugins` for the names)")


PartBlock = Annotated[
    dict[str, Any], Reader(_read_block, {"type": "object", "properties": {"kind": {"type": "string"}}})
]
"""A part: its kind, and parameters that are read by the part's own fields in a second pass."""


class MassBlock(Block):
    """A rigid body."""

    kind: Literal["mass"] = Field(description="mass")
    mass: MassValue = Field(description="mass [kg]")
    velocity: Velocity = Field(0.0, description="velocity at t = 0 [m/s]")
    rotation: RotationBlock | None = Field(None, description="steady rotation; none if not given")
    repeat: Repeat = REPEAT

    def described(self, body: Body) -> dict[str, Any]:
        """Return the block of a body in SI."""
        return {"kind": "mass", "mass": body.rigid_mass, "velocity": body.velocity, **rotation_values(body.rotation)}


class WallBlock(Block):
    """A rigid body that never moves."""

    kind: Literal["wall"] = Field(description="wall")
    repeat: Repeat = REPEAT

    @model_validator(mode="before")
    @classmethod
    def _turns_with_the_frame(cls, given: Any) -> Any:
        if isinstance(given, dict) and "rotation" in given:
            raise refuse("a wall has no rotation of its own: it turns with the bodies that it meets. Remove the key")
        return given

    def described(self, body: Body) -> dict[str, Any]:
        """Return the block of a body in SI."""
        return {"kind": "wall"}


BodyBlock = Annotated[
    RodBlock | BeamBlock | ShaftBlock | MassBlock | WallBlock | LinkBlock, Field(discriminator="kind")
]


class ContactBlock(Block):
    """Two faces that may meet."""

    between: tuple[str, str] = Field(
        description="left and right face: body, body.left, body.right, body.at(x) or body.along(from, to)"
    )
    gap: Place = Field(0.0, description="gap at t = 0 [m], positive when open")
    lever_arm: Length | None = Field(
        None, description="distance of the contact from the axis of the shaft that it turns [m]"
    )
    along: Annotated[Any, ALONG] = Field(
        None, description="direction of a contact on a mechanism: x, y or [cos, sin], fixed in space"
    )
    pieces: Annotated[int | None, whole(nothing=True, ge=1, le=400)] = Field(
        None, description="number of equal pieces of a contact along a body, body.along(from, to)"
    )
    name: Name | None = Field(
        None, description="name of the sum of its forces, force:NAME; contacts of one name are summed"
    )
    overlap: Annotated[str | None, words("allowed", nothing=True)] = Field(
        None, description="'allowed' lets a gap be negative"
    )
    law: PartBlock | None = Field(
        None, description="contact law: kind and its parameters; with solve.tolerance hard contact if not given"
    )
    repeat: Repeat = REPEAT
    chain: tuple[str, ...] | None = Field(
        None,
        min_length=1,
        description="bodies from left to right in place of between: a contact of each with the next; the name of a "
        "repeated block stands for all its bodies",
    )


class RoundTrips(Block):
    """A duration in round trips of a rod."""

    round_trips: Positive = Field(description="number of round trips 2L/c of the rod or beam named in round_trips_of")


class StepBlock(Block):
    """How the step is chosen; exactly one of the three."""

    points_per_period: Positive | None = Field(None, description="steps in the shortest period of the method")
    dt: Time | None = Field(None, description="step [s]")
    courant: Positive | None = Field(None, description="c dt/h of the mesh, the largest of its elements")


_SECONDS = positive("s")


def _read_duration(value: Any) -> Any:
    if isinstance(value, (dict, list)):
        if isinstance(value, dict) and set(value) == {"round_trips"}:
            return RoundTrips(round_trips=positive("1").read(value["round_trips"]))
        text = f"{shown(value)} is not a duration. Allowed: a number in s, or {{round_trips: number}}"
        if isinstance(value, dict) and "round_trips_of" in value:
            text += "; round_trips_of stands beside duration, in solve"
        raise refuse(text)
    return _SECONDS.read(value)


_TRIPS = object_schema({"round_trips": {"type": "number", "exclusiveMinimum": 0}}, "round_trips")
DURATION = Reader(_read_duration, {"anyOf": [_SECONDS.json_schema(), _TRIPS]})


CHOSEN = ("model", "models", "integrator", "step", "events")
"""Keys of `solve` that ``tolerance`` replaces by the automatic choice."""

TOLERANCE = quantity("1", nothing=True, ge=1e-8, le=0.5)


class SolveBlock(Block):
    """How the scene is solved. All keys but the duration have defaults."""

    duration: Annotated[Any, DURATION] = Field(description="length of the run [s], or {round_trips: number}")
    round_trips_of: str | None = Field(
        None, description="body whose 2L/c is the round trip; by default the first rod or beam"
    )
    tolerance: Annotated[float | None, TOLERANCE] = Field(
        None,
        description="relative error allowed: model, integrator, step, events and the law of hard contacts are then "
        "chosen automatically",
    )
    tolerance_on: tuple[Annotated[str, words(*COUNTED)], ...] = Field(
        COUNTED,
        min_length=1,
        description="quantities whose largest relative error the tolerance bounds; peak forces are compared away from "
        "jumps of the force, by 0.05 T",
    )
    model: PartBlock = Field(
        {"kind": "modal", "elements": 100, "modes": 40}, description="description of the rods and beams"
    )
    models: dict[Name, PartBlock] = Field({}, description="description of single rods and beams, by name")
    integrator: PartBlock | None = Field(None, description="time integrator; newmark if not given")
    step: StepBlock = Field(StepBlock(points_per_period=10.0), description="step; ten points per period")
    events: Annotated[Literal["dated", "located"], words("dated", "located")] = Field(
        "dated", description="dated: whole steps, times interpolated; located: steps are cut at events"
    )
    records: Records = Field(
        RECORDS,
        description=(
            "number of instants kept. Of more steps every second, third ... is kept, and all events. "
            "By default 20000; with more than about 350 bodies as many as fit into 0.9 GB; of rows "
            "of beads one in 32 steps, or as many as fit into 2 MB if these are more, and at least "
            "100"
        ),
    )


def _of_probe(value: Any) -> Any:
    """Return a number, or a number with a unit, as it stands.

    Its unit is that of the quantity of the probe.
    """
    if isinstance(value, bool) or not (value is None or isinstance(value, (str, numbers.Real))):
        raise refuse(f"{shown(value)} is not allowed here. Allowed: a number in the unit of the quantity")
    return value


_SCHEMA_OF_PROBE = {"anyOf": [{"type": "number"}, {"type": "string"}, {"type": "null"}]}
_HERTZ, _METRES = quantity("Hz", nothing=True, gt=0.0), quantity("m", nothing=True, gt=0.0)


class ProbeBlock(Block):
    """A quantity at a place, recorded over the run, and perhaps measured.

    It is measured with one of the keys from length on.
    """

    body: str = Field(description="name of the body")
    at: Place = Field(0.0, description="x from the left end [m]")
    quantity: Annotated[str, words(*QUANTITIES)] = Field(
        description="; ".join(f"of a {kind} {', '.join(quantities)}" for kind, quantities in KINDS.items())
    )
    length: Annotated[float | None, _METRES] = Field(
        None, description="length of a strain gauge, its middle at the probe [m]: the mean over it is measured"
    )
    bandwidth: Annotated[float | None, _HERTZ] = Field(
        None, description="frequency at which a Gaussian low-pass without delay is 3 dB down [Hz]"
    )
    rate: Annotated[float | None, _HERTZ] = Field(
        None, description="samples per second [Hz]; that of the run's records if not given"
    )
    noise: Annotated[Any, Reader(_of_probe, _SCHEMA_OF_PROBE)] = Field(
        None, description="standard deviation of each sample, in the unit of the quantity"
    )
    seed: Annotated[int | None, whole(nothing=True, ge=0)] = Field(
        None, description="seed of the noise; 0 if not given"
    )
    bits: Annotated[int | None, whole(nothing=True, ge=1, le=32)] = Field(
        None, description="bits of the converter, over its range"
    )
    range: Annotated[Any, Reader(_of_probe, _SCHEMA_OF_PROBE)] = Field(
        None, description="full scale of the converter, from -range to range, in the unit of the quantity"
    )
    repeat: Repeat = REPEAT

    @field_validator("noise", "range")
    @classmethod
    def _in_unit_of_quantity(cls, value: Any, info: ValidationInfo) -> Any:
        limit: tuple[str, float] = ("ge" if info.field_name == "noise" else "gt", 0.0)
        quantity = info.data.get("quantity", "")
        unit = UNITS.get(quantity, "1")
        if quantity == "strain" and isinstance(value, str):
            try:
                value = strain_of(value)
            except ValueError as error:
                raise refuse(str(error)) from None
        return Allowed(unit, (limit,), number=True, nothing=True).read(value)


MAX_SNAPSHOTS = 10_000


class Frames(Block):
    """Equal instants of fields over the whole run; exactly one of the two."""

    every: Time | None = Field(None, description="time between two of them [s]")
    count: Annotated[int, whole(ge=1, le=MAX_SNAPSHOTS)] | None = Field(
        None, description="number of equal parts of the run, with fields at their ends"
    )

    def times(self, duration: float) -> tuple[float, ...]:
        """Return the instants, from 0 to at most the duration [s].

        Raises `CaseError` where they are too many.
        """
        if self.every is None:
            count = self.count or 1
            return tuple(duration * number / count for number in range(count + 1))
        parts = duration / self.every * (1.0 + 1e-12)
        if not 1.0 <= parts <= MAX_SNAPSHOTS:
            raise CaseError(
                f"every {self.every:g} s gives {parts:.6g} snapshots in {duration:g} s. Allowed: 1 to {MAX_SNAPSHOTS}",
                remedy="Give another time, or a count.",
                path="snapshots.every",
            )
        return tuple(min(self.every * number, duration) for number in range(int(parts) + 1))


_G = Allowed("m/s2", number=True)


def _gravity(value: Any) -> Any:
    """Return gravity as a number or as (x, y), in m/s2."""
    if not isinstance(value, (list, tuple)):
        return _G.read(value)
    if len(value) != 2:
        raise refuse(f"{shown(value)} is not a valid gravity. Allowed: a number in m/s2, or [x, y] with mechanisms")
    return tuple(_G.read(each) for each in value)


GRAVITY = Reader(
    _gravity,
    {"anyOf": [_G.json_schema(), {"type": "array", "items": _G.json_schema(), "minItems": 2, "maxItems": 2}]},
)  # fmt: skip


def _no_truth(version: Any) -> Any:
    """Return a version as given, or refuse true, which is equal to 1."""
    if isinstance(version, bool):
        raise refuse(f"{shown(version)} is not allowed here. Allowed: 1")
    return version


class CaseBlock(Block):
    """A case: bodies, contacts, how to solve them, quantities to record."""

    schema_version: Annotated[Literal[1], BeforeValidator(_no_truth)] = Field(description="version of the format: 1")
    title: Text = Field("", description="title of the case, one line")
    source: Text = Field("", description="source of the case: free text, or a key of citations.bib")
    bodies: dict[Name, BodyBlock] = Field(min_length=1, max_length=MAX_REPEAT, description="bodies by name")
    contacts: tuple[ContactBlock, ...] = Field((), max_length=MAX_REPEAT, description="pairs of faces that may meet")
    solve: SolveBlock = Field(description="how to solve")
    mechanisms: dict[
        Name,
        Annotated[
            Annotated[MechanismBlock, Tag("chain")] | Annotated[PartBlock, Tag("part")],
            Discriminator(lambda value: "part" if isinstance(value, dict) and "kind" in value else "chain"),
        ],
    ] = Field({}, max_length=100, description="chains of links, or parts with their kind and parameters, by name")
    gravity: Annotated[Any, GRAVITY] = Field(
        0.0, description="gravity [m/s2], along +x, of beams along +u; [x, y] with mechanisms"
    )
    probes: tuple[ProbeBlock, ...] = Field((), max_length=MAX_REPEAT, description="quantities to record")
    snapshots: Annotated[
        Annotated[tuple[Instant, ...], Tag("times"), Field(max_length=MAX_SNAPSHOTS)] | Annotated[Frames, Tag("equal")],
        Discriminator(lambda value: "equal" if isinstance(value, (dict, Frames)) else "times"),
    ] = Field((), description="times of fields [s]: a list of them, {every: time} or {count: number of parts}")
    metrics: tuple[Name, ...] = Field(
        (), max_length=100, description="metrics of plugins to measure; impactlab's own are always measured"
    )
    methods: dict[Name, dict[str, Any]] = Field(
        {}, max_length=1000, description="named ways to solve it: {dotted.path: value} each"
    )
    variants: dict[Name, dict[str, Any]] = Field(
        {}, max_length=1000, description="named scenes beside the one written: {dotted.path: value} each"
    )
