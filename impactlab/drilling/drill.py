"""The drill of a scene: hammer, rods, and the contact of bit and rock."""

from __future__ import annotations

from typing import NamedTuple

from impactlab.errors import CaseError
from impactlab.scene.problem import Contact, Scene


class Drill(NamedTuple):
    """Hammer, rods and rock of a scene, by the names of the bodies."""

    hammer: tuple[str, ...]  # bodies that move at t = 0
    rods: tuple[str, ...]  # all others that can move: rods, couplings, the bit
    rock: Contact
    kinetic_energy: float  # J, of the hammer at t = 0
    round_trip: float  # s, of a wave through the rods and back


def drill_of(scene: Scene) -> Drill:
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
    trip = sum(scene.elastic[name].round_trip for name in rods if name in scene.elastic)
    return Drill(hammer, rods, walls[0], kinetic, trip)
