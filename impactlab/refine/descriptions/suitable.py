"""Descriptions that suit a scene, as far as it has a unique solution."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from impactlab.errors import CaseError, PairingError
from impactlab.exact.setup.contact_kinds import balanced, first_gap, massless
from impactlab.refine.descriptions import beam_families, beams, resting_touches, rods
from impactlab.refine.descriptions.description import Description
from impactlab.scene.facts import bare_beam, beams_of, changes
from impactlab.scene.method import Simulation, laws_of
from impactlab.scene.problem import Scene


def stepped(request: Simulation) -> list[Description]:
    """Return the descriptions that step and suit a scene; none where nothing converges."""
    return list(_stepped(request))


def _stepped(request: Simulation) -> Iterator[Description]:
    """Yield the descriptions with steps that suit a scene.

    Each is made when it is needed.
    """
    if not has_unique_solution(request):
        return
    if changes(request.scene):
        yield from rods.mechanisms(request)
    elif not beams_of(request.scene):
        yield from rods.stepped(request)
    elif not beams.is_singular(request):
        yield from beams.stepped(request)


def exact_for(request: Simulation) -> tuple[Description | None, str]:
    """Return the exact solver, or None and the reason against it.

    A scene with beams needs no reason.
    """
    if beams_of(request.scene):
        return None, ""
    try:
        return rods.exact(request), ""
    except (CaseError, PairingError) as error:
        return None, error.text


def in_turn(
    request: Simulation, served: tuple[Description | None, str] | None = None
) -> tuple[Iterator[Description], str]:
    """Return the descriptions compared, and why a preferred one is not.

    Each is made when it is needed. The one that the physics prefers is the first. ``served`` is the exact solver as
    `exact_for` has found it. Raise `CaseError` where a force has no limit as descriptions are refined.
    """
    resting_touches.check(request)
    if beams_of(request.scene) and not changes(request.scene):
        if not has_unique_solution(request):
            return iter(()), ""
        if not beams.is_singular(request):
            return beam_families.families(request), ""
        beam = beams_of(request.scene)[0].name
        return iter(()), (
            f"a hard contact on the Euler-Bernoulli beam '{beam}' has no converged solution: its faces part and meet "
            "ever more often as the description is refined"
        )
    exact, why = exact_for(request) if served is None else served
    if exact is None and not request.scene.wave_bodies and not has_unique_solution(request):
        why = "a hard contact of two masses, or a law of impulses, has no force whose error could be estimated"
    found: Iterator[Description] = iter(())
    if not any(law.two_sided for law in laws_of(*request)):  # estimates read periods of contact, which links have not
        found = (description for description in _stepped(request) if description.for_choice)
    return found if exact is None else itertools.chain((exact,), found), why


def has_unique_solution(request: Simulation) -> bool:
    """Return whether the physics of a scene determines how its contacts end.

    Two masses separate by a restitution, and an overlap ends by a stiffness: a hard contact has neither. Masses that
    meet through one face without mass between them strike each other as two masses do. A law of impulses that stands
    for no hard contact has no force to refine.
    """
    scene, laws = request.scene, laws_of(*request)
    hard = [number for number, law in enumerate(laws) if law.hard]
    if any(not law.hard and not law.answers_force for law in laws):
        return False
    if any(gap < -slack for gap, slack in (first_gap(scene, number) for number in hard)):
        return False
    _, unknown = balanced(scene, _closed_together(scene, hard), lambda *at: massless(*at) or bare_beam(*at))
    return not unknown


def _closed_together(scene: Scene, hard: list[int]) -> list[int]:
    """Return the contacts that may be closed at the same time.

    Of a face with room between two walls, only one contact is kept.
    """
    kept: list[int] = []
    room: dict[tuple[str, float, bool], float] = {}  # gap by body, place and side of its wall
    for number in hard:
        contact = scene.contacts[number]
        walls = [not scene.bodies[point.body].moves for point in contact.faces]
        face = contact.right if walls[0] else contact.left
        opposite = room.get((face.body, face.x, not walls[0]))
        if any(walls) and opposite is not None and contact.gap + opposite > 0.0:
            continue
        if any(walls):
            room[face.body, face.x, walls[0]] = contact.gap
        kept.append(number)
    return kept
