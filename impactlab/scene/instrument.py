"""The instrument of a probe: gauge, filter, sampling, noise and converter, in SI units."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Instrument:
    """The measurement of a probe, in the order of the signal's path.

    It is ideal where nothing is given.
    """

    length: float = 0.0  # m, of a strain gauge with its middle at the probe
    bandwidth: float | None = None  # Hz, at which a Gaussian low-pass without delay is 3 dB down
    rate: float | None = None  # samples per second; that of the run's records if not given
    noise: float = 0.0  # standard deviation of each sample, in the unit of the quantity
    seed: int = 0  # of the noise
    bits: int | None = None  # of the converter
    range: float | None = None  # full scale of the converter, from -range to range, in the unit of the quantity

    @property
    def resolution(self) -> float:
        """Step of the converter, in the unit of the quantity; 0 without one."""
        return 0.0 if self.bits is None or self.range is None else math.ldexp(self.range, 1 - self.bits)
