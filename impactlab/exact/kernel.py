"""Chebyshev pieces, compiled: values, restriction, integrals, linear differential equations, first falls.

All signals of a junction share one piece: a record [t0, t1] with the same number of coefficients per row.
Rows of a record: velocity of each node, displacement of each node, wave emitted by each end, its time integral,
force of each contact.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from impactlab.exact.network import Integers, Log, Network
from impactlab.types import Array

ROOM = 72  # coefficients a piece may have; the numbers of points below divide it, so one table serves all
ORDER = 68  # coefficients of a solve; the rest is room for integration
COSINES = np.cos(np.pi * np.arange(4 * ROOM) / (2 * ROOM))
CHOP = 4.0e-17  # of the velocity scale: coefficients below are dropped
RESOLVED = 1.0e-15  # of the velocity scale: the tail of a solved piece lies below
ZERO = 1.0e-12  # of the scale: forces and gaps below count as none
DONE, MORE_RECORDS, MORE_POOL, MORE_EVENTS, TOO_MANY, UNRESOLVED = 0, 1, 2, 3, 4, 5
CLOSE, OPEN = 1, 0


@njit(cache=True)
def value(a: Array, n: int, x: float) -> float:
    """Return the Chebyshev series a[:n] at x in [-1, 1] (Clenshaw)."""
    b1 = 0.0
    b2 = 0.0
    for k in range(n - 1, 0, -1):
        b1, b2 = 2.0 * x * b1 - b2 + a[k], b1
    return float(x * b1 - b2 + a[0])


@njit(cache=True)
def points(n: int) -> int:
    """Return the smallest divisor of ROOM that is not below n."""
    for m in (1, 2, 3, 4, 6, 8, 9, 12, 18, 24, 36):
        if m >= n:
            return m
    return ROOM


@njit(cache=True)
def chopped(a: Array, n: int, floor: float) -> int:
    """Return how many coefficients of a[:n] are needed when those at the end below the floor are dropped."""
    while n > 1 and abs(a[n - 1]) <= floor:
        n -= 1
    return n


@njit(cache=True)
def restrict(a: Array, n: int, low: float, high: float, out: Array) -> int:
    """Write the coefficients of the series on [low, high] of its interval; return how many."""
    m = points(n)
    stride = ROOM // m
    for k in range(m):
        out[k] = 0.0
    for i in range(m):
        y = COSINES[(2 * i + 1) * stride]
        f = value(a, n, 0.5 * (low + high) + 0.5 * (high - low) * y)
        for k in range(m):
            out[k] += f * COSINES[(k * (2 * i + 1) * stride) % (4 * ROOM)]
    for k in range(m):
        out[k] *= (1.0 if k == 0 else 2.0) / m
    return min(m, n)


@njit(cache=True)
def integrate(a: Array, n: int, half: float, first: float, out: Array) -> None:
    """Write n + 1 coefficients of first + integral from the left end; half is half the length of the piece."""
    total = 0.0
    for k in range(1, n + 1):
        before = 2.0 * a[0] if k == 1 else a[k - 1]
        after = a[k + 1] if k + 1 < n else 0.0
        out[k] = half * (before - after) / (2.0 * k)
        total += out[k] if k % 2 == 0 else -out[k]
    out[0] = first - total


@njit(cache=True)
def relax(rate: float, b: Array, first: float, y: Array, work: Array) -> None:
    """Solve y' = -rate y + b on [-1, 1], y(-1) = first, rate >= 0, by the tau method.

    Backward elimination y_k = p_k y_{k-1} + r_k (Olver, Miller): all p_k are negative, so nothing cancels.
    """
    p = 0.0
    r = 0.0
    for k in range(ORDER - 1, 0, -1):
        w = 0.5 / k
        twice = 2.0 if k == 1 else 1.0
        after = b[k + 1] if k + 1 < ORDER else 0.0
        pivot = 1.0 - rate * w * p
        r = (w * (twice * b[k - 1] - after) + rate * w * r) / pivot
        p = -rate * w * twice / pivot
        work[0, k] = p
        work[1, k] = r
    g = 1.0
    q = 0.0
    sum_g = 1.0
    sum_q = 0.0
    for k in range(1, ORDER):
        g = work[0, k] * g
        q = work[0, k] * q + work[1, k]
        sign = 1.0 if k % 2 == 0 else -1.0
        sum_g += sign * g
        sum_q += sign * q
    y[0] = (first - sum_q) / sum_g
    for k in range(1, ORDER):
        y[k] = work[0, k] * y[k - 1] + work[1, k]


@njit(cache=True)
def eliminate(w: Array, size: int, columns: int, band: int, tail: int) -> None:
    """Solve w[:, :size] x = w[:, size:columns] in place by elimination with row pivoting.

    Row i holds zeros left of its band; rows from size - tail on are full. Pivots are sought where a column can be
    filled: ``band`` rows below the diagonal and the full rows. The solution lands in w[:, size:columns].
    """
    for c in range(size):
        last = min(c + band, size - tail)
        best = c
        for i in range(c, last):
            if abs(w[i, c]) > abs(w[best, c]):
                best = i
        for i in range(max(c, size - tail), size):
            if abs(w[i, c]) > abs(w[best, c]):
                best = i
        if best != c:
            for k in range(c, columns):
                w[c, k], w[best, k] = w[best, k], w[c, k]
        for i in range(c + 1, size):
            if (i < last or i >= size - tail) and w[i, c] != 0.0:
                factor = w[i, c] / w[c, c]
                for k in range(c, columns):
                    w[i, k] -= factor * w[c, k]
    for c in range(size - 1, -1, -1):
        for k in range(size, columns):
            total = w[c, k]
            for i in range(c + 1, size):
                total -= w[c, i] * w[i, k]
            w[c, k] = total / w[c, c]


@njit(cache=True)
def system(a: Array, b: Array, n: int, first: Array, order: int, y: Array, w: Array) -> None:
    """Solve y' = a y + b on [-1, 1], y(-1) = first, for n functions by the tau method with ``order`` coefficients."""
    size = order * n
    for i in range(size):
        for k in range(size + 1):
            w[i, k] = 0.0
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
    eliminate(w, size, size + 1, 2 * n, n)
    for k in range(order):
        for i in range(n):
            y[i, k] = w[k * n + i, size]


