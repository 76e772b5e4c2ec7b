"""Questions asked of a scene: its rods and beams, and what a contact works with and against.

Laws learn of their two sides through `SideFacts`; the impedance, masses and stiffness here serve checks, warnings and
the automatic choice.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from typing import Any, TypeVar

from impactlab.scene.bodies import Beam, Body, ElasticBody, Mass, Rod, Segment, Wall
from impactlab.scene.problem import Contact, Point, Probe, Scene
from impactlab.types import SideFacts

Piece = TypeVar("Piece", bound=Segment)

SAME_PLACE = 1e-9  # of a segment: a contact this near to its end is on it
LENGTHS = 100  # elements that a body without a description of its own counts as


def rods_of(scene: Scene) -> list[Rod]:
    """Return the rods of a scene."""
    return [body for body in scene.bodies.values() if isinstance(body, Rod)]


def beams_of(scene: Scene) -> list[Beam]:
    """Return the beams of a scene."""
    return [body for body in scene.bodies.values() if isinstance(body, Beam)]


def on_end(body: Body, point: Point | Probe) -> bool:
    """Return whether a place is no inner point of a rod or a beam."""
    return not isinstance(body, ElasticBody) or point.x in (0.0, body.length)


def struck_on_ends(scene: Scene) -> bool:
    """Return whether no contact lies at an inner point of a rod."""
    points = (point for contact in scene.contacts for point in (contact.left, contact.right))
    return all(on_end(scene.bodies[point.body], point) for point in points)


def is_coupled(rod: Rod) -> bool:
    """Return whether the rod has dampers between its places, which an explicit scheme does not serve."""
    return rod.damping.stiffness > 0.0 or any(segment.viscosity > 0.0 for segment in rod.segments)


def split_at_contacts(scene: Scene) -> Scene:
    """Return the scene with segments of rods and beams cut at their inner contacts, so that meshes have nodes there.

    A force inside an element moves its place by too little, in a bar or by shear: the compliance that is missing is of
    the first order in the length of the element, and depends on where in it the force acts.
    """
    bodies = dict(scene.bodies)
    elastic: list[Rod | Beam] = [*rods_of(scene), *beams_of(scene)]
    for body in elastic:
        points = (point for contact in scene.contacts for point in (contact.left, contact.right))
        places = sorted({point.x for point in points if point.body == body.name and not on_end(body, point)})
        bodies[body.name] = dataclasses.replace(body, segments=tuple(_cut(body.segments, places)))
    return dataclasses.replace(scene, bodies=bodies)


def _cut(segments: Sequence[Segment], places: Sequence[float]) -> Iterator[Any]:
    """Give the segments, each of its own kind, cut at places along the body [m], rising."""
    start = 0.0
    for segment in segments:
        end, left = start + segment.length, segment.length
        for place in places:
            if start < place < end and SAME_PLACE * segment.length < min(place - start, end - place):
                yield dataclasses.replace(segment, length=place - start)
                start, left = place, end - place
        yield dataclasses.replace(segment, length=left)
        start = end


def shortest_transit(scene: Scene) -> float:
    """Return the time of a wave through the shortest rod [s]; inf without rods."""
    return min((0.5 * rod.round_trip for rod in rods_of(scene)), default=math.inf)


def is_a_delay_line(scene: Scene) -> bool:
    """Return whether the stepped delay line serves the rods of a scene."""
    rods = rods_of(scene)
    plain = not scene.gravity and not any(rod.is_damped or len(rod.segments) > 1 for rod in rods)
    return bool(rods) and plain and struck_on_ends(scene)


def bare_beam(scene: Scene, point: Point) -> bool:
    """Return whether the face of a contact is a beam that carries no mass there."""
    body = scene.bodies[point.body]
    if not isinstance(body, Beam):
        return False
    ends = [end for end, x in ((body.left, 0.0), (body.right, body.length)) if x == point.x]
    return not any(end.kind == "mass" and end.value > 0.0 for end in ends)


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


def stiffness_of(scene: Scene, contact: Contact) -> float | None:
    """Return the stiffness of a contact [N/m], inf where it is hard, None where it is no spring."""
    if contact.law.hard:
        return math.inf
    constants = contact.law.spring(side_facts(scene, contact.left), side_facts(scene, contact.right), math.nan)
    return None if constants is None else constants[0]


def stiffness_at(scene: Scene, contact: Contact, overlap: float) -> float | None:
    """Return how the force of a contact rises with an overlap [m] there [N/m]; None where it is not known."""
    return contact.law.stiffness_at(overlap, side_facts(scene, contact.left), side_facts(scene, contact.right))


def impedance_of(scene: Scene, contact: Contact) -> float:
    """Return the impedance that a contact works against [N s/m]: of its rods in series, inf without one."""
    yields = 0.0
    for point in (contact.left, contact.right):
        body = scene.bodies[point.body]
        if isinstance(body, Rod):
            ends = 1.0 if point.x in (0.0, body.length) else 2.0
            yields += 1.0 / (ends * segment_at(body.segments, point.x).impedance)
    return math.inf if yields == 0.0 else 1.0 / yields


def striker_of(scene: Scene, contact: Contact) -> float:
    """Return the mass of the rigid bodies of a contact as one [kg]; inf where no mass meets it."""
    bodies = [scene.bodies[point.body] for point in (contact.left, contact.right)]
    shares = sum(1.0 / body.mass for body in bodies if isinstance(body, Mass))
    return 1.0 / shares if shares > 0.0 else math.inf


def moving_faces(scene: Scene, *points: Point) -> Iterator[str]:
    """Give the channels of the displacements of faces that can move."""
    for point in points:
        body = scene.bodies[point.body]
        if isinstance(body, Mass):
            yield f"position:{point.body}"
        elif isinstance(body, ElasticBody):
            yield f"displacement:{point.body}@{point.x:.6g}"
