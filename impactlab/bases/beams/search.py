"""Anderson and Bjorck's false position for frequencies of a uniform beam, one per bracket.

The fields are those of `impactlab.bases.beams.waves` at x = 1, of one frequency at a time.
"""

from __future__ import annotations

import math

from impactlab.bases.beams.waves import MIN_SQUARE
from impactlab.numerics.compiling import EXACT_ENTRY, EXACT_PART
from impactlab.types import Array

CLAMPED, PINNED, FREE = 0, 1, 2  # support of the end at 1
ODD, EVEN, BOTH = 0, 1, 2  # fields about 0; both where the end at -1 is clamped
MAX_ROUNDS = 200  # halving every fourth time exceeds double precision
HALVED_EVERY = 4  # rounds, where false positions leave one end
ROUNDING = 2.3e-16  # of a fourth root of B, relative

Pair = tuple[float, float]
Four = tuple[float, float, float, float]


@EXACT_PART
def even_odd(square: float) -> Pair:
    """Return the values of `impactlab.bases.beams.waves.even_odd` at 1."""
    number = math.sqrt(max(abs(square), MIN_SQUARE))
    if square > 0.0:
        decayed = math.exp(-2.0 * number)
        return 1.0, (1.0 - decayed) / (1.0 + decayed) / number
    return math.cos(number), math.sin(number) / number


@EXACT_PART
def quantities(square: float, turning: float, squared: float, cosine: float, sine: float, even: bool) -> Four:
    """Return deflection, rotation, bending moment and shear force of one wave at 1."""
    if even:
        return cosine, turning * sine, turning * cosine, -squared * sine
    return square * sine, turning * cosine, turning * square * sine, -squared * cosine


@EXACT_PART
def vanishing(found: Four, held: int) -> Pair:
    """Return the two quantities that vanish at an end."""
    deflection, rotation, moment, shear = found
    if held == CLAMPED:
        return deflection, rotation
    if held == PINNED:
        return deflection, moment
    return shear, moment


@EXACT_PART
def determinant(rotary: float, shear: float, squared: float, held: int, parity: int) -> float:
    """Return the determinant of the end conditions at B = ``squared``."""
    difference = squared * (rotary - shear)
    root = math.sqrt(difference**2 + 4.0 * squared)
    travelling = -0.5 * (squared * (rotary + shear) + root)
    other = -squared * (1.0 - squared * (rotary * shear)) / travelling
    larger = 0.5 * (abs(difference) + root)
    first, second = larger, -squared / larger
    if rotary > shear:
        first, second = squared / larger, -larger
    c, s = even_odd(other)
    d, e = even_odd(travelling)
    if parity != BOTH:
        a0, b0 = vanishing(quantities(other, first, squared, c, s, parity == EVEN), held)
        a1, b1 = vanishing(quantities(travelling, second, squared, d, e, parity == EVEN), held)
        return a0 * b1 - a1 * b0
    even0, even1 = quantities(other, first, squared, c, s, True), quantities(travelling, second, squared, d, e, True)
    odd0, odd1 = quantities(other, first, squared, c, s, False), quantities(travelling, second, squared, d, e, False)
    # Rows of the matrix: (e, -o) and (-f, q) of the clamped end, where even fields turn and odd ones deflect the other
    # way, and (a, c) and (b, d) of the other one; by minors of the first two and of the last two.
    e0, f0 = vanishing(even0, CLAMPED)
    e1, f1 = vanishing(even1, CLAMPED)
    o0, q0 = vanishing(odd0, CLAMPED)
    o1, q1 = vanishing(odd1, CLAMPED)
    a0, b0 = vanishing(even0, held)
    a1, b1 = vanishing(even1, held)
    c0, d0 = vanishing(odd0, held)
    c1, d1 = vanishing(odd1, held)
    total = (e1 * f0 - e0 * f1) * (c0 * d1 - c1 * d0)
    total -= (e0 * q0 - o0 * f0) * (a1 * d1 - c1 * b1)
    total += (e0 * q1 - o1 * f0) * (a1 * d0 - c0 * b1)
    total += (e1 * q0 - o0 * f1) * (a0 * d1 - c1 * b0)
    total -= (e1 * q1 - o1 * f1) * (a0 * d0 - c0 * b0)
    return total + (o1 * q0 - o0 * q1) * (a0 * b1 - a1 * b0)


@EXACT_PART
def root(rotary: float, shear: float, held: int, parity: int, low: float, high: float) -> float:
    """Return the root of the determinant between two roots B of the beam pinned at 1."""
    left, right = math.sqrt(math.sqrt(low)), math.sqrt(math.sqrt(high))
    at_left, at_right, moved = 0.0, 0.0, 0  # 0: unknown; which end moved last
    place, below = 0.5 * (left + right), 0.0
    for count in range(MAX_ROUNDS):
        least = ROUNDING * right
        if right - left <= 2.0 * least:
            break
        found = determinant(rotary, shear, place**4, held, parity)
        if below == 0.0:
            # The stiffness against turning is pinned over clamped: it falls from 0 to -inf, then from inf to 0. That
            # against moving is free over pinned, and falls from inf to -inf.
            pinned = determinant(rotary, shear, place**4, PINNED, parity)
            below = -1.0 if (pinned < 0.0) != (held == CLAMPED) else 1.0
        found *= below
        # The value at the end that stays counts less where it stays twice (Anderson and Bjorck).
        if found > 0.0:
            if moved < 0:
                share = 1.0 - found / at_left
                at_right *= share if share > 0.0 else 0.5
            left, at_left, moved = place, found, -1
        else:
            if moved > 0:
                share = 1.0 - found / at_right if at_right != 0.0 else 0.5
                at_left *= share if share > 0.0 else 0.5
            right, at_right, moved = place, found, 1
        place = 0.5 * (left + right)
        if at_left > 0.0 > at_right and count % HALVED_EVERY < HALVED_EVERY - 1:
            place = right - at_right * (right - left) / (at_right - at_left)
            # A step shorter than the rounding goes a little beyond the root, so that the other end moves, too.
            place = min(max(place, left + least), right - least)
    return (0.5 * (left + right)) ** 4


@EXACT_ENTRY
def find_roots(rotary: float, shear: float, held: int, parity: int, low: Array, high: Array, found: Array) -> None:
    """Write the root in each bracket, (n,)."""
    for number in range(low.size):
        found[number] = root(rotary, shear, held, parity, low[number], high[number])
