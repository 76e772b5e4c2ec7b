"""Changes of the sequence of contacts inside the intervals of a fit.

The loss may have a kink there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from impactlab.numerics.bisection import bisected
from impactlab.types import Array

HALVINGS = 8  # of the distance between two different sequences

Closings = Sequence[tuple[str, ...]]
"""The contacts that close in each experiment, in order."""


class Change(NamedTuple):
    """A place where the sequence of contacts changes.

    It lies between the solution and the end of an interval.
    """

    x: Array  # (n,), scaled
    share: float  # of the way to the end


def change(closings: Callable[[Array], Closings | None], here: Closings, solution: Array, end: Array) -> Change | None:
    """Return the change of contacts between a solution and an end, or None.

    It is None if the sequence of contacts is the same.

    Parameters
    ----------
    closings : callable
        From scaled unknowns to the contacts that close; None where there is no such run.
    here : sequence
        Those at the solution.
    """
    there = closings(end)
    if there is None or here == there:
        return None
    _, other = bisected(lambda share: closings(solution + share * (end - solution)) != here, 0.0, 1.0, HALVINGS)
    return Change(np.asarray(solution + other * (end - solution)), other)
