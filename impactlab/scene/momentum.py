"""The balance of momentum: what a body was given by contacts and loads against what it has."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from impactlab.scene.bodies import Body, ElasticBody, Mass
from impactlab.scene.problem import Scene


class Seen(NamedTuple):
    """What is known of the motion of a body over a run."""

    start: float  # N s
    end: float  # N s
    largest: float  # N s, of its size
    energy: float  # J, the largest


class Balance(NamedTuple):
    """What a body was given, and how its momentum changed."""

    given: float  # N s
    changed: float  # N s
    scale: float  # N s, the momentum in play

    @property
    def error(self) -> float:
        """How far the two are apart, over the momentum in play."""
        return abs(self.changed - self.given) / self.scale if self.scale > 0.0 else 0.0


def is_free(body: Body) -> bool:
    """Return whether only contacts and loads change the momentum of a body; damping by its mass holds it, too."""
    if isinstance(body, ElasticBody):
        return not body.is_held and body.damping.mass == 0.0
    return isinstance(body, Mass)


def moving_mass(body: Body) -> float:
    """Return the mass that the momentum of a body moves [kg], with what rides on its ends; inf of a wall."""
    if isinstance(body, ElasticBody):
        return body.mass + sum(end.value for end in (body.left, body.right) if end.kind == "mass")
    return body.mass if isinstance(body, Mass) else math.inf


def balance(scene: Scene, name: str, impulses: Sequence[float], time: float, seen: Seen) -> Balance:
    """Return the balance of a free body over [0, time].

    The momentum in play is the largest |p|, plus the impulses of its contacts and loads, plus sqrt(2 m E), which bounds
    what the waves of a body hold: it may be far more than its momentum as a whole.

    Parameters
    ----------
    scene : Scene
    name : str
        Of the body; see `is_free`.
    impulses : sequence of float
        Impulse of each contact so far [N s].
    time : float
        s
    seen : Seen
        Of the body, over that time.
    """
    body = scene.bodies[name]
    given = scale = 0.0
    for contact, impulse in zip(scene.contacts, impulses, strict=True):
        push = impulse * (float(contact.right.body == name) - float(contact.left.body == name))
        given, scale = given + push, scale + abs(push)
    mass = moving_mass(body)
    loads = (mass * scene.gravity + (body.end_force if isinstance(body, ElasticBody) else 0.0)) * time
    scale += abs(loads) + seen.largest + math.sqrt(2.0 * mass * seen.energy)
    return Balance(given + loads, seen.end - seen.start, scale)
