"""Facts of a scene: rods and beams, impedance and striker of a contact.

Laws get the facts of their two sides as `SideFacts`; the impedance and masses here are for checks, warnings and
the automatic choice.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from impactlab.scene.bodies import Beam, Body, Segment, beams_among
from impactlab.scene.problem import Contact, Point, Probe, Scene
from impactlab.types import SideFacts

MAX_PARTS = 12  # of the shortest segment, into which a common unit of delays may divide it
SAME_PLACE = 1e-9  # of a segment: a contact this near to its end is on it


def beams_of(scene: Scene) -> list[Beam]:
    """Return the beams of a scene."""
    return beams_among(scene.elastic.values()) if scene.elastic else []


def is_lossy(beam: Beam) -> bool:
    """Return whether a beam or its ends lose energy, which exact modes leave out."""
    return beam.is_damped or any(end.kind in ("dashpot", "infinite") for end in (beam.left, beam.right))


def changes(scene: Scene) -> bool:
    """Return whether a scene has a mechanism, whose matrices change as it moves."""
    return any(body.changes for body in scene.bodies.values())


def on_end(body: Body, point: Point | Probe) -> bool:
    """Return whether a place is no inner point of a rod or a beam."""
    return point.x in (0.0, body.length)


def split_at_contacts(scene: Scene) -> Scene:
    """Return the scene with segments cut at inner contacts, so that meshes have nodes there.

    A force inside an element moves its place by too little, in a bar or by shear: the compliance that is missing is of
    the first order in the length of the element, and depends on where in it the force acts.
    """
    cut: dict[str, Body] = {}
    for body in scene.elastic.values():
        places = sorted({point.x for point in scene.faces if point.body == body.name and not on_end(body, point)})
        if places:
            cut[body.name] = dataclasses.replace(body, segments=tuple(cut_at(body.segments, places)))
    # The same scene where nothing is cut: all that was found of it is still known.
    return dataclasses.replace(scene, bodies=dict(scene.bodies) | cut) if cut else scene


def cut_at(segments: Sequence[Segment], places: Sequence[float]) -> Iterator[Any]:
    """Yield the segments cut at rising places along the body [m], each of its own kind."""
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
    return min((0.5 * rod.round_trip for rod in scene.wave_bodies), default=math.inf)


class RoundTrip(NamedTuple):
    """The time of a wave to the far end of a body and back [s]."""

    time: float
    body: str


def round_trips_of(scene: Scene, contacts: Iterable[Contact]) -> dict[str, RoundTrip]:
    """Return the round trip by which the times of each contact are measured, by its name.

    It is that of the shorter of its two bodies, which parts first. Between rigid bodies it is the shortest of the
    scene. So it depends neither on the order of bodies nor on sides. Empty without a rod or beam.
    """
    known = {name: RoundTrip(body.round_trip, name) for name, body in scene.elastic.items()}
    if not known:
        return {}
    shortest, found = min(known.values()), dict[str, RoundTrip]()
    for contact in contacts:
        found[contact.name] = min(
            (known[point.body] for point in contact.faces if point.body in known), default=shortest
        )
    return found


def is_a_delay_line(scene: Scene) -> bool:
    """Return whether the stepped delay line supports the rods of a scene."""
    rods = scene.wave_bodies
    plain = not scene.gravity and not any(rod.is_damped or len(rod.segments) > 1 or rod.rotation for rod in rods)
    return bool(rods) and plain and all(on_end(scene.bodies[point.body], point) for point in scene.faces)


def delay_unit(scene: Scene) -> float | None:
    """Return the longest time that divides all segments' transit times [s], or None.

    With steps that divide it a delay line of several segments has all its places on the grid.
    """
    rods = scene.wave_bodies
    if not rods or any(rod.is_damped or rod.rotation for rod in rods):
        return None
    transits = [segment.length / segment.wave_speed for rod in rods for segment in rod.segments]
    shortest = min(transits)
    for parts in range(1, MAX_PARTS + 1):
        counts = [parts * transit / shortest for transit in transits]
        if all(abs(count - round(count)) <= SAME_PLACE * count for count in counts):
            return shortest / parts
    return None


def bare_beam(scene: Scene, point: Point) -> bool:
    """Return whether the face of a contact is a beam that carries no mass there."""
    body = scene.bodies[point.body]
    ends = [end for x, end in body.ends if x == point.x]
    return body.bends and not any(end.kind == "mass" and end.value > 0.0 for end in ends)


def facts_at(
    scene: Scene,
    point: Point,
    element_length: float,
    velocity_per_force: float = math.nan,
    left_out: float = 0.0,
    flexibility: float = 0.0,
) -> SideFacts:
    """Return the facts of one side of a contact, for elements of a length [m].

    Room for a reading exists at the ends of a rod only. The last three are those of the body that a model built.
    """
    body = scene.bodies[point.body]
    facts = body.side_facts(point.x, element_length)
    gravity = scene.gravity if body.falls else 0.0
    return facts._replace(
        gravity=gravity, velocity_per_force=velocity_per_force, left_out=left_out, flexibility=flexibility
    )


def field_acceleration(scene: Scene) -> float:
    """Return the largest acceleration by gravity, or by rotation of masses [m/s2]."""
    found = [abs(scene.gravity)]
    for body in scene.bodies.values():
        if body.rotation is not None and body.elastic is None:
            found.append(body.softening * abs(body.rotation.axis_at))
    return max(found)


def steady_facts(scene: Scene) -> dict[str, dict[str, Any]]:
    """Return the steady state of each rotating body by name in SI units, ready for JSON."""
    facts: dict[str, dict[str, Any]] = {}
    for name, body in scene.bodies.items():
        if body.rotation is None:
            continue
        facts[name] = {"rate": body.rotation.rate, "plane": body.rotation.plane}
        if (state := body.steady) is not None:
            tip = max(map(abs, state.radii))
            facts[name] |= {"tip_radius": tip, "stretch": state.stretch, "root_stress": state.root_stress}
        elif body.rotation.plane == "axial":
            facts[name] |= {"radius": abs(body.rotation.axis_at)}
    return facts


def impedance_of(scene: Scene, contact: Contact) -> float:
    """Return the impedance [N s/m] of a contact's rods in series; inf without one."""
    compliances = sum(1.0 / scene.bodies[point.body].impedance_at(point.x) for point in contact.faces)
    return math.inf if compliances == 0.0 else 1.0 / compliances


def striker_of(scene: Scene, contact: Contact) -> float:
    """Return the reduced mass [kg] of a contact's rigid bodies; inf without one."""
    masses = [scene.bodies[point.body].rigid_mass for point in contact.faces]
    shares = sum(1.0 / mass for mass in masses if math.isfinite(mass))
    return 1.0 / shares if shares > 0.0 else math.inf


def moving_faces(scene: Scene, *points: Point) -> Iterator[str]:
    """Yield the channels of the displacements of faces that can move."""
    for point in points:
        body = scene.bodies[point.body]
        if body.moves:
            yield body.face_channel(point.x)
