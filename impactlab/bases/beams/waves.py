"""Fields of a uniform beam that vibrates at one frequency.

They are two waves, each in an even and an odd shape.

Lengths are counted in a length h; three numbers are left: B = rho A w2 h4/EI (frequency), r2 = rho I/(rho A h2)
(rotary inertia) and s2 = EI/(kGA h2) (shear). With r2 = s2 = 0 it is the beam of Euler and Bernoulli. Every field
solves f'' = p f with one of two p, the roots of p2 + B (r2 + s2) p = B (1 - B r2 s2): the smaller, always negative, is
a travelling wave; the larger decays away from where it is made, and travels too above the cut-off frequency, where its
sign changes (B r2 s2 = 1, w2 = kGA/rho I).

References
----------
Huang1961 (the equation, in other letters).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from impactlab.types import Array

MIN_SQUARE = 1e-12  # a p below it is taken for it: cosh and sinh/sqrt(p) are then 1 and x to rounding


class BeamNumbers(NamedTuple):
    """A uniform beam without units."""

    rotary: float  # r2
    shear: float  # s2


class WavePair(NamedTuple):
    """Both waves at frequencies B; the first may decay.

    Each field is of the shape of B.
    """

    squares: tuple[Array, Array]  # p
    turning: tuple[Array, Array]  # p + B s2: slope of the rotation per deflection


class Ends(NamedTuple):
    """Deflection, rotation, bending moment and shear force at x = 1 of both waves.

    Their scale is positive.
    """

    deflection: tuple[Array, Array]
    rotation: tuple[Array, Array]
    moment: tuple[Array, Array]
    shear: tuple[Array, Array]


def waves(beam: BeamNumbers, squared: Array) -> WavePair:
    """Return the waves at B = ``squared`` > 0, shape (...)."""
    of_inertias = squared * (beam.rotary + beam.shear)
    difference = squared * (beam.rotary - beam.shear)
    root = np.sqrt(difference**2 + 4.0 * squared)
    travelling = -0.5 * (of_inertias + root)
    other = -squared * (1.0 - squared * (beam.rotary * beam.shear)) / travelling
    # The two turnings multiply to -B: the one that would be a difference comes from the one that is a sum.
    larger = 0.5 * (np.abs(difference) + root)
    if beam.rotary > beam.shear:
        return WavePair((other, travelling), (squared / larger, -larger))
    return WavePair((other, travelling), (larger, -squared / larger))


def frequencies(beam: BeamNumbers, wave_number: Array) -> tuple[Array, Array]:
    """Return B of waves of given wave numbers, on the lower and upper branch.

    The upper is inf without shear deformation or rotary inertia.
    """
    both = beam.rotary * beam.shear
    middle = 1.0 + (beam.rotary + beam.shear) * wave_number**2
    root = np.sqrt(middle**2 - 4.0 * both * wave_number**4)
    upper = (middle + root) / (2.0 * both) if both > 0.0 else np.full(wave_number.shape, np.inf)
    return 2.0 * wave_number**4 / (middle + root), upper


def even_odd(square: Array, x: Array | float) -> tuple[Array, Array]:
    """Return cosh(sqrt(p) x) and sinh(sqrt(p) x)/sqrt(p), over cosh(sqrt(p)) where p > 0.

    -1 <= x <= 1. So nothing grows beyond all bounds; where p < 0 they are cosine and sine.
    """
    number = np.sqrt(np.maximum(np.abs(square), MIN_SQUARE))
    phase, decaying = number * x, square > 0.0
    count = np.count_nonzero(decaying)
    if not count:
        return np.cos(phase), np.sin(phase) / number
    size = np.abs(phase)
    scale = np.exp(size - number) / (1.0 + np.exp(-2.0 * number))
    even = scale * (1.0 + np.exp(-2.0 * size))
    odd = -scale * np.expm1(-2.0 * size) * np.sign(phase) / number
    if count == decaying.size:
        return even, odd
    return np.where(decaying, even, np.cos(phase)), np.where(decaying, odd, np.sin(phase) / number)


Shapes = tuple[tuple[Array, Array], tuple[Array, Array]]
"""What `even_odd` returns of both waves."""


def shapes_at(found: WavePair, x: Array | float) -> Shapes:
    """Return the even and the odd shape of both waves at x."""
    first, second = found.squares
    return even_odd(first, x), even_odd(second, x)


def fields(found: WavePair, squared: Array, x: Array | float, even: bool) -> Ends:
    """Return the four quantities of both waves at x, of even deflection or of odd.

    In units of h: rotation per 1/h, moment per EI/h2, shear force per EI/h3.
    """
    shapes = shapes_at(found, x)
    return Ends(*(field(found, squared, shapes, even, which) for which in range(4)))


def field(found: WavePair, squared: Array, shapes: Shapes, even: bool, which: int) -> tuple[Array, Array]:
    """Return one quantity of `fields`: deflection (0), rotation, bending moment or shear force (3).

    ``shapes`` are those of `shapes_at`.
    """
    first, second = (
        quantity_of(which, even, squared, *wave) for wave in zip(found.squares, found.turning, shapes, strict=True)
    )
    return first, second


def quantity_of(
    which: int, even: bool, squared: Array, square: Array, turning: Array, shapes: tuple[Array, Array]
) -> Array:
    """Return one quantity of one wave by ``shapes`` of `even_odd`, as `field` does of both."""
    cosine, sine = shapes
    if which == 0:
        return cosine if even else square * sine
    if which == 3:
        return -squared * (sine if even else cosine)
    if which == 1:
        return turning * (sine if even else cosine)
    return turning * cosine if even else turning * square * sine
