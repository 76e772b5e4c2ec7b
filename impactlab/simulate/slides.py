"""Slides of mechanisms, and runs that end out of their reach.

A slide is out of reach where a link stands across it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from impactlab.scene.problem import Scene
from impactlab.simulate.channels import AbstractRecordedHistory

MIN_SINE = 0.9  # sine of the angle of a link to its slide, from which a lost run is laid to its reach
REACH_FURTHER = "Move the slide, or give longer links or a shorter run."


def slid(scene: Scene) -> Iterator[tuple[str, float]]:
    """Yield each body with a slide, and its link's angle reading by number."""
    for name, body in scene.bodies.items():
        if body.sliding:
            yield name, next(x for channel, x, _ in body.recorded if channel == f"angle:{body.sliding}")


class OutOfReach(NamedTuple):
    """Where and when a slide came out of reach."""

    text: str
    time: float  # s, of the last known angle


def out_of_reach(history: AbstractRecordedHistory, *, ended: bool = False) -> OutOfReach | None:
    """Return when and where a slide came out of reach.

    A link of a mechanism reached no further; None where none did. Only angles that are no longer finite count; of a run
    that ``ended`` early, also the last ones.
    """
    for name, body in history.scene.bodies.items():
        if not body.sliding:
            continue
        angles = history.recorded[f"angle:{body.sliding}"]
        known = np.isfinite(angles.values)
        if known.any() and (ended or not known.all()):
            number = -1 if known.all() else int(np.argmin(known)) - 1
            angle = float(angles.values[number])
            if abs(np.sin(angle)) > MIN_SINE:
                stood = f"link '{body.sliding}' stood across it, at {angle:.6g} rad"
                return OutOfReach(f"the slide of '{name}' is out of reach: {stood}", float(angles.times[number]))
    return None
