"""The least and the largest value of a quantity along a rod over a run, from its fields."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.scene.bodies import WaveBody
from impactlab.scene.problem import Scene
from impactlab.types import Array

FRAMES_PER_TRANSIT = 200  # fields in the time of a wave through the rod
MAX_FRAMES = 20_000  # fields of a run
BESIDE = 1e-6  # of the length of the rod: a place just before a contact


class AtPlace(NamedTuple):
    """A value of a quantity along a rod, with its place and time."""

    value: float  # in the SI unit of the quantity
    x: float  # m
    time: float  # s


def frames_needed(duration: float, transit: float) -> int:
    """Return the frames that a stepped run needs for extremes along a rod.

    The duration and the time of a wave through the rod are in s.
    """
    return min(math.ceil(FRAMES_PER_TRANSIT * duration / transit), MAX_FRAMES)


def rod_of(scene: Scene, channel: str) -> WaveBody | None:
    """Return the rod of a channel without a place, as ``stress:pile``; None for other channels."""
    quantity, _, name = channel.partition(":")
    body = scene.elastic.get(name)
    rod = None if body is None else body.waves
    return rod if rod is not None and quantity in rod.quantities else None


def field_extremes(history: AbstractHistory, rod: WaveBody, quantity: str) -> tuple[AtPlace, AtPlace]:
    """Return the least and the largest value of a quantity along a rod over a run.

    They are those of its fields at the frames of the run; without frames a continuous rod has them at
    `frames_needed` instants. Stress and velocity jump at a contact on the rod and where segments join; fields there
    are those on the right, so these are also read just on the left.
    """
    name, times = rod.name, history.field_times(rod.name)
    if times is None and history.scene.frames:
        times = np.array(history.scene.field_times)
    elif times is None:
        times = np.linspace(0.0, history.duration, frames_needed(history.duration, 0.5 * rod.round_trip) + 1)
    met = [x for _, contact in history.scene.met_by(name) for x in contact.places_on(name)]
    jumps = np.r_[met, np.cumsum([segment.length for segment in rod.segments[:-1]])]
    before = jumps[(jumps > 0.0) & (jumps < rod.length)] - BESIDE * rod.length
    x = np.union1d(history.field(name, float(times[0]), quantity).x, before)
    values = history.fields_at(name, times, quantity, x).values
    return _at(values, x, times, int(values.argmin())), _at(values, x, times, int(values.argmax()))


def _at(values: Array, x: Array, times: Array, place: int) -> AtPlace:
    row, column = divmod(place, x.size)
    return AtPlace(float(values[row, column]), float(x[column]), float(times[row]))
