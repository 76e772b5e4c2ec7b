"""Relative errors of one run against the truth: displacements, impulses, peak forces."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from studies.audit.tables import Array

NEAR = 0.05  # of a round trip (of a contact's own length, among rigid bodies) left out around a jump of the force
STILL = 1e-9  # of the largest displacement: below it there is but rounding
WEAK = 1e-6  # of the largest impulse: a contact below it is not compared

JUDGED = ("displacement", "impulse", "peak")


class Answer(Protocol):
    """Anything with the series and sums of a truth."""

    displacements: dict[str, Array]
    forces: dict[str, Array]
    impulses: dict[str, float]


@dataclass
class Truth:
    """Reference values of a run, and their uncertainty.

    They are displacements and forces at the middles of equal cells, impulses and jumps.
    """

    times: Array
    displacements: dict[str, Array]  # channel -> (samples,)
    forces: dict[str, Array]  # contact -> (samples,)
    impulses: dict[str, float]
    peaks: dict[str, float]
    jumps: dict[str, list[tuple[float, float]]]  # contact -> (time, size)
    drift: dict[str, Array]  # channel -> motion of the centre of mass of all bodies that its body touches
    round_trip: float
    contacts: int
    uncertainty: dict[str, float] = field(default_factory=dict)  # by quantity, relative


def errors(found: Answer, truth: Truth, tolerance: float) -> dict[str, float]:
    """Return errors by quantity.

    They are displacements in the frame of the centre of mass and in that of the ground, impulses, and peak forces.
    """
    return {
        "displacement": displacement(found, truth, True),
        "displacement_ground": displacement(found, truth, False),
        "impulse": impulse(found, truth),
        "peak": peak(found, truth, tolerance),
    }


def displacement(found: Answer, truth: Truth, within: bool) -> float:
    """Return the largest relative L2 error of the displacements.

    The scale is the motion less that of its frame.
    """
    worst, most = 0.0, max((float(np.linalg.norm(u)) for u in truth.displacements.values()), default=0.0)
    for name, u in truth.displacements.items():
        whole = float(np.linalg.norm(u))
        if whole <= STILL * most:
            continue
        size = float(np.linalg.norm(u - truth.drift[name])) if within else whole
        size = size if size > 1e-9 * whole else whole
        if size > 0.0:
            worst = _larger(worst, float(np.linalg.norm(found.displacements[name] - u)) / size)
    return worst


def impulse(found: Answer, truth: Truth) -> float:
    """Return the largest relative error of the impulses of the contacts."""
    worst, most = 0.0, max((abs(j) for j in truth.impulses.values()), default=0.0)
    for name, j in truth.impulses.items():
        if abs(j) > WEAK * most:
            worst = _larger(worst, abs(found.impulses[name] - j) / abs(j))
        elif most > 0.0:
            worst = _larger(worst, abs(found.impulses[name] - j) / most)
    return worst


def peak(found: Answer, truth: Truth, tolerance: float) -> float:
    """Return the largest relative error of the contacts' peak forces.

    It is over the largest force of all, away from jumps of the force.
    """
    most = max((float(np.max(f)) for f in truth.forces.values()), default=0.0)
    if most <= 0.0:
        return 0.0
    worst = 0.0
    for name, force in truth.forces.items():
        kept = away(truth, name, force, 0.2 * tolerance * most)
        if kept.any():
            worst = _larger(worst, abs(float(np.max(found.forces[name][kept]) - np.max(force[kept]))) / most)
    return worst


def away(truth: Truth, name: str, force: Array, least: float) -> np.ndarray:
    """Return which samples are away from large jumps of a force.

    Large jumps are larger than ``least``.
    """
    kept = np.ones(len(truth.times), bool)
    width = NEAR * truth.round_trip
    if not math.isfinite(width):
        width = NEAR * float(np.count_nonzero(force > 0.0)) * (truth.times[1] - truth.times[0])
    for time, size in truth.jumps[name]:
        if abs(size) > least:
            kept &= np.abs(truth.times - time) > width
    return kept


def _larger(worst: float, value: float) -> float:
    return math.nan if math.isnan(value) or math.isnan(worst) else max(worst, value)
