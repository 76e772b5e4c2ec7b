"""The equal steps over a run at which a page, a table or a file samples a history."""

from __future__ import annotations

import numpy as np

from impactlab.types import Array

FRAMES = 240
"""Steps between the frames of fields along bodies: eight seconds at 30 frames per second."""
HISTORY_POINTS = 8 * FRAMES + 1
"""Instants of a time trace, one per pixel of a wide screen; every eighth is that of a frame."""
MAX_FORCES = 200  # contacts whose forces stand in a table of probes; nobody reads one with more columns
MIN_POINTS, MAX_NUMBERS = 101, 10_000_000  # of a file: at least these instants, else at most 80 MB
MIN_PLACES, MAX_FIELDS = 5, 10_000_000  # of the fields of a file: at least these places of a rod, else at most 80 MB


def page_times(duration: float, points: int = HISTORY_POINTS) -> Array:
    """Return the instants of time traces, shape (points,) [s]."""
    return np.linspace(0.0, duration, points)


def file_times(duration: float, channels: int, points: int = HISTORY_POINTS) -> Array:
    """Return the instants of a file [s].

    There are fewer where it holds thousands of channels, as of a chain of many bodies.
    """
    return page_times(duration, min(points, max(MIN_POINTS, MAX_NUMBERS // max(1, channels))))


def frame_times(duration: float, per_frame: int = 1) -> Array:
    """Return the instants of fields along bodies, shape (FRAMES * per_frame + 1,) [s]."""
    return np.linspace(0.0, duration, FRAMES * per_frame + 1)


def places_in_file(quantities: int, most: int) -> int:
    """Return at how many places along a rod a file keeps fields.

    There are ``most``, and fewer where the file holds many ``quantities``, those of all rods together.
    """
    return min(most, max(MIN_PLACES, MAX_FIELDS // ((FRAMES + 1) * max(1, quantities))))
