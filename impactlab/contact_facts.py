"""What a contact works with and against: its stiffness, the impedance and the masses behind its faces."""

from __future__ import annotations

import math
from collections.abc import Iterator

from impactlab.scene import Contact, ElasticBody, Mass, Point, Rod, Scene
from impactlab.sides import segment_at, side_facts


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
