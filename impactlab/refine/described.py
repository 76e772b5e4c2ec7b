"""The same physics under another description: other models, integrator and step, other laws for hard contact."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from impactlab.contact.base import AbstractContactLaw
from impactlab.integrators.base import AbstractScheme
from impactlab.models.base import AbstractRodModel
from impactlab.scene.bodies import ElasticBody, Mass, Wall
from impactlab.scene.facts import bare_beam, on_end
from impactlab.scene.problem import Contact, Scene, StepRule
from impactlab.types import Relative


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
    from impactlab.scene.facts import side_facts

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


def has_one_answer(scene: Scene) -> bool:
    """Return whether the physics of a scene says how its contacts end.

    How two masses part is a matter of a restitution, and an overlap one of a stiffness: a hard contact has neither.
    Masses that meet through one face without mass between them strike each other as two masses do. A law of impulses
    that stands for no hard contact has no force to refine.
    """
    from impactlab.exact.contact_kinds import balanced, first_gap, massless

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
