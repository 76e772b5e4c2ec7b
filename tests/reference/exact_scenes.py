"""Scenes built by hand for the tests of the exact solver: units where c = Z = L = 1, so T = 2."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

from impactlab.contact.base import AbstractContactLaw
from impactlab.scene import Contact, End, Mass, Point, Rod, Segment, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.testing.scenes import simulation
from impactlab.types import Port, Reply, SideFacts, Start

FREE = End("free")
CLAMPED = End("clamped")


@final
@dataclass(frozen=True)
class Hard(AbstractContactLaw):
    """Hard contact, for tests."""

    needs = frozenset()
    hard: ClassVar[bool] = True

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start()

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        return


@final
@dataclass(frozen=True)
class Spring(AbstractContactLaw):
    """Kelvin-Voigt contact, for tests."""

    stiffness: float
    damping: float = 0.0
    needs = frozenset()

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start()

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        return

    def spring(self, left: SideFacts, right: SideFacts, dt: float) -> tuple[float, float]:
        return self.stiffness, self.damping


def rod(name="rod", length=1.0, z=1.0, left=FREE, right=FREE, velocity=0.0, displacement=None):
    """A rod of wave speed 1 and impedance z."""
    return Rod(name, (Segment(length, 1.0, z, z),), left, right, velocity, displacement)


def point(scene_body, side=""):
    """The face of a body: its left or right end, or a rigid body itself."""
    if side == "":
        return Point(scene_body.name, 0.0, scene_body.name)
    return Point(scene_body.name, 0.0 if side == "left" else scene_body.length, f"{scene_body.name}.{side}")


def scene(bodies, contacts, duration, gravity=0.0, round_trip=2.0, probes=()) -> Simulation:
    """A scene of bodies and (left point, right point, gap, law)."""
    return simulation(
        "test", {body.name: body for body in bodies},
        tuple(Contact(a, b, gap, gap < 0.0) for a, b, gap, _ in contacts),
        duration, None, StepRule(dt=1.0), gravity=gravity, round_trip=round_trip, probes=tuple(probes),
        law=[law for *_, law in contacts],
    )  # fmt: skip


def struck(alpha, duration, far=CLAMPED, law=None, v0=1.0, mirrored=False, probes=()):
    """The paper's scene in units T = 2, Z = 1, rod mass 1: a mass 1/alpha strikes the rod's bare end."""
    law = law if law is not None else Hard()
    if mirrored:
        bar, hammer = rod(left=far, right=FREE), Mass("hammer", 1.0 / alpha, -v0)
        return scene([bar, hammer], [(point(bar, "right"), point(hammer), 0.0, law)], duration, probes=probes)
    bar, hammer = rod(left=FREE, right=far), Mass("hammer", 1.0 / alpha, v0)
    return scene([hammer, bar], [(point(hammer), point(bar, "left"), 0.0, law)], duration, probes=probes)


def name_of(history):
    """The only contact of a history."""
    return history.scene.contacts[0].name


__all__ = ["CLAMPED", "FREE", "Hard", "Spring", "Wall", "name_of", "point", "rod", "scene", "struck"]
