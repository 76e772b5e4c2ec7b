"""Randomised quasi-Monte Carlo estimates from sets of scrambled Sobol points.

The scatter of the sets is the sampling error.

Sources: A. B. Owen, *Monte Carlo theory, methods and examples*, chapter 17; the estimators of the indices are those of
A. Saltelli and others, *Computer Physics Communications* 181 (2010) 259-270, table 2 (b) and (f), as in
`scipy.stats.sobol_indices`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from impactlab.types import Array
from impactlab.uncertainties.records import CONSTANT_TOL, NOTHING, Estimate

LEVEL = 0.95  # of all intervals
MIN_SLANT = 1e-6  # skewness over the root of the number of sets, below which its correction is rounding
MIN_SEEN = 2  # marked points of each set, on average: of fewer the interval is the binomial one

Sets = Sequence[Array]
"""Values of each scrambling, (..., points of it)."""


def estimate(statistic: Callable[[Array], float], sets: Sets) -> Estimate:
    """Return a statistic of all values, with Student's interval from the scatter of the sets.

    The scatter is that of the statistic without one set at a time (jackknife), which holds for ratios, too.
    """
    own = [each for each in sets if each.shape[-1]]
    if len(own) < 2:
        return NOTHING
    value = statistic(np.concatenate(own, axis=-1))
    without = [statistic(np.concatenate([*own[:k], *own[k + 1 :]], axis=-1)) for k in range(len(own))]
    error = _student(len(own)) * math.sqrt(len(own) - 1) * float(np.std(without))
    return Estimate(float(value), float(value - error), float(value + error))


def deviation(sets: Sets) -> Estimate:
    """Return the standard deviation of all values, with an interval that holds for long tails, too.

    Rare large values make the scatter of a deviation skewed: an interval that is symmetric about it then lies too low.
    The ends are those of Student's interval of the logarithm or of the same with Hall's correction for skewness,
    whichever is wider.

    References
    ----------
    P. Hall, *Journal of the Royal Statistical Society B* 54 (1992) 221-228, the cubic transformation.
    """
    own = [each for each in sets if each.size]
    if len(own) < 2:
        return NOTHING
    every, count = np.concatenate(own), len(own)
    variance, middle = float(np.var(every)), float(np.mean(every))
    if variance == 0.0:
        return Estimate(0.0, 0.0, 0.0)
    # The share of each set in the logarithm of the deviation; they sum to 0.
    shares = np.array([np.sum((each - middle) ** 2 / variance - 1.0) for each in own]) * 0.5 * count / every.size
    scatter, limit = float(np.std(shares)), _student(count)
    cubes = float(np.mean((shares / scatter) ** 3)) if scatter > 0.0 else 0.0
    slant = cubes * math.sqrt(count - 1) / max(1, count - 2)  # skewness without bias, over the root of count
    below, above = (max(limit, side * _without_skewness(side * limit, slant)) for side in (1.0, -1.0))
    value, error = math.sqrt(variance), scatter / math.sqrt(count - 1)
    return Estimate(value, value * math.exp(-below * error), value * math.exp(above * error))


def _without_skewness(limit: float, slant: float) -> float:
    """Return the limit that corresponds to Student's, by the inverse of Hall's cubic transformation.

    ``slant`` is the skewness of the values over the root of their number.
    """
    if abs(slant) < MIN_SLANT:
        return limit
    return 3.0 / slant * (float(np.cbrt(1.0 + slant * (limit - slant / 6.0))) - 1.0)


def probability(marked: Sequence[NDArray[np.bool_]]) -> Estimate:
    """Return the share of marked points, with its interval.

    The interval is Student's, from the scatter of the sets, not below the rounding of a share to whole points. Of a
    handful of marked points, or of all but a handful, it is that of Clopper and Pearson for independent points.
    """
    own = [each for each in marked if each.size]
    if len(own) < 2:
        return NOTHING
    seen, count = int(sum(each.sum() for each in own)), sum(each.size for each in own)
    value = seen / count
    if min(seen, count - seen) < MIN_SEEN * len(own):
        return Estimate(value, *binomial(seen, count))
    scatter = float(np.std([each.mean() for each in own], ddof=1))
    error = _student(len(own)) * max(scatter, len(own) / count / math.sqrt(12.0)) / math.sqrt(len(own))
    return Estimate(value, max(0.0, value - error), min(1.0, value + error))


def percentile(percent: float, sets: Sets) -> Estimate:
    """Return a percentile with its interval.

    The interval is that of the share of values up to it, read as percentiles. Beside a handful of values the ends are
    order statistics, by the binomial distribution of their ranks; an end that would lie beyond the first or the last
    value is infinite.
    """
    own = [each for each in sets if each.size]
    if len(own) < 2:
        return NOTHING
    every, share = np.sort(np.concatenate(own)), 0.01 * percent
    value = float(np.quantile(every, share, method="inverted_cdf"))
    if min(share, 1.0 - share) * every.size < MIN_SEEN * len(own):
        return Estimate(value, *_by_ranks(every, share))
    found = probability([each <= value for each in own])
    ends = share - (found.value - found.lower), share + (found.upper - found.value)
    lower, upper = np.quantile(every, np.clip(ends, 0.0, 1.0), method="inverted_cdf").tolist()
    return Estimate(value, lower if ends[0] > 0.0 else -math.inf, upper if ends[1] < 1.0 else math.inf)


def _by_ranks(ordered: Array, share: float) -> tuple[float, float]:
    """Return the ends of the interval of a percentile, from ordered values of independent points."""
    from scipy.stats import binom

    tail = 0.5 * (1.0 - LEVEL)
    below, above = (int(binom.ppf(chance, ordered.size, share)) for chance in (tail, 1.0 - tail))  # values up to it
    return (
        float(ordered[below - 1]) if below > 0 else -math.inf,
        float(ordered[above]) if above < ordered.size else math.inf,
    )


def needed_samples(percent: float) -> int:
    """Return how many independent points give both ends of the interval of a percentile."""
    rarer = 0.01 * min(percent, 100.0 - percent)
    return math.ceil(math.log(0.5 * (1.0 - LEVEL)) / math.log1p(-rarer))


def sobol_indices(sets: Sequence[Array]) -> list[tuple[Estimate, Estimate]]:
    """Return first and total index of each number from Saltelli's design.

    Sets are of shape (2 + numbers, points) each. Not known where the values do not vary.
    """
    size = sets[0].shape[0] - 2
    every = np.concatenate(sets, axis=-1)[:2]
    if every.shape[1] < 2 or not np.ptp(every) > CONSTANT_TOL * np.max(np.abs(every)):
        return [(NOTHING, NOTHING)] * size
    rows = [[each[[0, 1, 2 + k]] for each in sets] for k in range(size)]
    return [(estimate(first_index, own), estimate(total_index, own)) for own in rows]


def first_index(rows: Array) -> float:
    """Return the share of the variance that a number explains alone.

    Parameters
    ----------
    rows : array (3, points)
        Values at A, at B, and at A with the number taken from B.
    """
    a, b, mixed = rows
    return float(np.mean((b - rows[:2].mean()) * (mixed - a))) / _variance(rows)


def total_index(rows: Array) -> float:
    """Return the share of the variance that a number takes part in.

    ``rows`` are those of `first_index`.
    """
    return 0.5 * float(np.mean((rows[0] - rows[2]) ** 2)) / _variance(rows)


def _variance(rows: Array) -> float:
    return float(np.var(rows[:2])) or math.nan


def _student(sets: int) -> float:
    from scipy.stats import t

    return float(t.ppf(0.5 * (1.0 + LEVEL), sets - 1))


def unseen(count: int) -> Estimate:
    """Return the probability of an event that occurs at none of ``count`` points, with its interval."""
    return Estimate(0.0, *binomial(0, count))


def binomial(seen: int, count: int) -> tuple[float, float]:
    """Return the interval of Clopper and Pearson for a share of independent points."""
    from scipy.stats import beta

    tail = 0.5 * (1.0 - LEVEL)
    lower = float(beta.ppf(tail, seen, count - seen + 1)) if seen else 0.0
    return lower, float(beta.ppf(1.0 - tail, seen + 1, count - seen)) if seen < count else 1.0
