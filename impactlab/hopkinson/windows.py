"""Pulses of a signal, found by a threshold: their beginning, their end, and the signal in between."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impactlab.errors import ImpactlabError
from impactlab.measurement.dispersion import checked_signal
from impactlab.measurement.inputs import above_zero, finite, in_si
from impactlab.prefixes import prefixed_range
from impactlab.types import Array

THRESHOLD = 0.05
"""Share of the largest value of a signal above which it is a pulse, and below which it is quiet."""


class Pulse(NamedTuple):
    """A part of a signal above a threshold, of one sign."""

    start: float  # s, of the first sample above the threshold
    end: float  # s, of the last one
    peak: float  # the value of largest magnitude, with its sign
    mean: float  # over the pulse

    def __repr__(self) -> str:
        return f"<Pulse of {prefixed_range(self.start, self.end, 's')}: peak {self.peak:.4g}, mean {self.mean:.4g}>"


def pulses(signal: ArrayLike, dt: float, threshold: float = THRESHOLD, quiet: float = 0.0) -> tuple[Pulse, ...]:
    """Return the pulses of a signal in order of time.

    Parameters
    ----------
    signal : array_like
        Shape (n,), the first sample at t = 0.
    dt : float
        Time between samples [s].
    threshold : float
        Share of the largest magnitude, above 0 and below 1.
    quiet : float
        Pulses of one sign that are apart by no more than this [s] are one.

    Raises
    ------
    ImpactlabError
        If the signal is zero, or the threshold outside its range.
    """
    values, dt = checked_signal("the signal", signal), above_zero("dt", dt, "s")
    largest_value, quiet = largest(values, threshold), finite("quiet", quiet, "s")
    sign = np.where(np.abs(values) > threshold * largest_value, np.sign(values), 0.0)
    edges: list[int] = np.flatnonzero(np.diff(np.concatenate([[0.0], sign, [0.0]]))).tolist()
    runs = [(a, b) for a, b in pairwise(edges) if sign[a] != 0.0]
    joined: list[tuple[int, int]] = []
    for begin, end in runs:
        if joined and sign[begin] == sign[joined[-1][0]] and (begin - joined[-1][1]) * dt <= quiet:
            joined[-1] = (joined[-1][0], end)
        else:
            joined.append((begin, end))
    return tuple(_pulse(values, begin, end, dt) for begin, end in joined)


def cut(signal: ArrayLike, dt: float, start: float, end: float) -> Array:
    """Return a signal from ``start`` to before ``end`` [s], zero elsewhere, same shape."""
    values, dt = checked_signal("the signal", signal), above_zero("dt", dt, "s")
    start, end = finite("start", start, "s"), finite("end", end, "s")
    index = np.arange(len(values))
    return np.where((index >= round(start / dt)) & (index < round(end / dt)), values, 0.0)


def largest(values: Array, threshold: float) -> float:
    """Return the largest magnitude of a signal that is to hold a pulse.

    Raises
    ------
    ImpactlabError
        If it is zero, or the threshold not between 0 and 1.
    """
    share = in_si("the threshold", threshold, "1")
    if not 0.0 < share < 1.0:
        raise ImpactlabError(
            f"the threshold is {share:.6g}, a share of the largest value between 0 and 1",
            remedy="0.05 suits signals whose noise is below that.",
        )
    peak = float(np.abs(values).max())
    if peak == 0.0:
        raise ImpactlabError("the signal is zero throughout: it holds no pulse", remedy="Check the channel it is of.")
    return peak


def samples_above(values: Array, threshold: float) -> NDArray[np.intp]:
    """Return the indices of samples above a share of the largest magnitude.

    Raise as `largest` does.
    """
    peak = largest(values, threshold)
    return np.flatnonzero(np.abs(values) > threshold * peak)


def _pulse(values: Array, begin: int, end: int, dt: float) -> Pulse:
    part = values[begin:end]
    return Pulse(float(begin * dt), float((end - 1) * dt), float(part[np.argmax(np.abs(part))]), float(part.mean()))
