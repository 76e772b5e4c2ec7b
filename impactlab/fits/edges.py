"""Changes of the sequence of contacts inside the intervals of a fit: the loss may have a kink there."""

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
    """A place between the solution and the end of an interval where the sequence of contacts changes."""

    x: Array  # (n,), scaled
    share: float  # of the way to the end


def change(closings: Callable[[Array], Closings | None], here: Closings, solution: Array, end: Array) -> Change | None:
    """Return where the sequence of contacts changes on the way from a solution to an end, None if it is the same.

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
