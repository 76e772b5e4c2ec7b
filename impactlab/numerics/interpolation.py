"""Linear interpolation of many rows at the same instants."""

from __future__ import annotations

import numpy as np

from impactlab.types import Array


def interpolated(t: Array, times: Array, rows: Array) -> Array:
    """Return rows over rising times at times t, shape (rows, t.size).

    ``times`` (n,) and ``rows`` (rows, n). Each row has the very values of `numpy.interp`: beyond the ends those at the
    ends, and at an instant that is given its own value.
    """
    if times.size == 1:
        return np.repeat(rows, t.size, axis=1)
    before = np.clip(np.searchsorted(times, t, side="right") - 1, 0, times.size - 2)
    first, second = rows[:, before], rows[:, before + 1]
    early, late = times[before], times[before + 1]
    with np.errstate(divide="ignore", invalid="ignore"):  # of instants that occur twice
        between = (second - first) / (late - early) * (t - early) + first
    at_start, at_end = t <= early, t >= late
    between[:, at_start] = first[:, at_start]
    between[:, at_end] = second[:, at_end]
    return between
