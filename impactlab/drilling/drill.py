"""The drill of a scene: hammer, rods, and the contact of bit and rock."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.bonded import Bonded
from impactlab.errors import CaseError
from impactlab.scene.problem import Contact, Scene


class Drill(NamedTuple):
    """Hammer, rods and rock of a scene, by the names of the bodies."""

    hammer: tuple[str, ...]  # bodies that move at t = 0
    rods: tuple[str, ...]  # all others that can move: rods, couplings, the bit
    rock: Contact
    kinetic_energy: float  # J, of the hammer at t = 0
    round_trip: float  # s, of a wave from the bit to the nearest joint that can open, and back


def drill_of(scene: Scene, laws: Mapping[str, AbstractContactLaw]) -> Drill:
    """Return the drill of a scene.

    The hammer moves at t = 0, the rock is the wall that the last of the others meets.

    Raises
    ------
    CaseError
        If nothing moves at t = 0, or not exactly one contact is with a wall.
    """
    hammer = tuple(name for name, body in scene.bodies.items() if body.velocity != 0.0)
    rods = tuple(name for name, body in scene.bodies.items() if body.moves and name not in hammer)
    walls = [c for c in scene.contacts if not all(scene.bodies[p.body].moves for p in c.faces)]
    if not hammer:
        text, remedy = "no body moves at t = 0, so there is no hammer", "Give the hammer a velocity."
        raise CaseError(text, remedy=remedy, path="bodies")
    if len(walls) != 1:
        raise CaseError(
            f"{len(walls)} contacts are with a wall; the one of bit and rock must be the only one",
            remedy="Let the bit meet one wall, the rock, with the law bilinear.",
            path="contacts",
        )
    kinetic = sum(0.5 * (body := scene.bodies[name]).moving_mass * body.velocity**2 for name in hammer)
    return Drill(hammer, rods, walls[0], kinetic, _round_trip(scene, laws, walls[0], rods))


def _round_trip(scene: Scene, laws: Mapping[str, AbstractContactLaw], rock: Contact, rods: tuple[str, ...]) -> float:
    """Return the round trip of a wave from the bit to the nearest joint [s].

    The joint can open: rods with a `bonded` joint are one rod; a rigid bit or adapter has no travel time.
    """
    trip, joined = 0.0, set[str]()
    ahead = [face.body for face in rock.faces]
    while ahead:
        name = ahead.pop()
        if name in joined or name not in rods:
            continue
        joined.add(name)
        if name in scene.elastic:
            trip += scene.elastic[name].round_trip
        for contact in scene.contacts:
            bodies = [face.body for face in contact.faces]
            if contact != rock and name in bodies and (trip == 0.0 or isinstance(laws[contact.name], Bonded)):
                ahead += bodies
    return trip
