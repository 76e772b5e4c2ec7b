"""What a contact law may know of its two sides before the run."""

from __future__ import annotations

import math
from typing import TypeVar

from impactlab.scene import Beam, ElasticBody, Point, Rod, Scene, Segment, Wall
from impactlab.types import SideFacts

Piece = TypeVar("Piece", bound=Segment)

LENGTHS = 100  # elements that a body without a description of its own counts as


def segment_at(segments: tuple[Piece, ...], x: float) -> Piece:
    """Return the segment that holds x [m]; at a boundary the right one, at the right end the last."""
    start = 0.0
    for segment in segments:
        start += segment.length
        if x < start:
            return segment
    return segments[-1]


def element_length(body: ElasticBody) -> float:
    """Return h of the body's description [m]."""
    return body.length / LENGTHS if body.model is None else body.model.element_length(body)


def side_facts(scene: Scene, point: Point, velocity_per_force: float = math.nan) -> SideFacts:
    """Return the facts of one side; room for a reading exists at the ends of a rod only."""
    body, nan = scene.bodies[point.body], math.nan
    if not isinstance(body, Rod | Beam):
        kind, mass = ("wall", math.inf) if isinstance(body, Wall) else ("mass", body.mass)
        facts = SideFacts(kind, nan, nan, nan, nan, nan, mass, scene.gravity)
        return facts._replace(velocity_per_force=velocity_per_force)
    inner = 0.0 < point.x < body.length
    end = "inner" if inner else (body.left if point.x == 0.0 else body.right).carries
    if isinstance(body, Beam):
        return _on_beam(scene, body, point.x, end)._replace(velocity_per_force=velocity_per_force)
    segment = segment_at(body.segments, point.x)
    return SideFacts(
        kind="rod",
        impedance=nan if inner else segment.impedance,
        wave_speed=segment.wave_speed,
        area=segment.area,
        element_stiffness=segment.young * segment.area / element_length(body),
        room=nan if inner else segment.length,
        mass=body.mass,
        gravity=scene.gravity,
        end=end,
        velocity_per_force=velocity_per_force,
    )


def _on_beam(scene: Scene, beam: Beam, x: float, end: str) -> SideFacts:
    """Return the facts of a place on a beam; it has an impedance where it shears, in each direction that goes on."""
    segment = segment_at(beam.segments, x)
    sheared = math.isfinite(segment.shear_stiffness)
    ways = 2.0 if end in ("inner", "infinite") else 1.0
    return SideFacts(
        kind="beam",
        impedance=ways * segment.shear_impedance if sheared else math.nan,
        wave_speed=segment.shear_speed if sheared else math.nan,
        area=segment.area,
        element_stiffness=12.0 * segment.bending_stiffness / element_length(beam) ** 3,
        room=math.nan,
        mass=beam.mass,
        gravity=scene.gravity,
        end=end,
    )
