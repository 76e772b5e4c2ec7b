"""The paper's formulas for equal masses in closed form.

The mass is as heavy as the rod; they are derived again from its Eqs. 7 to 9. Times in T, lengths in v0 T, stresses in
rho c v0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from scipy.optimize import brentq


def arriving(t: float) -> float:
    """Return the wave q that arrives at the face, 1 <= t < 2.5.

    It is the wave that left it one round trip before.
    """
    if t < 2.0:
        return math.exp(-2.0 * (t - 1.0))
    y = t - 2.0
    return math.exp(-2.0 * y) * (1.0 + math.exp(-2.0) - 4.0 * y)


def face_flight(t: float, opening: float) -> float:
    """Return the return of the free face since the opening.

    It is for 2 <= t < 2.5, the exact form of Eq. 12b.
    """
    y, b = t - 2.0, 1.0 - math.exp(-2.0)
    until_two = math.exp(-2.0 * (opening - 1.0)) - math.exp(-2.0)
    return until_two - b + math.exp(-2.0 * y) * (b + 4.0 * y)


def paper_flight(t: float) -> float:
    """Return Eq. 12b with its printed constants; t counts from the opening, as there."""
    return -0.6566 + (10.158 * t - 2.5396) * math.exp(-2.0 * t)


class Second(NamedTuple):
    """The second contact by hand."""

    stress: float  # at its start, rho c v0
    duration: float  # T
    speed: float  # of the mass at its end, v0


def second_by_hand(start: float, speed: float) -> Second:
    """Return the second contact from its start [T] and speed [v0].

    The mass leaves at this speed.
    """
    a, y0 = 1.0 + math.exp(-2.0), start - 2.0

    def mass_velocity(y: float) -> float:
        push = 4.0 * math.exp(-2.0 * y) * (a * (y - y0) - 2.0 * (y * y - y0 * y0))
        return -speed * math.exp(-2.0 * (y - y0)) - push

    def stress(y: float) -> float:
        return mass_velocity(y) + 2.0 * arriving(2.0 + y)

    end = float(brentq(stress, y0, y0 + 0.2, xtol=1e-14))
    return Second(stress(y0), end - y0, -mass_velocity(end))
