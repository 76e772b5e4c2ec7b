"""The Gaussian low-pass filter of instruments, from its 3 dB frequency."""

from __future__ import annotations

import math

REACH = 4.0  # standard deviations of a Gaussian weight, to each side


def deviation(frequency: float) -> float:
    """Return the standard deviation of a Gaussian low-pass filter [s].

    Its gain at a frequency [Hz] is 1/sqrt(2). The gain at f is exp(-(2 pi f deviation)^2/2).
    """
    return math.sqrt(math.log(2.0)) / (2.0 * math.pi * frequency)
