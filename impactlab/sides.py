"""What a contact law may know of its two sides before the run."""

from __future__ import annotations

import math

from impactlab.scene import Point, Rod, Scene, Segment, Wall
from impactlab.types import SideFacts

LENGTHS = 100  # elements that a rod without a description of its own counts as


def segment_at(rod: Rod, x: float) -> Segment:
    """Return the segment that holds x [m]; at a boundary the right one, at the right end the last."""
    start = 0.0
    for segment in rod.segments:
        start += segment.length
        if x < start:
            return segment
    return rod.segments[-1]


def element_length(rod: Rod) -> float:
    """Return h of the rod's description [m]."""
    return rod.length / LENGTHS if rod.model is None else rod.model.element_length(rod)


def side_facts(scene: Scene, point: Point, velocity_per_force: float = math.nan) -> SideFacts:
    """Return the facts of one side; impedance and room for a reading exist at the ends of a rod only."""
    body, nan = scene.bodies[point.body], math.nan
    if not isinstance(body, Rod):
        kind, mass = ("wall", math.inf) if isinstance(body, Wall) else ("mass", body.mass)
        facts = SideFacts(kind, nan, nan, nan, nan, nan, mass, scene.gravity)
        return facts._replace(velocity_per_force=velocity_per_force)
    inner = 0.0 < point.x < body.length
    segment = segment_at(body, point.x)
    return SideFacts(
        kind="rod",
        impedance=nan if inner else segment.impedance,
        wave_speed=segment.wave_speed,
        area=segment.area,
        element_stiffness=segment.young * segment.area / element_length(body),
        room=nan if inner else segment.length,
        mass=body.mass,
        gravity=scene.gravity,
        end="inner" if inner else (body.left if point.x == 0.0 else body.right).carries,
        velocity_per_force=velocity_per_force,
    )
