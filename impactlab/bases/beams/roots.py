"""Frequencies of a uniform beam, bracketed by Rayleigh's theorem on constraints.

A pinned beam's are known in closed form. To clamp its end is one constraint more, to free it one less, so that between
two frequencies of one beam lies exactly one of the other (Rayleigh's theorem), and the sign of the dynamic stiffness
of that end says on which side of it a frequency is. Fields of odd deflection are those of a beam pinned at x = 0.

References
----------
Huang1961 (characteristic equations); Rayleigh1894, section 92a (one constraint more).
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from impactlab.bases.beams.search import BOTH, CLAMPED, EVEN, FREE, ODD, PINNED, find_roots
from impactlab.bases.beams.waves import BeamNumbers, Ends, frequencies
from impactlab.types import Array, Ints

Held = Literal["clamped", "pinned", "free"]


def rows(ends: Ends, held: Held) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Return the two quantities that vanish at an end."""
    if held == "clamped":
        return ends.deflection, ends.rotation
    if held == "pinned":
        return ends.deflection, ends.moment
    return ends.shear, ends.moment


def pinned(beam: BeamNumbers, count: int, even: bool) -> tuple[Array, Ints]:
    """Return the first B of a beam pinned at 1, rising, (count,).

    Its fields are even or odd at 0. Also returned is which wave each is (0 or 1), (count,).
    """
    number = np.arange(count, dtype=np.float64) + (0.5 if even else 1.0)
    lower, upper = frequencies(beam, np.pi * number)
    if not even and np.isfinite(upper[0]):
        # The section turns alike everywhere and nothing deflects: the cut-off frequency itself.
        upper = np.concatenate(([1.0 / (beam.rotary * beam.shear)], upper))
    both = np.concatenate((lower, upper))
    wave = np.concatenate((np.ones(lower.size, np.int64), np.zeros(upper.size, np.int64)))
    order = np.argsort(both, kind="stable")[:count]
    return both[order], wave[order]


def brackets(beam: BeamNumbers, count: int, even: bool) -> tuple[Array, Array]:
    """Return brackets of B of the first elastic modes, (count,) each.

    The end at 1 is clamped or free.
    """
    known, _ = pinned(beam, count + 1, even)
    return known[:-1], known[1:]


def roots(beam: BeamNumbers, held: Held, even: bool, low: Array, high: Array) -> Array:
    """Return the root B in each bracket, shape of ``low``.

    The end at 1 is clamped or free.
    """
    return _sought(beam, held, EVEN if even else ODD, low, high)


def cantilever(beam: BeamNumbers, low: Array, high: Array) -> Array:
    """Return the B of a beam clamped at -1 and free at 1.

    There is one in each bracket made by those of clamped and pinned beams.
    """
    return _sought(beam, "free", BOTH, low, high)


def _sought(beam: BeamNumbers, held: Held, parity: int, low: Array, high: Array) -> Array:
    """Return the root B in each bracket, each found by itself.

    No bit depends on the number of roots that are found together.
    """
    found = np.empty(low.shape)
    outer = {"clamped": CLAMPED, "pinned": PINNED, "free": FREE}[held]
    find_roots(float(beam.rotary), float(beam.shear), outer, parity, low, high, found)
    return found
