"""Loss of a fit around its solution, and its minimum with one unknown held."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from impactlab.types import Array

AT_BOUND = 1.0e-3  # of the distance between the bounds: an unknown so near to one is at it
MAX_LOSS = 1.0e5  # of the loss at the solution: there is no such run
MAX_TRIALS = 30  # of one fit from a neighbouring solution
MEDIAN_TO_DEVIATION = 1.4826  # of normal noise: standard deviation over median of the size


def from_median(residuals: Array) -> float:
    """Return the standard deviation of residuals from the median of their sizes.

    Those that are exactly 0 do not count: they are left out, or model and signal are both 0, as before a touch.
    """
    sizes = np.abs(residuals[residuals != 0.0])
    return MEDIAN_TO_DEVIATION * float(np.median(sizes)) if sizes.size else 0.0


class Point(NamedTuple):
    """Unknowns and the loss there."""

    x: Array  # (n,), scaled
    loss: float  # sum of squares; robust where residuals beyond a limit count linearly


@dataclass(frozen=True)
class Loss:
    """Sum of squares of residuals over bounded unknowns.

    Parameters
    ----------
    residuals, jacobian : callable
        From unknowns (n,) to residuals (m,) and their derivatives (m, n).
    low, high : array
        Bounds of the unknowns, (n,); may be infinite.
    limit : float
        Size of a residual from which it counts linearly (Huber); infinite for least squares.
    """

    residuals: Callable[[Array], Array]
    jacobian: Callable[[Array], Array]
    low: Array
    high: Array
    limit: float = math.inf
    tolerance: float = 1.0e-6  # of loss and unknowns, at which a fit from a neighbouring solution ends

    @property
    def widths(self) -> Array:
        """Distances between the bounds, (n,); 1 where there are none."""
        width = self.high - self.low
        return np.where(np.isfinite(width), width, 1.0)

    def at(self, x: Array) -> Point:
        """Return the loss at some unknowns."""
        size = np.abs(self.residuals(x))
        near = np.minimum(size, self.limit)
        linear = 2.0 * self.limit * (size - near) if math.isfinite(self.limit) else 0.0
        return Point(x, float(np.sum(near**2 + linear)))

    def least(self, start: Array, held: int | None = None) -> Point:
        """Return the least loss near a start, over all unknowns or with one held."""
        free = np.array([number for number in range(len(start)) if number != held], dtype=int)
        if not len(free):
            return self.at(start)
        low, high, margin = self.low[free], self.high[free], 1e-9 * self.widths[free]

        def whole(part: Array) -> Array:
            x = start.copy()
            x[free] = part
            return x

        found = least_squares(
            lambda part: self.residuals(whole(part)),
            np.clip(start[free], low + margin, high - margin),
            lambda part: self.jacobian(whole(part))[:, free],
            (low, high),
            x_scale="jac",
            loss="huber" if math.isfinite(self.limit) else "linear",
            f_scale=self.limit if math.isfinite(self.limit) else 1.0,
            ftol=self.tolerance,
            xtol=self.tolerance,
            max_nfev=MAX_TRIALS,
        )
        return Point(whole(found.x), 2.0 * float(found.cost))
