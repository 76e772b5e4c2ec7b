"""What a run would show to the instrument: means over sampling intervals, of a channel that may be shifted in time."""

from __future__ import annotations

import numpy as np

from impactlab.errors import CaseError
from impactlab.exact.history import ContinuousHistory
from impactlab.history.base import AbstractHistory
from impactlab.types import Array

PARTS = 4  # of a sampling interval, where the mean is taken from values


class Means:
    """Means of a channel of a run over intervals; before and after the run it keeps its first and last value."""

    def __init__(self, history: AbstractHistory, channel: str) -> None:
        self.history, self.channel = history, channel
        quantity = channel.partition(":")[0]
        self.last = float(history.evaluate([history.duration], channel)[0])
        self.rest = 0.0 if quantity in ("force", "stress", "strain") else float(history.evaluate([0.0], channel)[0])

    def sums(self, edges: Array) -> Array:
        """Return the integral of the channel from t = 0 to times inside the run, (n,)."""
        exact = self.history.integral(self.channel, edges) if isinstance(self.history, ContinuousHistory) else None
        if exact is not None:
            return exact
        low, high = edges[:-1], edges[1:]
        places = (np.arange(PARTS) + 0.5) / PARTS
        values = self.history.evaluate(low[:, None] + (high - low)[:, None] * places, self.channel)
        return np.concatenate([[0.0], np.cumsum(np.mean(values, axis=1) * (high - low))])

    def over(self, edges: Array, shift: float) -> Array:
        """Return the means between neighbouring edges, (n - 1,), of the channel that starts at ``shift`` [s]."""
        moved = edges - shift
        end = self.history.duration
        total = self.sums(np.clip(moved, 0.0, end)) + self.rest * np.minimum(moved, 0.0)
        total += self.last * np.maximum(moved - end, 0.0)
        return np.asarray(np.diff(total) / np.diff(edges))


def check_channel(history: AbstractHistory, channel: str) -> None:
    """Raise `CaseError` if a run has no such channel."""
    try:
        history.evaluate([0.0], channel)
    except CaseError as error:
        raise CaseError(error.text, path=channel, remedy=error.remedy) from None


def smooth(values: Array, width: float) -> Array:
    """Return values after a Gaussian filter, so many samples wide; 0 leaves them as they are."""
    if width <= 0.0:
        return values
    reach = int(4.0 * width) + 1
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    padded = np.concatenate([np.full(reach, values[0]), values, np.full(reach, values[-1])])
    return np.convolve(padded, weights / weights.sum(), mode="valid")
