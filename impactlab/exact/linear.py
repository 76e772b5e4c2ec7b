"""Linear differential equations with constant coefficients by the Chebyshev tau method, compiled."""

from __future__ import annotations

import numpy as np

from impactlab.exact.kernel import CHOP_TOL, ORDER, TAIL_TOL, chopped
from impactlab.numerics.compiling import ALLOCATING_PART, EXACT_INLINE
from impactlab.numerics.linear import solve_bordered
from impactlab.types import Array

MAX_RATE = 1e4  # entry of a, above which the recurrence loses more than 1e4 roundings and the full system is solved
MAX_ENTRY = 8.0  # entry of a block of the recurrence: bounds the loss by cancellation


@ALLOCATING_PART
def table(rows: int, columns: int) -> Array:
    """Return zeros."""
    return np.zeros((rows, columns))


@ALLOCATING_PART
def system(a: Array, b: Array, n: int, first: Array, order: int, y: Array) -> None:
    """Solve y' = a y + b on [-1, 1], y(-1) = first.

    The tau method with ``order`` coefficients, for n functions.
    """
    size = order * n
    w: Array = table(size, size + 1)
    for k in range(1, order):
        half = 0.5 / k
        twice = 2.0 if k == 1 else 1.0
        for i in range(n):
            row = (k - 1) * n + i
            w[row, k * n + i] += 1.0
            after = b[i, k + 1] if k + 1 < order else 0.0
            w[row, size] = half * (twice * b[i, k - 1] - after)
            for m in range(n):
                w[row, (k - 1) * n + m] -= half * twice * a[i, m]
                if k + 1 < order:
                    w[row, (k + 1) * n + m] += half * a[i, m]
    for i in range(n):
        for k in range(order):
            w[size - n + i, k * n + i] = 1.0 if k % 2 == 0 else -1.0
        w[size - n + i, size] = first[i]
    solve_bordered(w, size, size + 1, 2 * n, n)
    for k in range(order):
        for i in range(n):
            y[i, k] = w[k * n + i, size]


@ALLOCATING_PART
def steps_down(a: Array, b: Array, n: int, order: int, p: Array) -> bool:
    """Write y_k = p_k y_{k-1} + r_k; return False where that would lose digits.

    There are n rows of n + 1 entries per k. Pivots are sought within a block only: where functions swing fast, a block
    may be nearly singular and p_k is large.
    """
    for i in range(n):
        for m in range(n):
            if not abs(a[i, m]) <= MAX_RATE:
                return False
    w: Array = table(n, 2 * n + 1)
    for k in range(order - 1, 0, -1):
        half = 0.5 / k
        twice = 2.0 if k == 1 else 1.0
        for i in range(n):
            for m in range(n):
                w[i, m] = 1.0 if i == m else 0.0
                w[i, n + m] = half * twice * a[i, m]
            w[i, 2 * n] = half * twice * b[i, k - 1]
            if k + 1 < order:
                w[i, 2 * n] -= half * b[i, k + 1]
                for q in range(n):
                    for m in range(n):
                        w[i, m] += half * a[i, q] * p[(k + 1) * n + q, m]
                    w[i, 2 * n] -= half * a[i, q] * p[(k + 1) * n + q, n]
        solve_bordered(w, n, 2 * n + 1, n, n)
        for i in range(n):
            for m in range(n + 1):
                p[k * n + i, m] = w[i, n + m]
                if m < n and not abs(w[i, n + m]) <= MAX_ENTRY:
                    return False
    return True


@ALLOCATING_PART
def recurrence(a: Array, b: Array, n: int, first: Array, order: int, y: Array) -> bool:
    """Solve as `system` does, in a time linear in ``order``.

    Return False where that would lose digits. Backward elimination y_k = p_k y_{k-1} + r_k (Olver, Miller) on blocks of
    n, as `kernel.relax` on one function.
    """
    p: Array = table(order * n, n + 1)
    if not steps_down(a, b, n, order, p):
        return False
    here: Array = table(n, n + 1)  # y_k per entry of y_0, and in the last column without any
    there: Array = table(n, n + 1)
    total: Array = table(n, n + 1)  # the same of y(-1)
    for i in range(n):
        here[i, i] = total[i, i] = 1.0
    for k in range(1, order):
        sign = 1.0 if k % 2 == 0 else -1.0
        for i in range(n):
            for m in range(n + 1):
                there[i, m] = p[k * n + i, n] if m == n else 0.0
                for q in range(n):
                    there[i, m] += p[k * n + i, q] * here[q, m]
                total[i, m] += sign * there[i, m]
        here, there = there, here
    for i in range(n):
        total[i, n] = first[i] - total[i, n]
    solve_bordered(total, n, n + 1, n, n)
    for i in range(n):
        y[i, 0] = total[i, n]
    for k in range(1, order):
        for i in range(n):
            y[i, k] = p[k * n + i, n]
            for q in range(n):
                y[i, k] += p[k * n + i, q] * y[q, k - 1]
    return True


@EXACT_INLINE
def solved(a: Array, force: Array, first: Array, y: Array, speed: float, spent: Array) -> bool:
    """Solve y' = a y + force; return whether ORDER coefficients are enough.

    As many are taken as needed. The number of multiplications, about, is added to spent[0, 0].
    """
    n = len(a)
    needed = 1
    for i in range(n):
        needed = max(needed, chopped(force[i], ORDER, CHOP_TOL * speed))
    order = min(ORDER, n + 16)
    while True:
        if needed + 4 <= order or order == ORDER:
            spent[0, 0] += order * n * n * (3.0 * n + 8.0)
            if not recurrence(a, force, n, first[0], order, y):
                spent[0, 0] += order * n * 6.0 * n * n * 3.0
                system(a, force, n, first[0], order, y)
            size = speed
            tail = 0.0
            for i in range(n):
                for k in range(order):
                    size = max(size, abs(y[i, k]))
                for k in range(order - 3, order):
                    tail = max(tail, abs(y[i, k]))
            if tail <= 4.0 * TAIL_TOL * size:
                return True
        if order == ORDER:
            return False
        order = min(2 * order, ORDER)
