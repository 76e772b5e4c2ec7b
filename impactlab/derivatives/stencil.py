"""Derivatives of several values by one number: central differences of sixth order, and one-sided ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from impactlab.types import Array

SIXTH = np.array([-1 / 60, 3 / 20, -3 / 4, 0.0, 3 / 4, -3 / 20, 1 / 60])  # at -3 to 3
FOURTH = np.array([0.0, 1 / 12, -2 / 3, 0.0, 2 / 3, -1 / 12, 0.0])
ONE_SIDED = np.array([-49 / 20, 6.0, -15 / 2, 20 / 3, -15 / 4, 6 / 5, -1 / 6])  # at 0 to 6
ONE_SIDED_LOWER = np.array([-137 / 60, 5.0, -5.0, 10 / 3, -5 / 4, 1 / 5, 0.0])
ONE_SIDED_WIDER = np.array([-11 / 12, 0.0, 3 / 2, 0.0, -3 / 4, 0.0, 1 / 6])  # a power of 3/2 shows here, not above
SIDE = np.array([-11 / 6, 3.0, -3 / 2, 1 / 3])  # at 0 to 3
SIDE_LOWER = np.array([-3 / 2, 2.0, -1 / 2, 0.0])
ROUNDING = 1.0e-14  # of a value of a run with tangents


class Slopes(NamedTuple):
    """Derivatives of several values, their errors, and those from either side; NaN where not known."""

    middle: Array
    error: Array
    below: Array
    above: Array
    apart: Array  # distance of both sides that their truncation explains

    @property
    def kink(self) -> Array:
        """Whether the sides differ by more than their errors, (values,)."""
        size = np.maximum(np.abs(self.below), np.abs(self.above))
        return np.asarray(np.abs(self.above - self.below) > 1e-5 * size + 100.0 * self.error + self.apart)


def slopes(values: Callable[[float], Array | None], base: Array, width: float, rounding: float = ROUNDING) -> Slopes:
    """Return the derivatives of values at 0.

    Parameters
    ----------
    values : callable
        The values, (n,), after a change of the number; None where it is not allowed, or the values are others.
    base : array
        The values without a change.
    width : float
        Distance of two changes.
    rounding : float
        Error of a value, relative.
    """
    found: dict[int, Array | None] = {0: base}

    def at(place: int) -> Array | None:
        if place not in found:
            found[place] = values(place * width)
        return found[place]

    noise = rounding * np.abs(base) / width
    nothing = np.full(len(base), np.nan)
    sides, apart = {}, np.zeros(len(base))
    for sign in (-1, 1):
        near = [at(sign * place) for place in range(4)]
        whole = [each for each in near if each is not None]
        sides[sign] = nothing
        if len(whole) == len(near):
            sides[sign], lower = sign * np.stack([SIDE, SIDE_LOWER]) @ np.stack(whole) / width
            apart = apart + np.abs(sides[sign] - lower)
    seven = [at(place) for place in range(-3, 4)]
    whole = [each for each in seven if each is not None]
    if len(whole) == len(seven):
        table = np.stack(whole)
        middle = SIXTH @ table / width
        error = np.abs(middle - FOURTH @ table / width) + 2.0 * noise
        return Slopes(middle, error, sides[-1], sides[1], apart)
    for sign in (-1, 1):
        if found.get(sign) is not None:
            side = [at(sign * place) for place in range(7)]
            whole = [each for each in side if each is not None]
            if len(whole) == len(side):
                table = np.stack(whole)
                middle = sign * ONE_SIDED @ table / width
                others = sign * np.stack([ONE_SIDED_LOWER, ONE_SIDED_WIDER]) @ table / width
                error = np.max(np.abs(middle - others), axis=0) + 8.0 * noise
                other = {-1: (middle, nothing), 1: (nothing, middle)}[sign]
                return Slopes(middle, error, *other, apart)
    return Slopes(nothing, nothing, sides[-1], sides[1], apart)
