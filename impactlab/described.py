"""The same physics under another description: other models, integrator and step, other laws for hard contact."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from typing import Any

from impactlab.contact.base import AbstractContactLaw
from impactlab.integrators.base import AbstractScheme
from impactlab.models.base import AbstractRodModel
from impactlab.scene import Beam, Body, Contact, ElasticBody, Mass, Point, Probe, Rod, Scene, Segment, StepRule, Wall
from impactlab.types import Relative

SAME_PLACE = 1e-9  # of a segment: a contact this near to its end is on it


def described(
    scene: Scene,
    model: AbstractRodModel,
    integrator: AbstractScheme | None,
    step: StepRule,
    law: AbstractContactLaw | None = None,
    events: Any = "dated",
) -> Scene:
    """Return the scene with all elastic bodies under one model; ``law`` stands for every hard contact."""
    bodies = {
        name: dataclasses.replace(body, model=model) if isinstance(body, ElasticBody) else body
        for name, body in scene.bodies.items()
    }
    contacts = tuple(
        dataclasses.replace(contact, law=law if contact.law.hard and law is not None else law_in_si(scene, contact))
        for contact in scene.contacts
    )
    return dataclasses.replace(
        scene, bodies=bodies, contacts=contacts, integrator=integrator, step=step, events=events, tolerance=None
    )


def law_in_si(scene: Scene, contact: Contact) -> AbstractContactLaw:
    """Return the law of a contact free of the description of its bodies: a relative stiffness in N/m."""
    if not is_relative(contact):
        return contact.law
    from impactlab.contact.penalty import Penalty
    from impactlab.sides import side_facts

    constants = contact.law.spring(side_facts(scene, contact.left), side_facts(scene, contact.right), math.nan)
    return contact.law if constants is None else Penalty(*constants)


def is_relative(contact: Contact) -> bool:
    """Return whether the law of a contact refers to the elements of its bodies."""
    fields = dataclasses.fields(contact.law)  # type: ignore[arg-type] # laws are dataclasses
    return any(isinstance(getattr(contact.law, field.name), Relative) for field in fields)


def without_places(scene: Scene) -> Scene:
    """Return the scene with only those probes that ends of rods and masses answer, and without snapshots."""
    probes = tuple(
        probe
        for probe in scene.probes
        if isinstance(scene.bodies[probe.body], Mass)
        or (probe.quantity in ("displacement", "velocity") and on_end(scene.bodies[probe.body], probe))
    )
    return dataclasses.replace(scene, probes=probes, snapshots=())


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


def has_one_answer(scene: Scene) -> bool:
    """Return whether the physics of a scene says how its contacts end.

    How two masses part is a matter of a restitution, and an overlap one of a stiffness: a hard contact has neither.
    Masses that meet through one face without mass between them strike each other as two masses do. A law of impulses
    that stands for no hard contact has no force to refine.
    """
    from impactlab.exact.bonds import balanced, first_gap, massless

    hard = [number for number, contact in enumerate(scene.contacts) if contact.law.hard]
    for number in hard:
        gap, slack = first_gap(scene, number)
        if gap < -slack:
            return False
    if any(not contact.law.hard and not contact.law.answers_force for contact in scene.contacts):
        return False
    _, unknown = balanced(scene, without_second_stops(scene, hard), lambda *at: massless(*at) or bare_beam(*at))
    return not unknown


def without_second_stops(scene: Scene, hard: list[int]) -> list[int]:
    """Return contacts without those that cannot be closed while another is: of a face with room between two walls."""
    kept: list[int] = []
    room: dict[tuple[str, float, bool], float] = {}
    for number in hard:
        contact = scene.contacts[number]
        walls = [isinstance(scene.bodies[point.body], Wall) for point in (contact.left, contact.right)]
        face = contact.right if walls[0] else contact.left
        opposite = room.get((face.body, face.x, not walls[0]))
        if any(walls) and opposite is not None and contact.gap + opposite > 0.0:
            continue
        if any(walls):
            room[face.body, face.x, walls[0]] = contact.gap
        kept.append(number)
    return kept
