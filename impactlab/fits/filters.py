"""Low-pass filters of residuals, for the search and for instruments of limited bandwidth."""

from __future__ import annotations

import math

import numpy as np

from impactlab.errors import CaseError
from impactlab.fits.signals import Signal
from impactlab.history.instruments import REACH, deviation
from impactlab.types import Array

MAX_UNEVEN = 0.01  # of a sampling interval, by which times may be off an equal spacing


def smooth(values: Array, width: float) -> Array:
    """Return values after a Gaussian filter of a width in samples; a width of 0 keeps them."""
    if width <= 0.0:
        return values
    reach = int(REACH * width) + 1
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    padded = np.concatenate([np.full(reach, values[0]), values, np.full(reach, values[-1])])
    return np.convolve(padded, weights / weights.sum(), mode="valid")


class LowPass:
    """A Gaussian low-pass without delay, of samples at equal intervals.

    It is 3 dB down at a given frequency. Near the ends of the record the weights that lie inside are scaled to a sum of
    1: nothing is assumed of what was not measured, and model and data are weighted alike. Of the filtered samples only
    those half a period of the frequency apart are kept: the others add no information, and the noise of these is nearly
    independent.
    """

    def __init__(self, signal: Signal, frequency: float) -> None:
        steps = np.diff(signal.time)
        step = float(np.mean(steps))
        even = signal.time[0] + step * np.arange(len(signal.time))
        if np.max(np.abs(signal.time - even)) > MAX_UNEVEN * step:
            raise CaseError(
                f"signal {signal.channel}: a bandwidth needs equal sampling intervals; they are {steps.min():.4g} to "
                f"{steps.max():.4g} s",
                remedy="Interpolate the samples to equal intervals, or give no bandwidth.",
            )
        if not 0.0 < frequency < math.inf:
            text = f"signal {signal.channel}: a bandwidth of {frequency:g} Hz. Allowed: above 0"
            raise CaseError(text, remedy="Give the frequency at which the amplifier halves the power, in Hz.")
        width = deviation(frequency) / step  # samples
        apart = max(1, round(0.5 / (frequency * step)))
        count, reach = len(even), int(REACH * width) + 1
        self._kept = np.arange((count - 1) % apart // 2, count, apart)
        places = self._kept[:, None] + np.arange(-reach, reach + 1)
        inside = (places >= 0) & (places < count)
        weights = np.where(inside, np.exp(-0.5 * ((places - self._kept[:, None]) / max(width, 1e-9)) ** 2), 0.0)
        self._weights = weights / weights.sum(axis=1, keepdims=True)
        self._places = np.clip(places, 0, count - 1)

    @property
    def count(self) -> int:
        """Number of samples that are kept."""
        return len(self._kept)

    def __call__(self, values: Array) -> Array:
        """Return the samples that are kept, filtered, (count,)."""
        return np.asarray(np.sum(self._weights * values[self._places], axis=1))

    def deviations(self, given: Array) -> Array:
        """Return the standard deviations of filtered samples from those of the samples."""
        return np.asarray(np.sqrt(np.sum((self._weights * given[self._places]) ** 2, axis=1)))
