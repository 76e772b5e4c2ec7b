"""Interpolation between instants: linear, of many rows at once, and cubic, from values and rates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from impactlab.types import Array, Ints


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


class Between(NamedTuple):
    """Times between rising instants: the instants before them, and the shares of the intervals that have passed."""

    instants: Array  # (n,)
    t: Array
    before: Ints  # number of the instant before each time
    apart: Array  # length of the interval
    share: Array  # 0 to 1


def between(t: Array, instants: Array) -> Between:
    """Return where times lie between rising instants (n,), n > 1; those beyond the ends lie at the ends."""
    before = np.clip(np.searchsorted(instants, t, side="right") - 1, 0, instants.size - 2)
    start = instants[before]
    apart = instants[before + 1] - start
    whole = np.where(apart > 0.0, apart, 1.0)  # of instants that occur twice, as where a run fails at once
    return Between(instants, t, before, apart, np.clip((t - start) / whole, 0.0, 1.0))


def cubic(at: Between, values: Array, rates: Array) -> Array:
    """Return the cubic Hermite interpolant of values and rates at the instants, both (..., n), shape (..., times).

    Where the fourth derivative is at most D, and rates are exact, its error is at most D h^4/384 between instants h
    apart.
    """
    _, _, before, apart, share = at
    first, last = values[..., before], values[..., before + 1]
    rise, rest = last - first, 1.0 - share
    bend = rest * (rates[..., before] * apart - rise) - share * (rates[..., before + 1] * apart - rise)
    return np.where(share < 1.0, first + share * (rise + rest * bend), last)


def turning_points(times: Array, values: Array, rates: Array) -> Array:
    """Return the instants at which the interpolant of `cubic` may turn inside its intervals, sorted."""
    apart, rise = np.diff(times), np.diff(values)
    first, last = rates[:-1] * apart, rates[1:] * apart
    # The derivative by the share s of an interval is first + 2 b s + 3 a s^2.
    a, b = first + last - 2.0 * rise, 3.0 * rise - 2.0 * first - last
    with np.errstate(divide="ignore", invalid="ignore"):
        root = -(b + np.copysign(np.sqrt(b**2 - 3.0 * a * first), b))
        shares = np.array([root / (3.0 * a), first / root])
    inside = (shares > 0.0) & (shares < 1.0)  # false of NaN
    return np.sort((times[:-1] + apart * shares)[inside])
