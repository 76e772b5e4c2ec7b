"""Fronts in the contact force of a stepped run.

At the supposed arrival of a front, straight lines on both sides show whether the force jumps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from impactlab.types import Array

Flags = NDArray[np.bool_]

MIN_SAMPLES = 3  # in a window on one side of a front: of fewer of them nothing is known
GAP = 0.25  # of the shorter window, next to the front: there the steps of a run smear the jump
SHORT_WINDOW = 0.5  # of the longer window: the difference of lines at a jump remains, at a bend it falls to a quarter
MIN_REMAINS = 0.5  # of the difference with long windows, with short ones: halfway between a jump and a bend
MIN_DEVIATIONS = 2.0  # standard deviations of the difference of two lines, by their scatter, that a jump exceeds
MIN_JUMP = 1e-3  # of the largest force: smaller jumps do not count where no tolerance is given


class Samples(NamedTuple):
    """A contact force in the middles of the steps of a run."""

    t: Array  # s, shape (n,), rising
    force: Array  # N, shape (n,)


def jumps_at(samples: Samples, at: Array, reach: float, least: float) -> tuple[Flags, Flags]:
    """Return whether a sampled force jumps at instants, and whether jumps are visible.

    Both are of shape (k,). A straight line is fitted to the force on each side of an instant, over a window that ends a
    little before it. The lines differ at the instant by the height of a jump; by nothing at a kink; and where the force
    is only curved, by an amount that falls with the square of the window. So two windows are compared, ``reach`` and
    half of it. Ringing and chatter scatter about the lines: a difference within what such scatter gives by chance is no
    jump.

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
    gap = GAP * SHORT_WINDOW * reach
    edges = np.array(((-reach, -gap), (gap, reach), (-SHORT_WINDOW * reach, -gap), (gap, SHORT_WINDOW * reach)))
    lines, slopes, spread, known = _lines(samples, edges[:, :, None] + at, at)
    for before in (0, 2):  # ahead of the run there is no force
        none = ~known[before] & (at - reach < samples.t[0])
        lines[before, none] = slopes[before, none] = spread[before, none] = 0.0
        known[before] |= none
    (long_, height), scatter = lines[1::2] - lines[::2], np.hypot(spread[2], spread[3])
    late = np.abs(slopes[3] - slopes[2]) * gap  # a kink that arrives late by so much, as fronts do on a mesh
    largest = float(samples.force.max(initial=0.0))
    clear = np.abs(height) > np.maximum(least * largest, np.maximum(MIN_DEVIATIONS * scatter, late))
    remains = (long_ * height > 0.0) & (np.abs(height) >= MIN_REMAINS * np.abs(long_))
    seen = np.asarray(known.all(axis=0))
    return seen & clear & remains, seen


def _lines(samples: Samples, windows: Array, at: Array) -> tuple[Array, Array, Array, Flags]:
    """Fit lines to the samples in windows, by running sums over the samples.

    Parameters
    ----------
    samples : Samples
        Of the run.
    windows : ndarray
        Starts and ends of the windows [s], shape (m, 2, k).
    at : ndarray
        Instants [s], shape (k,).

    Returns
    -------
    tuple of ndarray
        The lines at the instants [N], their slopes [N/s], their standard deviations by the scatter about them [N], and
        whether the windows have samples enough, each of shape (m, k).
    """
    middle, n = 0.5 * (samples.t[0] + samples.t[-1]), samples.t.size
    t, force = samples.t - middle, samples.force
    sums = np.zeros((5, n + 1))
    np.cumsum((t, t * t, force, t * force, force * force), axis=1, out=sums[:, 1:])
    ends = np.searchsorted(samples.t, windows)
    count = ends[:, 1] - ends[:, 0]
    known, count = count >= MIN_SAMPLES, np.maximum(count, 1)
    mean_t, tt, mean, moment, square = (sums[:, ends[:, 1]] - sums[:, ends[:, 0]]) / count
    width = np.where(known, np.maximum(tt - mean_t**2, 1e-300), 1.0)
    slope, lever = (moment - mean_t * mean) / width, at - middle - mean_t
    scatter = np.maximum(square - mean**2 - slope**2 * width, 0.0)
    return mean + slope * lever, slope, np.sqrt(scatter * (1.0 + lever**2 / width) / count), known


def returns(near: Sequence[float], horizon: float, through: bool = False) -> list[float]:
    """Return the arrival times of echoes at one end of a body [s].

    They come from its joints and its other end.

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
