"""Chebyshev series of tangents, compiled: products with a derivative, sums at the right end."""

from __future__ import annotations

from impactlab.numerics.compiling import EXACT_PART, PART
from impactlab.types import Array


@EXACT_PART
def derivative(a: Array, n: int, out: Array) -> None:
    """Write the n coefficients, the last zero, of the derivative of a[:n] on [-1, 1]."""
    out[n - 1] = 0.0
    after = 0.0
    later = 0.0
    for k in range(n - 1, 0, -1):
        here = later + 2.0 * k * a[k]
        out[k - 1] = here
        later, after = after, here
    out[0] *= 0.5


@EXACT_PART
def lever(slopes: Array, n: int, out: Array) -> None:
    """Write the n coefficients of x times a derivative.

    ``slopes`` are the n coefficients of the derivative, the last of which is zero.
    """
    for k in range(n):
        out[k] = 0.0
    for k in range(n - 1):  # x T_k = (T_(k+1) + T_|k-1|)/2
        half = 0.5 * slopes[k]
        out[k + 1] += half if k > 0 else 2.0 * half
        if k > 0:
            out[k - 1] += half


@EXACT_PART
def eliminate(rate: float, order: int, pivots: Array) -> None:
    """Write the coefficients of `relaxed` for any load.

    The solution of y' = -rate y + b on [-1, 1] is y_k = p_k y_{k-1} + r_k.

    Rows: p_k; the factor of the load in r_k; that of r_{k+1}; products of the p up to k. The method is that of
    `kernel.relax`.
    """
    p = 0.0
    for k in range(order - 1, 0, -1):
        w = 0.5 / k
        twice = 2.0 if k == 1 else 1.0
        part = 1.0 / (1.0 - rate * w * p)
        p = -rate * w * twice * part
        pivots[0, k] = p
        pivots[1, k] = w * part
        pivots[2, k] = rate * w * part
    g = 1.0
    total = 1.0
    for k in range(1, order):
        g *= pivots[0, k]
        total += g if k % 2 == 0 else -g
    pivots[3, 0] = total


@EXACT_PART
def relaxed(pivots: Array, b: Array, n: int, first: float, order: int, y: Array, work: Array) -> None:
    """Solve y' = -rate y + b on [-1, 1], y(-1) = first.

    Given are the pivots of the rate and a load of n coefficients.
    """
    r = 0.0
    for k in range(n + 1, order):
        work[k] = 0.0
    for k in range(min(n, order - 1), 0, -1):
        after = b[k + 1] if k + 1 < n else 0.0
        before = 2.0 * b[0] if k == 1 else b[k - 1]
        r = (before - after) * pivots[1, k] + pivots[2, k] * r
        work[k] = r
    q = 0.0
    total = 0.0
    for k in range(1, order):
        q = pivots[0, k] * q + work[k]
        total += q if k % 2 == 0 else -q
    y[0] = (first - total) / pivots[3, 0]
    for k in range(1, order):
        y[k] = pivots[0, k] * y[k - 1] + work[k]


@PART
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