@njit(cache=True)
def first_fall(f: Array, n: int, floor: float, stack: Array, low: Array, high: Array, count: Integers) -> float:
    """Return where f first falls through zero to below -floor, or 2 where it never does.

    The interval is halved until the coefficients prove a part safe or monotone; nothing is sampled. What stays
    within the floor is no fall; the place returned is the zero itself.
    """
    for k in range(n):
        stack[0, k] = f[k]
    low[0], high[0], count[0] = -1.0, 1.0, n
    top = 0
    rose = False
    while top >= 0:
        a, b, m = low[top], high[top], count[top]
        c = stack[top]
        spread = 0.0
        bend = 0.0
        right = c[0]
        left = c[0]
        for k in range(1, m):
            spread += abs(c[k])
            bend += k * k * abs(c[k])
            right += c[k]
            left += c[k] if k % 2 == 0 else -c[k]
        if c[0] - spread >= -floor:
            rose = rose or c[0] + spread > floor
            top -= 1
            continue
        slope = abs(c[1]) if m > 1 else 0.0
        if c[0] + spread < -floor or 2.0 * slope > bend or b - a < 1e-13 or top + 2 >= len(low):
            if min(left, right) >= -floor:
                rose = rose or max(left, right) > floor
                top -= 1
                continue
            x0, x1 = -1.0, 1.0
            if left <= floor and not rose:
                return -1.0  # f has been zero to rounding since the start: it falls from there
            if left <= 0.0:
                # the zero lies in the part before, where f stayed within the floor; follow the tangent back to it
                rate = (value(c, m, -1.0 + 1e-6) - left) / 1e-6
                back = left / rate if rate < 0.0 else 0.0
                return float(max(-1.0, a - 0.5 * (b - a) * back))
            for _ in range(200):
                x = 0.5 * (x0 + x1)
                if x <= x0 or x >= x1:
                    break
                if value(c, m, x) > 0.0:
                    x0 = x
                else:
                    x1 = x
            return float(0.5 * (a + b) + 0.5 * (b - a) * x1)
        middle = 0.5 * (a + b)
        m1 = restrict(c, m, -1.0, 0.0, stack[top + 1])
        m2 = restrict(c, m, 0.0, 1.0, stack[top + 2])
        for k in range(m2):
            stack[top, k] = stack[top + 2, k]
        low[top], high[top], count[top] = middle, b, chopped(stack[top], m2, 1e-3 * floor)
        low[top + 1], high[top + 1], count[top + 1] = a, middle, chopped(stack[top + 1], m1, 1e-3 * floor)
        top += 1
    return 2.0


