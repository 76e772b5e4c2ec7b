"""Scenes for the tests of the exact solver: units where c = Z = L = 1, so T = 2."""

from __future__ import annotations

import math

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.penalty import Penalty
from impactlab.scene import Contact, Mass, Rod, Segment, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.testing.scenes import CLAMPED, FREE, UNIT, face, mass_on_rod, simulation
from impactlab.testing.strategies import mirrored as seen_from_behind
from tests.reference.waves_mp import Struck

HARD = AdditionDeletion()


def rod(name="rod", length=1.0, z=1.0, left=FREE, right=FREE, velocity=0.0, displacement=None):
    """A rod of wave speed 1 and impedance z."""
    return Rod(name, (Segment(length, 1.0, z, z),), left, right, velocity, displacement)


def point(body, side="left"):
    """The face of a body at its left or right end."""
    return face(body, body.length if side == "right" else 0.0)


def scene(bodies, contacts, duration, gravity=0.0, round_trip=2.0, probes=()) -> Simulation:
    """A scene of bodies and (left point, right point, gap, law)."""
    return simulation(
        "test", {body.name: body for body in bodies},
        tuple(Contact(a, b, gap, gap < 0.0) for a, b, gap, _ in contacts),
        duration, None, StepRule(dt=1.0), gravity=gravity, round_trip=round_trip, probes=tuple(probes),
        law=[law for *_, law in contacts],
    )  # fmt: skip


def struck(alpha, duration, far=CLAMPED, law=None, mirrored=False, probes=()) -> Simulation:
    """The paper's scene in units T = 2, Z = 1, rod mass 1: a mass 1/alpha strikes the rod's bare end."""
    fields = {"segments": (UNIT,), "right": far, "mass_ratio": 1.0 / alpha, "duration": duration}
    made = mass_on_rod(None, law or HARD, probes=tuple(probes), **fields)
    return seen_from_behind(made) if mirrored else made


def name_of(history):
    """The only contact of a history."""
    return history.scene.contacts[0].name


def same_as(given: Struck) -> Simulation:
    """A scene of the reference in high precision."""
    behind = CLAMPED if given.wall is None else FREE
    bar = Rod("rod", (Segment(*map(float, (given.length, given.area, given.modulus, given.density))),), FREE, behind)
    hammer = Mass("hammer", float(given.mass), float(given.velocity))
    law = HARD if given.stiffness is None else Penalty(float(given.stiffness), float(given.damping))
    bodies, contacts = [hammer, bar], [(point(hammer), point(bar), float(given.gap), law)]
    if given.wall not in (None, math.inf):
        bodies.append(Wall("wall"))
        contacts.append((point(bar, "right"), point(bodies[-1]), float(given.wall), HARD))
    return scene(bodies, contacts, float(given.duration), round_trip=bar.round_trip)
