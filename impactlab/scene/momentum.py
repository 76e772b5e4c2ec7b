"""Momentum balance of a body: impulses of contacts and loads, change of momentum."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from impactlab.scene.problem import Scene


class BodyMomentum(NamedTuple):
    """Momentum and energy of a body over a run."""

    start: float  # N s
    end: float  # N s
    largest: float  # N s, of its size
    energy: float  # J, the largest


class MomentumBalance(NamedTuple):
    """Impulses on a body, and the change of its momentum."""

    given: float  # N s
    changed: float  # N s
    scale: float  # N s, of a sum of impulses

    @property
    def error(self) -> float:
        """Difference of the two over the scale."""
        return abs(self.changed - self.given) / self.scale if self.scale > 0.0 else 0.0


def balance(
    scene: Scene, name: str, impulses: Sequence[float], time: float, seen: BodyMomentum, loaded: float | None = None
) -> MomentumBalance:
    """Return the balance of a free body over [0, time].

    Its scale is the largest |p|, plus the impulses of its contacts and loads, plus sqrt(2 m E), which bounds
    the momentum of the waves of a body: it may be far more than its momentum as a whole.

    Parameters
    ----------
    scene : Scene
    name : str
        Of the body, which is free (`Body.is_free`).
    impulses : sequence of float
        Impulse of each contact so far [N s].
    time : float
        s
    seen : BodyMomentum
        Of the body, over that time.
    loaded : float, optional
        Impulse of its loads over time [N s], as the run has taken it; by default their integral.
    """
    body = scene.bodies[name]
    given = scale = 0.0
    for number, contact in scene.met_by(name):
        push = impulses[number] * (float(contact.right.body == name) - float(contact.left.body == name))
        given, scale = given + push, scale + abs(push)
    mass = body.moving_mass
    loads = ((mass * scene.gravity if body.falls else 0.0) + body.end_force) * time
    if loaded is None:
        times = np.array(time)
        loaded = sum(float(load.sampled(scene.duration).impulse(times)) for _, load in body.loads)
    loads += loaded
    scale += abs(loads) + seen.largest + math.sqrt(2.0 * mass * seen.energy)
    return MomentumBalance(given + loads, seen.end - seen.start, scale)
