"""Slope limiting: slopes inside cells of time with known means.

Such are forces over steps.
"""

from __future__ import annotations

import numpy as np

from impactlab.types import Array

MIN_MEANS = 3  # cells; with fewer a slope is not distinguishable from a jump


def slopes(middles: Array, means: Array) -> Array:
    """Return the slope of quantities in each cell, shape (..., n).

    They follow from the middles of cells of time, shape (n,), and the means, shape (..., n). Zero beside a jump from
    rest, at an extremum and in chatter, so that values stay between those of neighbours.

    References
    ----------
    VanLeer1977 (monotonised central slopes: second order where the quantity is smooth).
    """
    if middles.size < MIN_MEANS:
        return np.zeros_like(means)
    apart = np.diff(middles)
    steepness = np.diff(means) / apart
    # At the ends of the run there is one neighbour; its slope is used on both sides.
    before = np.concatenate((steepness[..., 1:2], steepness), axis=-1)
    after = np.concatenate((steepness, steepness[..., -2:-1]), axis=-1)
    central = 0.5 * (before + after)
    least = np.minimum(2.0 * np.minimum(np.abs(before), np.abs(after)), np.abs(central))
    # Beside an end the slope in the cell lies beyond the one to its neighbour.
    ends, next_ones = np.abs(steepness[..., [0, -1]]), np.abs(steepness[..., [1, -2]])
    beyond = apart[[0, -1]] / (apart[[0, -1]] + apart[[1, -2]])
    least[..., [0, -1]] = np.clip(ends + beyond * (ends - next_ones), 0.0, 2.0 * ends)
    return np.where(before * after > 0.0, np.copysign(least, central), 0.0)
