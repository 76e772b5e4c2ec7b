"""How far two answers to one scene are apart, and what this says of the finer one."""

from __future__ import annotations

import numpy as np

from impactlab.checks import gain_of
from impactlab.history import AbstractHistory
from impactlab.metrics import displacement_error, face_channels, impulse, mass_channels, midpoints
from impactlab.scene import Scene

CELLS = 1000  # of the midpoint rule: fewer than a summary takes, as an estimate needs no third digit


def difference(one: AbstractHistory, other: AbstractHistory, scene: Scene) -> float:
    """Return the largest relative difference of displacements and impulses, over those of ``other`` in their frame."""
    t = midpoints(scene.duration, CELLS)
    found = [displacement_error(one, other, scene, name, t) for name in (*mass_channels(scene), *face_channels(scene))]
    found.append(impulse(one, other, scene))
    known = [value for value in found if value is not None]
    return max(known) if known and np.all(np.isfinite(known)) else float("inf")


def remainder(distance: float, ratio: float, order: float) -> float:
    """Return the error of the finer of two answers from their distance, for an error that falls as fineness^-order."""
    return float(distance / (ratio**order - 1.0))


def order_seen(steps: list[float], ratios: list[float]) -> float:
    """Return the order that three answers show, from the two distances of neighbours and their ratios of fineness.

    Errors that fall as n^-p are (r1^p - 1) r2^p / (r2^p - 1) times further apart in the coarser pair.
    """
    wanted = max(steps[0], 1e-300) / max(steps[1], 1e-300)
    low, high = 0.0, 8.0
    for _ in range(40):
        p = 0.5 * (low + high)
        found = (ratios[0] ** p - 1.0) * ratios[1] ** p / (ratios[1] ** p - 1.0)
        low, high = (p, high) if found < wanted else (low, p)
    return low


def energy_gain(history: AbstractHistory) -> float:
    """Return the energy that a run gained, over the energy at stake."""
    return gain_of(history)
