"""The cost of a run: warm-up, repeats, minimum and spread.

The spread is the distance of the median of the repeats from their minimum.
"""

from __future__ import annotations

import gc
import statistics
import time as clock
from functools import cache
from typing import Any

from impactlab import api
from impactlab.casefile import Case
from impactlab.history.base import Cost
from impactlab.numerics.threads import one_thread

MAX_REPEATS = 9
BUDGET_S = 0.03  # of a row's repeats: a suite has thousands of rows
MAX_THRICE_S, MAX_TWICE_S = 0.1, 1.0  # of a run that is repeated three times, and twice, whatever the budget


def repeats_of(spent: float, most: int) -> int:
    """Return the number of repeats of a run that took ``spent`` [s], warmed up."""
    least = 3 if spent <= MAX_THRICE_S else 2 if spent <= MAX_TWICE_S else 1
    return min(most, max(least, int(BUDGET_S / max(spent, 1e-9))))


def times_of(case: Case, repeats: int = MAX_REPEATS) -> dict[str, Any]:
    """Return the cost of a case with its method, for JSON.

    No other program may run meanwhile. The first run warms up (compiles, fills caches) and is not counted, the second
    gives the number of repeats. Garbage is collected before and not within, and linear algebra has one thread.

    Returns
    -------
    dict
        ``repeats``; ``setup_s``, ``solve_s``, ``checks_s``: the minimum over the repeats [s]; ``setup_spread_s``,
        ``solve_spread_s``: median less minimum [s]; ``choosing_s`` [s] of a run that chose its description itself.
    """
    scene, method = case.simulation()
    costs: list[Cost] = []
    choosing: list[float] = []

    def once() -> None:
        history = api.solve(scene, method)
        costs.append(history.cost)
        if history.choice is not None:
            choosing.append(history.choice.choosing_s)

    with one_thread():
        api.solve(scene, method)
        gc.collect()
        collects = gc.isenabled()
        gc.disable()
        try:
            began = clock.perf_counter()
            once()
            for _ in range(repeats_of(clock.perf_counter() - began, repeats) - 1):
                once()
        finally:
            if collects:
                gc.enable()
    return {"repeats": len(costs), **summed(costs), **({"choosing_s": min(choosing)} if choosing else {})}


def summed(costs: list[Cost]) -> dict[str, float]:
    """Return minima [s] and spreads [s] of repeated runs."""
    spent = {part: [float(getattr(cost, part)) for cost in costs] for part in ("setup_s", "solve_s", "checks_s")}
    least = {part: min(each) for part, each in spent.items()}
    spreads = {part: statistics.median(spent[part]) - least[part] for part in ("setup_s", "solve_s")}
    return least | {f"{part.removesuffix('_s')}_spread_s": spread for part, spread in spreads.items()}


@cache
def settle() -> None:
    """Freeze imported objects for the garbage collector, once: collections are short then."""
    gc.collect()
    gc.freeze()
