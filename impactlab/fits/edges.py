"""Changes of the sequence of contacts inside the intervals of a fit: the loss may have a kink there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from impactlab import api
from impactlab.casefile import Case
from impactlab.derivatives.exact import sequence
from impactlab.errors import ImpactlabError
from impactlab.types import Array

HALVINGS = 8  # of the distance between two different sequences


class Change(NamedTuple):
    """A place between the solution and the end of an interval where the sequence of contacts changes."""

    x: Array  # (n,), scaled
    share: float  # of the way to the end


Cases = Callable[[Array], Sequence[Case]]
"""The cases with values of the scaled unknowns."""


def closings(cases: Cases, x: Array) -> list[tuple[str, ...]] | None:
    """Return the contacts that close in each case, in order; None where one cannot be run."""
    try:
        with api.warnings_kept():
            histories = [api.run(case) for case in cases(x)]
    except ImpactlabError:
        return None
    return [tuple(contact for contact, kind in sequence(history) if kind == "close") for history in histories]


def change(cases: Cases, solution: Array, end: Array) -> Change | None:
    """Return where the sequence of contacts changes on the way from a solution to an end, None if it is the same."""
    here, there = closings(cases, solution), closings(cases, end)
    if there is None or here == there:
        return None
    same, other = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (same + other)
        is_same = closings(cases, solution + middle * (end - solution)) == here
        same, other = (middle, other) if is_same else (same, middle)
    return Change(np.asarray(solution + other * (end - solution)), other)
