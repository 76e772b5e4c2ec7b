"""Modes of a uniform beam without units: null vectors of end conditions, combined from four fields."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from impactlab.bases.beams.roots import Held, brackets, cantilever, pinned, roots, rows
from impactlab.bases.beams.waves import BeamNumbers, Ends, WavePair, even_odd, fields, waves
from impactlab.types import Array

SERIES_LIMIT = 1e-5  # a |p| below it: the integral of the square of sinh(sqrt(p) x)/sqrt(p) is that of x2


class FieldOrigin(NamedTuple):
    """Where the fields of a beam have their origin, in lengths of the beam."""

    central: bool  # in the middle, with even and odd fields; else at a pinned end, with odd ones
    unit: float  # length that fields are counted in
    origin: float
    sign: float  # -1 where their x runs to the left

    @classmethod
    def of(cls, kinds: tuple[Held, Held]) -> FieldOrigin:
        """Return the layout of a beam with the given end conditions.

        Clamped and free, its clamped end is at -1 of the fields.
        """
        if "pinned" not in kinds:
            return cls(True, 0.5, 0.5, -1.0 if kinds == ("free", "clamped") else 1.0)
        return cls(False, 1.0, 0.0, 1.0) if kinds[0] == "pinned" else cls(False, 1.0, 1.0, -1.0)


def found(beam: BeamNumbers, kinds: tuple[Held, Held], modes: int) -> tuple[Array, Array]:
    """Return B (modes,) and shares (4, modes) of the elastic modes, of any size.

    The shares are those of the even and odd fields.
    """
    if kinds == ("pinned", "pinned"):
        squared, wave = pinned(beam, modes, even=False)
        shares = np.zeros((4, modes))
        shares[2 + wave, np.arange(modes)] = 1.0
        return squared, shares
    if "pinned" in kinds:
        outer = kinds[1] if kinds[0] == "pinned" else kinds[0]
        squared = roots(beam, outer, False, *brackets(beam, modes, even=False))
        return squared, shares_of(beam, squared, outer, even=False)
    return symmetric(beam, kinds[0], modes) if kinds[0] == kinds[1] else clamped_free(beam, modes)


def symmetric(beam: BeamNumbers, outer: Held, modes: int) -> tuple[Array, Array]:
    """Return the even and odd modes of a beam with equal ends.

    Both are clamped or both free.
    """
    pairs = {even: brackets(beam, modes, even) for even in (True, False)}
    # No mode sought lies above as many brackets.
    most = np.sort(np.concatenate([high for _, high in pairs.values()]))[modes - 1] if modes else 0.0
    parts, shapes = [], []
    for even, (low, high) in pairs.items():
        needed = low < most
        parts.append(roots(beam, outer, even, low[needed], high[needed]))
        shapes.append(shares_of(beam, parts[-1], outer, even))
    squared, shares = np.concatenate(parts), np.hstack(shapes)
    order = np.argsort(squared, kind="stable")[:modes]
    return squared[order], shares[:, order]


def clamped_free(beam: BeamNumbers, modes: int) -> tuple[Array, Array]:
    """Return the modes of a beam clamped at -1 and free at 1."""
    # Clamped at 1 and pinned at 0, the same beam is as long as its unit.
    whole = BeamNumbers(beam.rotary / 4.0, beam.shear / 4.0)
    known = roots(whole, "clamped", False, *brackets(whole, modes, even=False)) / 16.0
    squared = cantilever(beam, np.concatenate((np.zeros(min(modes, 1)), known[:-1])), known)
    carried = waves(beam, squared)
    even, odd = (fields(carried, squared, 1.0, parity) for parity in (True, False))
    sizes, columns = envelopes(carried, squared)
    matrix = np.zeros((modes, 4, 4))
    at_clamp = zip(rows(even, "clamped"), rows(odd, "clamped"), (1.0, -1.0), rows(sizes, "clamped"), strict=True)
    at_tip = zip(rows(even, "free"), rows(odd, "free"), (0.0, 0.0), rows(sizes, "free"), strict=True)
    for number, (of_even, of_odd, sign, size) in enumerate((*at_clamp, *at_tip)):
        # At the clamped end even fields turn the other way, odd ones deflect the other way.
        first, second = (sign, -sign) if sign else (1.0, 1.0)
        scale = np.maximum(*size)
        for column in range(2):
            matrix[:, number, column] = first * of_even[column] / scale
            matrix[:, number, 2 + column] = second * of_odd[column] / (scale * columns[column])
    shares = null_vectors(matrix)
    shares[2:] /= columns
    return squared, shares


def shares_of(beam: BeamNumbers, squared: Array, outer: Held, even: bool) -> Array:
    """Return the shares (4, n) of the fields in even or odd modes.

    The outer end is at 1.
    """
    carried = waves(beam, squared)
    sizes, columns = envelopes(carried, squared)
    matrix = np.zeros((squared.size, 2, 2))
    ends = fields(carried, squared, 1.0, even)
    for number, (pair, size) in enumerate(zip(rows(ends, outer), rows(sizes, outer), strict=True)):
        for column in range(2):
            scale = np.maximum(*size) * (1.0 if even else columns[column])
            matrix[:, number, column] = pair[column] / scale
    shares = np.zeros((4, squared.size))
    part = null_vectors(matrix)
    shares[:2] = part if even else 0.0
    shares[2:] = 0.0 if even else part / columns
    return shares


def envelopes(carried: WavePair, squared: Array) -> tuple[Ends, Array]:
    """Return the sizes of even fields at 1, and the ratio of odd ones.

    The sizes hold for any phase; the ratios, (2, n), are those of odd fields to even ones.
    """
    numbers = [np.sqrt(np.maximum(np.abs(square), SERIES_LIMIT)) for square in carried.squares]
    turning = [np.abs(turning) for turning in carried.turning]
    ones = np.ones(squared.shape)
    sizes = Ends(
        (ones, ones),
        (turning[0] / numbers[0], turning[1] / numbers[1]),
        (turning[0], turning[1]),
        (squared / numbers[0], squared / numbers[1]),
    )
    return sizes, np.array(numbers)


def null_vectors(matrix: Array) -> Array:
    """Return the vectors (m, n) that singular matrices (n, m, m) send to zero."""
    return np.asarray(np.linalg.svd(matrix)[2][:, -1, :].T)


def are_sines(shares: Array) -> bool:
    """Return whether modes are sines from a pinned end.

    They are where both ends are pinned, and no mode is above the cut-off.
    """
    return not np.count_nonzero(shares[:3])


def normalised(beam: BeamNumbers, carried: WavePair, shares: Array, layout: FieldOrigin) -> Array:
    """Return shares (4, n) of unit norm: the integral of w2 + r2 theta2."""
    (p, q), (t, u) = carried.squares, carried.turning
    if are_sines(shares):
        d, e = even_odd(q, 1.0)
        total = (shares[3] * q) ** 2 * (0.5 * (d * e - 1.0) / q)
        total = total + beam.rotary * ((shares[3] * u) ** 2 * (0.5 * (d * e + 1.0)))
        return np.asarray(shares / np.sqrt(total))
    (c, s), (d, e) = even_odd(p, 1.0), even_odd(q, 1.0)
    start = even_odd(p, 0.0)[0] ** 2, even_odd(q, 0.0)[0] ** 2  # cosh2 - p sinh2/p, the same everywhere
    cosines = 0.5 * (c * s + start[0]), 0.5 * (d * e + start[1]), (q * c * e - p * s * d) / (q - p)
    small = np.abs(p) < SERIES_LIMIT
    first = np.where(small, start[0] / 3.0, 0.5 * (c * s - start[0]) / np.where(small, 1.0, p))
    sines = first, 0.5 * (d * e - start[1]) / q, (s * d - c * e) / (q - p)
    a, b, f, g = shares

    def square(x: Array, y: Array, integrals: tuple[Array, Array, Array]) -> Array:
        return x**2 * integrals[0] + y**2 * integrals[1] + 2.0 * x * y * integrals[2]

    total = square(a, b, cosines) + beam.rotary * square(a * t, b * u, sines)
    total = total + square(f * p, g * q, sines) + beam.rotary * square(f * t, g * u, cosines)
    return np.asarray(shares / np.sqrt((2.0 if layout.central else 1.0) * total))
