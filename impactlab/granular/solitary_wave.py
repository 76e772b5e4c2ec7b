"""Petviashvili's iteration for the solitary wave of equal beads without precompression.

The wave is the fixed point of a convolution.

Beads of mass m with F = k d^n between neighbours: d_j'' = k/m (d_(j-1)^n - 2 d_j^n + d_(j+1)^n), d_j the overlap of a
contact. A wave d_j(t) = A r(s), s = t/T - j, that passes one bead in the time T obeys r''(s) = r(s+1)^n - 2 r(s)^n +
r(s-1)^n with A^(n-1) = m/(k T^2). Twice integrated, as r vanishes at both ends, it is r = tent * r^n, the convolution
with tent(s) = max(0, 1 - |s|) (English and Pego 2005): its Fourier transform is (2 sin(w/2)/w)^2. The largest force
F = k A^n r(0)^n gives the speed in beads per second: 1/T = C sqrt(k^(1/n) F^(1-1/n)/m), for n = 3/2

    1/T = C sqrt(k^(2/3) F^(1/3)/m),   C = r(0)^(-1/4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from impactlab.errors import ImpactlabError, expect_whole
from impactlab.measurement.inputs import above_zero, finite
from impactlab.types import Array

LONG_WAVE_FACTOR = math.sqrt(0.8)  # C of Nesterenko's long-wave equation: r(0) = (5/4)^2
HALF_WIDTH = 8.0  # beads: the wave falls doubly exponentially, below 1e-100 there
MAX_POINTS = 2**20  # of the wave: 8 MB
MAX_TURNS = 500
TOLERANCE = 1e-15  # of the largest value, between two turns


@dataclass(frozen=True, repr=False)
class SolitaryWave:
    """The shape of the wave.

    s is time over that per bead, and r the overlap over A, with A^(n-1) = m/(k T^2).
    """

    exponent: float  # n
    s: Array  # (points,)
    overlap: Array  # (points,) r(s), 1
    residual: float  # largest difference of r and tent * r^n

    def __repr__(self) -> str:
        return (
            f"<SolitaryWave of exponent {self.exponent:g}, {len(self.s)} points: C {self.factor:.7g}, "
            f"largest overlap {self.largest:.7g}, residual {self.residual:.2g}>"
        )

    @property
    def largest(self) -> float:
        """Largest overlap r(0)."""
        return float(self.overlap.max())

    @property
    def factor(self) -> float:
        """C of the speed, r(0)^(-(n-1)/2): 1/T = C sqrt(k^(1/n) F^(1-1/n)/m)."""
        return math.pow(self.largest, -0.5 * (self.exponent - 1.0))

    @property
    def force(self) -> Array:
        """Force of a contact over its largest, (points,)."""
        return np.asarray((np.maximum(self.overlap, 0.0) / self.largest) ** self.exponent)


def solitary_wave(exponent: float = 1.5, points: int = 4096) -> SolitaryWave:
    """Return the solitary wave of a discrete chain with F = k d^n.

    Parameters
    ----------
    exponent : float
        n, from 1.1 to 5.
    points : int
        Even number of places in -8 <= s < 8 beads, from 64.

    Raises
    ------
    ImpactlabError
        If n or the number of places is out of range, or the iteration does not settle.

    References
    ----------
    EnglishPego2005 (the convolution, and its tail); Petviashvili1976 (the iteration).
    """
    exponent = finite("exponent", exponent, "1")
    if not 1.1 <= exponent <= 5.0:
        raise ImpactlabError(f"exponent {exponent:g} is out of range. Allowed: 1.1 to 5", remedy="Give another one.")
    expect_whole(points, "points", 64, MAX_POINTS)
    if points % 2:
        raise ImpactlabError(f"{points} points are an odd number", remedy="Give an even one.")
    return _settled(exponent, int(points))


@lru_cache(maxsize=16)
def _settled(exponent: float, points: int) -> SolitaryWave:
    """Return the solitary wave to which the iteration converges."""
    s = np.linspace(-HALF_WIDTH, HALF_WIDTH, points, endpoint=False)
    frequencies = 2.0 * math.pi * np.fft.rfftfreq(points, s[1] - s[0])
    tent = np.sinc(frequencies / (2.0 * math.pi)) ** 2  # (2 sin(w/2)/w)^2
    r = np.exp(-(s**2))
    power = exponent / (exponent - 1.0)
    change = math.inf
    for _ in range(MAX_TURNS):
        after = np.fft.irfft(tent * np.fft.rfft(np.maximum(r, 0.0) ** exponent), points)
        # The plain iteration shrinks or grows; the ratio of both sides, which is 1 at the solution, holds the size.
        ratio = float(r @ r) / float(r @ after)
        after *= ratio**power
        last, change = change, float(np.max(np.abs(after - r))) / float(np.max(after))
        r = after
        if change <= TOLERANCE or (change < 1e-13 and change >= last):
            break
    else:
        raise ImpactlabError(
            f"the solitary wave of exponent {exponent:g} does not settle: {change:.3g} after {MAX_TURNS} turns",
            remedy="Give more points.",
        )
    again = np.fft.irfft(tent * np.fft.rfft(np.maximum(r, 0.0) ** exponent), points)
    return SolitaryWave(exponent, s, r, float(np.max(np.abs(again - r))))


def wave_speed(stiffness: float | str, mass: float | str, force: float | str, exponent: float = 1.5) -> float:
    """Return the speed [beads/s] of a solitary wave with a largest force [N].

    The chain has F = k d^n. 1/T = C sqrt(k^(1/n) F^(1-1/n)/m); for Hertz's n = 3/2 C sqrt(k^(2/3) F^(1/3)/m).

    Parameters
    ----------
    stiffness : float or str
        k [N/m^n], or a string with its unit.
    mass : float or str
        Of a bead [kg], likewise.
    force : float or str
        Largest force of a contact [N], likewise.
    exponent : float
        n, from 1.1 to 5.

    Raises
    ------
    ImpactlabError
        If a value is not a number above 0, or n out of range.
    """
    wave = solitary_wave(exponent)
    stiffness = above_zero("stiffness", stiffness, f"N/m^{exponent:g}")
    mass, force = above_zero("mass", mass, "kg"), above_zero("force", force, "N")
    scale = stiffness ** (1.0 / exponent) * force ** (1.0 - 1.0 / exponent) / mass
    return wave.factor * math.sqrt(scale)
