"""Richardson extrapolation from three resolutions, with the order of convergence that they show.

The estimate trusts no order that has not shown: the declared order is an upper bound, and each of the three pairs of
runs gives an estimate of its own. Ratios of fineness near the golden section keep steps and elements of the three runs
from being multiples of each other, so that touches and fronts fall at other places within a step in each of them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

LEAST_SHARE = 0.5  # of the declared order: the least that the estimate assumes
MAX_ORDER = 8.0  # largest order searched for
NEAR_ORDER = 1.25  # ratio of the observed to the declared order, either way, up to which the order shows
SHOWN_SAFETY = 1.6  # factor on an estimate where the order shows; Roache1998 takes 1.25, docs/audit.md needs more
RATIO = 0.5 * (1.0 + math.sqrt(5.0))  # of fineness between neighbours: no step is a multiple of another


class Differences(NamedTuple):
    """Distances between three runs of rising fineness, all in the same relative unit."""

    coarse_middle: float
    coarse_fine: float
    middle_fine: float


class Estimate(NamedTuple):
    """Error of the finest of three runs, and the order it was estimated with."""

    error: float
    order: float
    shown: bool = False  # whether the declared order shows in the three runs

    def with_safety(self, safety: float) -> Estimate:
        """Return the estimate times a safety factor, of which `SHOWN_SAFETY` is enough where the order shows."""
        return self._replace(error=self.error * (min(safety, SHOWN_SAFETY) if self.shown else safety))


def finest_error(found: Differences, fineness: tuple[float, float, float], order: float) -> Estimate:
    """Estimate the error of the finest of three runs.

    Parameters
    ----------
    found : Differences
        Distances of the runs in one quantity.
    fineness : (float, float, float)
        Of the three runs, rising.
    order : float
        Declared order of convergence, an upper bound of the order used.

    Returns
    -------
    Estimate
        The largest of the estimates by each pair; inf where the differences do not shrink.

    References
    ----------
    Roache1998 (grid convergence index: three grids, observed order of convergence).
    """
    if not all(math.isfinite(value) for value in found):
        return Estimate(math.inf, LEAST_SHARE * order)
    coarse, fine = fineness[2] / fineness[0], fineness[2] / fineness[1]
    observed = observed_order(found, coarse, fine)
    p = min(order, max(LEAST_SHARE * order, observed))
    error = max(
        found.coarse_fine / (coarse**p - 1.0),
        found.middle_fine / (fine**p - 1.0),
        found.coarse_middle / (coarse**p - fine**p),
    )
    return Estimate(error, p, order / NEAR_ORDER <= observed <= order * NEAR_ORDER)


def observed_order(found: Differences, coarse: float, fine: float) -> float:
    """Return the order p of errors C n^-p that explains the distances of two runs from the finest.

    Parameters
    ----------
    found : Differences
        Distances of the runs.
    coarse, fine : float
        Fineness of the finest run over that of the coarse and of the middle one.

    Returns
    -------
    float
        Root of (coarse^p - 1)/(fine^p - 1) = coarse_fine/middle_fine, at most `MAX_ORDER`; 0 where there is none.
    """
    wanted = found.coarse_fine / max(found.middle_fine, 1e-300)
    low, high = 0.0, MAX_ORDER
    for _ in range(40):
        p = 0.5 * (low + high)
        low, high = (p, high) if (coarse**p - 1.0) / (fine**p - 1.0) < wanted else (low, p)
    return low
