"""Chebyshev series of tangents, compiled: products with a derivative, sums at the right end."""

from __future__ import annotations

from impactlab.numerics.compiling import EXACT_PART
from impactlab.types import Array


@EXACT_PART
def derivative(a: Array, n: int, out: Array) -> None:
    """Write the n coefficients of the derivative of a[:n] on [-1, 1]; the last is zero."""
    out[n - 1] = 0.0
    after = 0.0
    later = 0.0
    for k in range(n - 1, 0, -1):
        here = later + 2.0 * k * a[k]
        out[k - 1] = here
        later, after = after, here
    out[0] *= 0.5


@EXACT_PART
def add_moved(a: Array, n: int, middle: float, slope: float, slopes: Array, out: Array) -> None:
    """Add (middle + slope x) times the derivative of a[:n] to out; ``slopes`` is scratch."""
    derivative(a, n, slopes)
    for k in range(n):
        out[k] += middle * slopes[k]
    for k in range(n - 1):  # x T_k = (T_(k+1) + T_|k-1|)/2; the last slope is zero
        half = 0.5 * slope * slopes[k]
        out[k + 1] += half if k > 0 else 2.0 * half
        if k > 0:
            out[k - 1] += half


@EXACT_PART
def at_end(a: Array, n: int) -> float:
    """Return a[:n] at 1."""
    total = 0.0
    for k in range(n):
        total += a[k]
    return float(total)


@EXACT_PART
def at_start(a: Array) -> float:
    """Return a series at -1."""
    total = 0.0
    for k in range(len(a)):
        total += a[k] if k % 2 == 0 else -a[k]
    return float(total)


@EXACT_PART
def slope_at_end(a: Array, n: int) -> float:
    """Return the derivative of a[:n] at 1."""
    total = 0.0
    for k in range(1, n):
        total += k * k * a[k]
    return float(total)


@EXACT_PART
def bend_at_end(a: Array, n: int) -> float:
    """Return the second derivative of a[:n] at 1."""
    total = 0.0
    for k in range(2, n):
        total += k * k * (k * k - 1.0) / 3.0 * a[k]
    return float(total)
