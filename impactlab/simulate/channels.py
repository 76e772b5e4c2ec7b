"""Channels of recorded runs: values at times, read as stairs or as lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import ImpactlabError
from impactlab.history.base import within_run
from impactlab.types import Array


class Channel(NamedTuple):
    """Where a channel lies: values at times, stepped (each value holds since the time before it) or linear.

    Where the values of a stepped channel are means over steps with known middles, it is read with a slope inside each
    step (`slopes`): the stairs themselves are of the first order only.
    """

    times: Array
    values: Array
    stepped: bool
    middles: Array | None = None


def read_channel(channels: Mapping[str, Channel], duration: float, t: ArrayLike, channel: str) -> Array:
    """Return a channel at the times t [s] in [0, duration], same shape as t."""
    if channel not in channels:
        raise ImpactlabError(
            f"channel '{channel}' was not recorded; recorded: {', '.join(sorted(channels))}",
            remedy="A quantity at another place needs a probe in the case.",
            path="probes",
        )
    times, values, stepped, _ = channels[channel]
    t = within_run(t, duration)
    if not stepped:
        return np.asarray(np.interp(t, times, values))
    # A value holds on [time before, its own time): at a jump the value after it is given.
    return values[np.minimum(np.searchsorted(times, t, side="right"), values.size - 1)]
