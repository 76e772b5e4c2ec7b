"""The instants at which a page, a table or a file samples a history: equal steps over the whole run."""

from __future__ import annotations

import numpy as np
from numpy import float64
from numpy.typing import NDArray

FRAMES = 240
"""Steps between the frames of fields along bodies: eight seconds at 30 frames per second."""
HISTORY_POINTS = 8 * FRAMES + 1
"""Instants of a time trace, one per pixel of a wide screen; every eighth is that of a frame."""


def page_times(duration: float, points: int = HISTORY_POINTS) -> NDArray[float64]:
    """Return the instants of time traces, shape (points,) [s]."""
    return np.linspace(0.0, duration, points)


def frame_times(duration: float) -> NDArray[float64]:
    """Return the instants of fields along bodies, shape (FRAMES + 1,) [s]."""
    return np.linspace(0.0, duration, FRAMES + 1)
