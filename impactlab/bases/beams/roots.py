"""Frequencies of a uniform beam, bracketed by Rayleigh's theorem on constraints and found by section.

A pinned beam's are known in closed form. To clamp its end is one constraint more, to free it one less, so that between
two frequencies of one beam lies exactly one of the other (Rayleigh's theorem), and the sign of the dynamic stiffness
of that end says on which side of it a frequency is. Fields of odd deflection are those of a beam pinned at x = 0.

References
----------
Huang1961 (characteristic equations); Rayleigh1894, section 92a (one constraint more).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from impactlab.bases.beams.waves import BeamNumbers, Ends, fields, frequencies, waves
from impactlab.models.mesh.bar_elements import Ints
from impactlab.types import Array

Held = Literal["clamped", "pinned", "free"]

SECTIONS = 16  # parts a bracket is cut into at once
ROUNDS = 13  # 16^13 exceeds double precision
MAX_AT_ONCE = 2000  # frequencies sought
MINORS = (
    ((0, 1), (2, 3), 1.0),
    ((0, 2), (1, 3), -1.0),
    ((0, 3), (1, 2), 1.0),
    ((1, 2), (0, 3), 1.0),
    ((1, 3), (0, 2), -1.0),
    ((2, 3), (0, 1), 1.0),
)  # columns of the first two rows, the others, and the sign in Laplace's expansion


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
    """Return between which B the first elastic modes lie when the end at 1 is clamped or free, (count,) each."""
    known, _ = pinned(beam, count + 1, even)
    return known[:-1], known[1:]


def roots(beam: BeamNumbers, held: Held, even: bool, low: Array, high: Array) -> Array:
    """Return the B of a beam whose end at 1 is clamped or free, one in each bracket, shape of ``low``."""

    def below(squared: Array) -> Array:
        ends = fields(waves(beam, squared), squared, 1.0, even)
        differ = (_two(rows(ends, "pinned")) < 0.0) != (_two(rows(ends, held)) < 0.0)
        # The stiffness against turning is pinned over clamped: it falls from 0 to -inf, then from inf to 0. That
        # against moving is free over pinned, and falls from inf to -inf.
        return np.asarray(differ if held == "clamped" else ~differ)

    return sought(below, low, high)


def cantilever(beam: BeamNumbers, low: Array, high: Array) -> Array:
    """Return the B of a beam clamped at -1 and free at 1.

    There is one in each bracket made by those of clamped and pinned beams.
    """

    def below(squared: Array) -> Array:
        found = waves(beam, squared)
        even, odd = fields(found, squared, 1.0, True), fields(found, squared, 1.0, False)
        return np.asarray((_four(even, odd, "free") < 0.0) == (_four(even, odd, "pinned") < 0.0))

    return sought(below, low, high)


def sought(below: Callable[[Array], Array], low: Array, high: Array) -> Array:
    """Return the places in the brackets up to which ``below`` holds."""
    if low.size > MAX_AT_ONCE:
        parts = [slice(start, start + MAX_AT_ONCE) for start in range(0, low.size, MAX_AT_ONCE)]
        return np.concatenate([sought(below, low[part], high[part]) for part in parts])
    inside = np.arange(1, SECTIONS) / SECTIONS
    left, width = low.copy(), high - low
    for _ in range(ROUNDS):
        passed = np.count_nonzero(below(left[:, None] + width[:, None] * inside), axis=1)
        width = width / SECTIONS
        left = left + passed * width
    return np.asarray(left + 0.5 * width)


def _two(pair: tuple[tuple[Array, Array], tuple[Array, Array]]) -> Array:
    (a, b), (c, d) = pair
    return np.asarray(a * d - b * c)


def _four(even: Ends, odd: Ends, held: Held) -> Array:
    """Return the determinant of a beam clamped at -1, where even fields turn and odd ones deflect the other way."""
    (e0, e1), (f0, f1) = rows(even, "clamped")
    (o0, o1), (q0, q1) = rows(odd, "clamped")
    (a0, a1), (b0, b1) = rows(even, held)
    (c0, c1), (d0, d1) = rows(odd, held)
    # Rows of the matrix: (e, -o), (-f, q), (a, c), (b, d); by minors of its first two rows. The deflections at 1 of
    # an even and an odd field are e and o, so the row of a pinned end there is (a, c) = (e, o).
    left = ((e0, e1, -o0, -o1), (-f0, -f1, q0, q1))
    right = ((a0, a1, c0, c1), (b0, b1, d0, d1))
    total = np.zeros(e0.shape)
    for (i, j), (k, m), sign in MINORS:
        upper = left[0][i] * left[1][j] - left[0][j] * left[1][i]
        total = total + sign * upper * (right[0][k] * right[1][m] - right[0][m] * right[1][k])
    return np.asarray(total)
