"""The least and the largest value of a channel over a run."""

from __future__ import annotations

import numpy as np

from impactlab.history.base import AbstractHistory

POINTS = 6001  # instants at which extremes are sought, besides those of the history


def extremes(history: AbstractHistory, channel: str) -> tuple[float, float]:
    """Return the least and the largest value of a channel over a run, in its SI unit.

    They are sought at equal instants, and at those at which the channel jumps, has a kink, or was recorded.
    """
    t = np.concatenate((np.linspace(0.0, history.duration, POINTS), history.turning_times(channel)))
    values = history.evaluate(t, channel)
    return float(values.min()), float(values.max())
