"""Model of a measured signal: means of a channel, possibly shifted in time, over sampling intervals."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from impactlab.exact.results.history import ContinuousHistory
from impactlab.history.base import AbstractHistory
from impactlab.types import Array

PARTS = 4  # of a sampling interval, where the mean is taken from values
ENDING = ("force", "stress", "strain")  # quantities that are zero before the run


class AbstractMeans(ABC):
    """Means of a channel over intervals.

    Before and after the run it keeps its first and last value.
    """

    duration: float  # s
    rest: float
    last: float

    @abstractmethod
    def sums(self, edges: Array) -> Array:
        """Return the integral of the channel up to increasing times, (n,).

        It begins at a fixed time.
        """

    def over(self, edges: Array, shift: float) -> Array:
        """Return the means between neighbouring edges of the shifted channel, (n - 1,).

        The channel starts at ``shift`` [s].
        """
        moved = edges - shift
        total = self.sums(np.clip(moved, 0.0, self.duration)) + self.rest * np.minimum(moved, 0.0)
        total += self.last * np.maximum(moved - self.duration, 0.0)
        return np.asarray(np.diff(total) / np.diff(edges))


class Means(AbstractMeans):
    """Means of a channel of a history."""

    def __init__(self, history: AbstractHistory, channel: str) -> None:
        self.history, self.channel, self.duration = history, channel, history.duration
        self.last = float(history.evaluate([history.duration], channel)[0])
        ending = channel.partition(":")[0] in ENDING
        self.rest = 0.0 if ending else float(history.evaluate([0.0], channel)[0])

    def sums(self, edges: Array) -> Array:
        exact = self.history.integral(self.channel, edges) if isinstance(self.history, ContinuousHistory) else None
        if exact is not None:
            return exact
        low, high = edges[:-1], edges[1:]
        places = (np.arange(PARTS) + 0.5) / PARTS
        values = self.history.evaluate(low[:, None] + (high - low)[:, None] * places, self.channel)
        return np.concatenate([[0.0], np.cumsum(np.mean(values, axis=1) * (high - low))])