@njit(cache=True)
def coupled(  # noqa: C901 - one kernel: parts would copy their arrays
    net: Network, log: Log, j: int, half: float, group: Integers, mass: Array, drag: Array, load: Array,
    out: Array, w: Array,
) -> bool:  # fmt: skip
    """Velocities of groups tied by springs: m V' + D V + K U = load, U' = V. Returns whether they are resolved.

    Unknowns are the velocities of the groups with mass and U/half of all that can move; velocities of groups without
    mass follow from them.
    """
    base = net.node_of[j]
    nodes = net.node_of[j + 1] - base
    place = np.zeros(nodes, np.int64)
    for g in range(nodes):
        place[g] = -1
    moving = 0
    heavy = 0
    for pas in range(2):  # groups with mass first
        for g in range(nodes):
            if group[g] == g and mass[g] < np.inf and (mass[g] > 0.0) == (pas == 0):
                place[g] = moving
                moving += 1
        if pas == 0:
            heavy = moving
    damp = np.zeros((moving, moving))
    stiff = np.zeros((moving, moving))
    b = np.zeros((moving, ORDER))
    weight = np.zeros(moving)
    n = moving + heavy
    first = np.zeros(n)
    for g in range(nodes):
        if place[g] >= 0:
            damp[place[g], place[g]] = drag[g]
            weight[place[g]] = mass[g]
            for k in range(ORDER):
                b[place[g], k] = load[g, k]
    for i in range(nodes):
        at = place[group[i]]
        if at >= 0:
            stiff[at, at] += net.spring[base + i]
            if net.mass[base + i] > 0.0:
                first[at] = log.v[base + i]
    for c in range(net.contact_of[j], net.contact_of[j + 1]):
        if log.closed[c] == 1 and net.stiffness[c] >= 0.0:
            left, right = place[group[net.left[c] - base]], place[group[net.right[c] - base]]
            push = -net.stiffness[c] * (net.gap[c] + log.u[net.right[c]] - log.u[net.left[c]])
            for side in range(2):
                here, there = (left, right) if side == 0 else (right, left)
                if here >= 0:
                    stiff[here, here] += net.stiffness[c]
                    damp[here, here] += net.damping[c]
                    b[here, 0] += -push if side == 0 else push
                    if there >= 0:
                        stiff[here, there] -= net.stiffness[c]
                        damp[here, there] -= net.damping[c]
    # velocity of each moving group as a combination of the unknowns and of the loads of the massless groups
    light = moving - heavy
    combine = np.zeros((moving, n + light))
    for i in range(heavy):
        combine[i, i] = 1.0
    if light > 0:
        small = np.zeros((light, light + n + light))
        for i in range(light):
            for m in range(light):
                small[i, m] = damp[heavy + i, heavy + m]
            for m in range(heavy):
                small[i, light + m] = -damp[heavy + i, m]
            for m in range(moving):
                small[i, light + heavy + m] = -half * stiff[heavy + i, m]
            small[i, light + n + i] = 1.0
        eliminate(small, light, light + n + light, light, light)
        for i in range(light):
            for m in range(n + light):
                combine[heavy + i, m] = small[i, light + m]
    a = np.zeros((n, n))
    force = np.zeros((n, ORDER))
    for i in range(heavy):
        scale = half / weight[i]
        for m in range(moving):
            for q in range(n):
                a[i, q] -= scale * damp[i, m] * combine[m, q]
            a[i, heavy + m] -= scale * half * stiff[i, m]
            for q in range(light):
                for k in range(ORDER):
                    force[i, k] -= scale * damp[i, m] * combine[m, n + q] * b[heavy + q, k]
        for k in range(ORDER):
            force[i, k] += scale * b[i, k]
    for m in range(moving):
        for q in range(n):
            a[heavy + m, q] += combine[m, q]
        for q in range(light):
            for k in range(ORDER):
                force[heavy + m, k] += combine[m, n + q] * b[heavy + q, k]
    y = np.zeros((n, ORDER))
    needed = 1
    for i in range(n):
        needed = max(needed, chopped(force[i], ORDER, CHOP * log.scale[0]))
    order = min(ORDER, n + 16)  # not a literal, which would be compiled twice
    while True:
        if needed + 4 <= order or order == ORDER:
            system(a, force, n, first, order, y, w)
            size = log.scale[0]
            tail = 0.0
            for i in range(n):
                for k in range(order):
                    size = max(size, abs(y[i, k]))
                tail = max(tail, abs(y[i, order - 1]), abs(y[i, order - 2]), abs(y[i, order - 3]))
            if tail <= 4.0 * RESOLVED * size:
                break
        if order == ORDER:
            return False
        order = min(2 * order, ORDER)
    for g in range(nodes):
        if place[g] >= 0:
            for k in range(ORDER):
                total = 0.0
                for i in range(n):
                    total += combine[place[g], i] * y[i, k]
                for q in range(light):
                    total += combine[place[g], n + q] * b[heavy + q, k]
                out[g, k] = total
    return True
