"""The paper's scene solved a second way: polynomials times one exponential, in high precision. Units T, v0, rho c v0.

Every wave on an interval is P(y) exp(-lam y) with y counted from its start (times 1 while the mass is in contact and
earlier forcing is exhausted alike): in contact vm' = -lam (vm + 2 q), in flight p = -q. Resonance only raises the
degree, so the representation closes. Nothing is shared with the solver under test.
"""

from __future__ import annotations

import numpy as np
from mpmath import mp, mpf

MERGE = mpf(10) ** -20  # breaks nearer than this are one


def shifted(poly, lam, h):
    """The coefficients of the same function with y counted from h: P(y + h) exp(-lam h)."""
    out = list(poly)
    for i in range(len(out) - 1):
        for k in range(len(out) - 2, i - 1, -1):
            out[k] += h * out[k + 1]
    factor = mp.e ** (-lam * h)
    return [factor * value for value in out]


def value(poly, y):
    total = mpf(0)
    for a in reversed(poly):
        total = total * y + a
    return total


def primitive_exp(poly, lam):
    """Q with (Q exp(-lam y))' = P exp(-lam y)."""
    out = [mpf(0)] * len(poly)
    carry = mpf(0)
    for k in range(len(poly) - 1, -1, -1):
        out[k] = (carry - poly[k]) / lam
        carry = (k) * out[k]
    return out


def first_zero(function, fast, width):
    """First place in (0, width] where the function falls below zero after having been positive; None if never."""
    y = np.linspace(0.0, float(width), 3001)[1:]
    values = fast(y)
    below = np.flatnonzero(values < 0.0)
    if not len(below):
        return None
    i = int(below[0])
    low = mpf(0) if i == 0 else mpf(y[i - 1])
    high = mpf(y[i])
    if i == 0 and function(low) < 0:
        return mpf(0)
    for _ in range(mp.prec + 8):
        middle = (low + high) / 2
        if function(middle) > 0:
            low = middle
        else:
            high = middle
    return high


def events(alpha, duration, far=1, digits=30):
    """Return [(time/T, kind, velocity of the mass/v0)] of the events up to a duration; far = 1 clamped, -1 free."""
    with mp.workdps(digits + int(0.6 * duration) + 10):
        lam = 2 * mpf(alpha)
        vm, gap = mpf(1), mpf(0)
        in_contact = True
        now = mpf(0)
        emitted = []  # (start, stop, polynomial of p, counted from start)
        found = [(0.0, "close", 1.0)]
        while now < duration - MERGE:
            assert len(emitted) < 2000, (float(now), len(found))
            stop, q = mpf(duration), [mpf(0)]
            if now < 1:
                stop = min(stop, mpf(1))
            for start, end, poly in emitted:
                if start - MERGE <= now - 1 < end - MERGE:
                    q = [far * a for a in shifted(poly, lam, now - 1 - start)]
                    stop = min(stop, end + 1)
                    break
            width = stop - now
            if in_contact:
                # vm = exp(-lam y) (vm0 - 2 lam int Q)
                integral = [mpf(0)] + [a / (k + 1) for k, a in enumerate(q)]
                v = [-2 * lam * a for a in integral]
                v[0] += vm
                q_long = q + [mpf(0)] * (len(v) - len(q))
                s = [a + 2 * b for a, b in zip(v, q_long, strict=True)]
                p = [a + b for a, b in zip(v, q_long, strict=True)]
                rough = np.array([float(a / max(abs(b) for b in s)) if any(s) else 0.0 for a in s])
                zero = first_zero(lambda y, s=s: value(s, y), lambda y, r=rough: np.polyval(r[::-1], y), width)
                y = width if zero is None else zero
                if y > 0:
                    emitted.append((now, now + y, p))
                vm = value(v, y) * mp.e ** (-lam * y)
                now += y
                if zero is not None:
                    in_contact, gap = False, mpf(0)
                    found.append((float(now), "open", float(vm)))
            else:
                # gap' = face - vm = -2 q - vm
                u = primitive_exp([-2 * a for a in q], lam)

                def opening(y, u=u, vm=vm, gap=gap):
                    return gap + value(u, y) * mp.e ** (-lam * y) - u[0] - vm * y

                rough = np.array([float(a) for a in u])
                rate, speed, offset = float(lam), float(vm), float(gap) - float(u[0])

                def fast(y, r=rough, rate=rate, speed=speed, offset=offset, just=gap == 0):
                    answer = np.polyval(r[::-1], y) * np.exp(-rate * y) - speed * y + offset
                    # just opened: the gap starts as a cubic, below the rounding of this rough look
                    return np.where(np.abs(answer) < 1e-13, 0.0, answer) if just else answer

                zero = first_zero(opening, fast, width)
                y = width if zero is None else zero
                emitted.append((now, now + y, [-a for a in q]))
                gap = opening(y)
                now += y
                if zero is not None:
                    in_contact, gap = True, mpf(0)
                    found.append((float(now), "close", float(vm)))
        return found
