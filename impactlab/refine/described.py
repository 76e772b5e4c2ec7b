"""The same physics under another description: other models, integrator and step, other laws for hard contact."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.penalty import Penalty
from impactlab.exact.contact_kinds import balanced, first_gap, massless
from impactlab.integrators.base import AbstractScheme
from impactlab.models.base import AbstractRodModel
from impactlab.scene.facts import bare_beam, on_end
from impactlab.scene.method import Method, Simulation, StepRule, is_relative, laws_of, sides
from impactlab.scene.problem import Contact, Scene


def described(
    asked: Simulation,
    model: AbstractRodModel,
    integrator: AbstractScheme | None,
    step: StepRule,
    law: AbstractContactLaw | None = None,
    events: Any = "dated",
) -> Simulation:
    """Return a scene with all its elastic bodies under one model; ``law`` takes the place of every hard one."""
    models = dict.fromkeys(asked.scene.elastic, model)
    laws = {
        contact.name: law if asked.method.laws[contact.name].hard and law is not None else law_in_si(asked, contact)
        for contact in asked.scene.contacts
    }
    return Simulation(asked.scene, Method(laws, models, integrator, step, events))


def law_in_si(asked: Simulation, contact: Contact) -> AbstractContactLaw:
    """Return the law of a contact free of the models of its bodies: a relative stiffness in N/m."""
    law = asked.method.laws[contact.name]
    constants = law.spring(*sides(*asked, contact), math.nan) if is_relative(law) else None
    return law if constants is None else Penalty(*constants)


def without_places(scene: Scene) -> Scene:
    """Return the scene with only those probes that ends of rods and masses answer, and without snapshots."""
    probes = tuple(
        probe
        for probe in scene.probes
        if on_end(body := scene.bodies[probe.body], probe)
        and body.reading(probe.quantity)[0] in ("displacement", "velocity")
    )
    return dataclasses.replace(scene, probes=probes, snapshots=())


def has_one_answer(asked: Simulation) -> bool:
    """Return whether the physics of a scene says how its contacts end.

    How two masses part is a matter of a restitution, and an overlap one of a stiffness: a hard contact has neither.
    Masses that meet through one face without mass between them strike each other as two masses do. A law of impulses
    that stands for no hard contact has no force to refine.
    """
    scene, laws = asked.scene, laws_of(*asked)
    hard = [number for number, law in enumerate(laws) if law.hard]
    for number in hard:
        gap, slack = first_gap(scene, number)
        if gap < -slack:
            return False
    if any(not law.hard and not law.answers_force for law in laws):
        return False
    _, unknown = balanced(scene, without_second_stops(scene, hard), lambda *at: massless(*at) or bare_beam(*at))
    return not unknown


def without_second_stops(scene: Scene, hard: list[int]) -> list[int]:
    """Return contacts without those that cannot be closed while another is: of a face with room between two walls."""
    kept: list[int] = []
    room: dict[tuple[str, float, bool], float] = {}
    for number in hard:
        contact = scene.contacts[number]
        walls = [not scene.bodies[point.body].moves for point in (contact.left, contact.right)]
        face = contact.right if walls[0] else contact.left
        opposite = room.get((face.body, face.x, not walls[0]))
        if any(walls) and opposite is not None and contact.gap + opposite > 0.0:
            continue
        if any(walls):
            room[face.body, face.x, walls[0]] = contact.gap
        kept.append(number)
    return kept
