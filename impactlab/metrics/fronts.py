"""Fronts in the contact force of a stepped run: whether the force jumps where a front is supposed to arrive."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from impactlab.types import Array

Flags = NDArray[np.bool_]

MIN_SAMPLES = 3  # in a window on one side of a front: of fewer of them nothing is known
GAP = 0.25  # of the shorter window, next to the front: there the steps of a run smear the jump
SHORT = 0.5  # of the longer window: the difference of lines at a jump remains, at a bend it falls to a quarter
MIN_REMAINS = 0.5  # of the difference with long windows, with short ones: halfway between a jump and a bend
CLEAR = 2.0  # standard deviations of the difference of two lines, by the scatter about them, that a jump exceeds
LEAST = 1e-3  # of the largest force: smaller jumps do not count where no tolerance is given


class Samples(NamedTuple):
    """A contact force in the middles of the steps of a run."""

    t: Array  # s, shape (n,), rising
    force: Array  # N, shape (n,)


def jumps_at(samples: Samples, at: Array, reach: float, least: float) -> tuple[Flags, Flags]:
    """Return whether a sampled force jumps at instants, and whether that can be seen at all, each of shape (k,).

    A straight line is fitted to the force on each side of an instant, over a window that ends a little before it. The
    lines differ at the instant by the height of a jump; by nothing at a kink; and where the force is only curved, by
    an amount that falls with the square of the window. So two windows are compared, ``reach`` and half of it. Ringing
    and chatter scatter about the lines: a difference within what such scatter gives by chance is no jump.

    Parameters
    ----------
    samples : Samples
        Of the run.
    at : ndarray
        Instants [s], shape (k,).
    reach : float
        Length of the longer window [s].
    least : float
        Share of the largest force below which a jump does not count.
    """
    if not at.size or not samples.t.size:
        return np.zeros(at.size, dtype=bool), np.zeros(at.size, dtype=bool)
    moments = _moments(samples)
    gap = GAP * SHORT * reach
    long_, _, enough = _step(samples, moments, at, reach, gap)
    short, spread, resolved = _step(samples, moments, at, SHORT * reach, gap)
    enough &= resolved
    height = np.abs(short)
    clear = height > np.maximum(least * float(samples.force.max(initial=0.0)), CLEAR * spread)
    remains = (long_ * short > 0.0) & (height >= MIN_REMAINS * np.abs(long_))
    return enough & clear & remains, enough


def _moments(samples: Samples) -> Array:
    """Return the running sums of 1, t, t^2, F, t F, F^2 of samples, shape (6, n + 1), about the middle of the run."""
    t, force = samples.t - samples.t.mean(), samples.force
    sums = np.cumsum((np.ones(t.size), t, t * t, force, t * force, force * force), axis=1)
    return np.hstack((np.zeros((6, 1)), sums))


def _step(samples: Samples, moments: Array, at: Array, reach: float, gap: float) -> tuple[Array, Array, Flags]:
    """Return the differences of the lines after and before some instants [N], each shape (k,).

    With them, their standard deviations by the scatter about the lines [N], and whether both windows have samples
    enough. Before the run there is no force.
    """
    x = at - samples.t.mean()
    before, one, full = _line(samples, moments, (at - reach, at - gap), x)
    after, other, found = _line(samples, moments, (at + gap, at + reach), x)
    start = at - reach < samples.t[0]
    before, one = np.where(start & ~full, 0.0, before), np.where(start & ~full, 0.0, one)
    return after - before, np.hypot(one, other), (full | start) & found


def _line(samples: Samples, moments: Array, window: tuple[Array, Array], x: Array) -> tuple[Array, Array, Flags]:
    """Return the lines through the samples in windows at instants x, their standard deviations, and whether known."""
    first, last = (np.searchsorted(samples.t, edge) for edge in window)
    count, t, tt, force, moment, square = moments[:, last] - moments[:, first]
    known = count >= MIN_SAMPLES
    count = np.maximum(count, 1.0)
    mean_t, mean = t / count, force / count
    width = np.maximum(tt / count - mean_t**2, 1e-300)
    slope = np.where(known, (moment / count - mean_t * mean) / width, 0.0)
    scatter = np.maximum(square / count - mean**2 - slope**2 * width, 0.0)
    lever = 1.0 + (x - mean_t) ** 2 / width
    return mean + slope * (x - mean_t), np.sqrt(scatter * lever / count), known


def returns(near: Sequence[float], horizon: float, through: bool = False) -> list[float]:
    """Return the times after which echoes from the joints and the end of a body arrive at one of its ends [s].

    Parameters
    ----------
    near : sequence of float
        Time to and fro in each of its segments [s], the nearest first.
    horizon : float
        Latest of the times [s].
    through : bool
        Whether the wave has come through all segments, so that echoes within any of them may follow; else a segment is
        reached through those before it.
    """
    if not near:
        return [0.0]
    found = returns(near[1:], horizon, through) if through else [0.0]
    for count in range(1, int(horizon / near[0]) + 1):
        found += [count * near[0] + more for more in returns(near[1:], horizon - count * near[0], through)]
    return found
