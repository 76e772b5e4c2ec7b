"""Bisection of a condition that is true or false."""

from __future__ import annotations

import math
from collections.abc import Callable


def bisected(differs: Callable[[float], bool], same: float, other: float, halvings: int) -> tuple[float, float]:
    """Return two close places between which a property changes (bisection).

    Parameters
    ----------
    differs : callable
        Whether the condition at a place differs from that at ``same``.
    same, other : float
        Places without and with such a difference.
    halvings : int
        How often the interval is halved, at most.
    """
    for _ in range(halvings):
        middle = 0.5 * (same + other)
        if not math.isfinite(middle) or middle in (same, other):
            break
        same, other = (same, middle) if differs(middle) else (middle, other)
    return same, other
