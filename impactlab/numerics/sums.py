"""Sums over a flat array, in vector registers."""

from __future__ import annotations

from impactlab.numerics.compiling import HELPER
from impactlab.types import Array


@HELPER
def sum_of(values: Array) -> float:
    """Return the sum of the values."""
    total = 0.0
    for i in range(values.size):
        total += values[i]
    return total


@HELPER
def sum_of_squares(values: Array) -> float:
    """Return the sum of their squares."""
    total = 0.0
    for i in range(values.size):
        total += values[i] * values[i]
    return total
