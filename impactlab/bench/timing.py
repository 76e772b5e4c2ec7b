"""What a run costs: warmed up, repeated, the least of the repeats, and how far the middle one lies above it."""

from __future__ import annotations

import contextlib
import gc
import statistics
import time as clock
from collections.abc import Iterator
from functools import cache
from typing import Any

from impactlab import api
from impactlab.casefile import Case
from impactlab.history.base import Cost

REPEATS = 9  # at most
BUDGET = 0.03  # s of a row's repeats: a suite has thousands of rows
LONG, LONGER = 0.1, 1.0  # s of a run, up to which it is repeated three times, and twice whatever the budget


def repeats_of(spent: float, most: int) -> int:
    """Return the number of repeats of a run that took ``spent`` [s], warmed up."""
    least = 3 if spent <= LONG else 2 if spent <= LONGER else 1
    return min(most, max(least, int(BUDGET / max(spent, 1e-9))))


def times_of(case: Case, repeats: int = REPEATS) -> dict[str, Any]:
    """Return the cost of a case whose method is in place, ready for JSON; nothing else may run meanwhile.

    The first run warms up (compiles, fills caches) and says how often the budget allows to repeat; it is not counted.
    Garbage is collected before and not within, and linear algebra has one thread.

    Returns
    -------
    dict
        ``repeats``; ``setup_s``, ``solve_s``, ``checks_s``: the minimum over the repeats [s]; ``setup_spread_s``,
        ``solve_spread_s``: median less minimum [s]; ``choosing_s`` [s] of a run that chose its description itself.
    """
    from threadpoolctl import threadpool_limits

    scene, method = case.simulation()
    costs: list[Cost] = []
    choosing: list[float] = []

    def once() -> None:
        history = api.solve(scene, method)
        costs.append(history.cost)
        if history.choice is not None:
            choosing.append(history.choice.choosing_s)

    with threadpool_limits(limits=1), _without_collector():
        api.solve(scene, method)
        began = clock.perf_counter()
        once()
        for _ in range(repeats_of(clock.perf_counter() - began, repeats) - 1):
            once()
    return {"repeats": len(costs), **summed(costs), **({"choosing_s": min(choosing)} if choosing else {})}


def summed(costs: list[Cost]) -> dict[str, float]:
    """Return minima [s] and spreads [s] of repeated runs."""
    made: dict[str, float] = {}
    for part in ("setup_s", "solve_s", "checks_s"):
        spent = [float(getattr(cost, part)) for cost in costs]
        made[part] = min(spent)
        if part != "checks_s":
            made[f"{part.removesuffix('_s')}_spread_s"] = statistics.median(spent) - min(spent)
    return made


@cache
def settle() -> None:
    """Freeze imported objects for the garbage collector, once: collections are short then."""
    gc.collect()
    gc.freeze()


@contextlib.contextmanager
def _without_collector() -> Iterator[None]:
    gc.collect()
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()
