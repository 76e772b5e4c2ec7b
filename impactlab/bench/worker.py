"""The jobs of a worker process: run, reference, times.

A worker runs a cell, finds its reference, or times it. It writes no file to the store.
"""

from __future__ import annotations

import gc
import statistics
import time as clock
from functools import cache
from pathlib import Path
from typing import Any

from impactlab import api
from impactlab.bench.cells import Job
from impactlab.bench.references import References
from impactlab.bench.rows import row_of
from impactlab.casefile import Case
from impactlab.casefile.case import case_of
from impactlab.casefile.document import parse_yaml
from impactlab.history.base import Cost
from impactlab.jobs.sources import code_hash
from impactlab.numerics.threads import one_thread
from impactlab.simulate import driver

WARM_UP = """
schema_version: 1
bodies:
  hammer: {kind: mass, mass: 1.0, velocity: 1.0}
  rod: {kind: rod, length: 1.0, area: 1.0, material: {young: 1.0, density: 1.0}, ends: {right: clamped}}
contacts: [{between: [hammer, rod.left], law: {kind: addition_deletion}}]
solve: {duration: {round_trips: 0.6}, model: {kind: modal, modes: 2}, integrator: {kind: exact_modal}}
"""


_references = References()  # of the bench of this process
_read: tuple[Job, Case] | None = None  # the last job and its case: jobs come scene by scene
MAX_REPEATS = 9
BUDGET_S = 0.03  # of a row's repeats: a suite has thousands of rows
MAX_THRICE_S, MAX_TWICE_S = 0.1, 1.0  # of a run that is repeated three times, and twice, whatever the budget


def warm_up() -> None:
    """Run each loop once, so that several workers find compiled code on disk."""
    case = case_of("warm_up", "", parse_yaml(WARM_UP))
    for setting in (("solve.events", "dated"), ("solve.events", "located"), ("solve.model", {"kind": "continuous"})):
        driver.run(*case.with_settings([setting]).simulation())


def start(session: Path | None, code: str) -> None:
    """Prepare this process for `row`, `reference` and `times`.

    Raises `RuntimeError` for sources other than those of the owner.
    """
    global _references
    if code_hash() != code:
        raise RuntimeError("impactlab's sources changed while the bench ran. Start it again.")
    _references = References(session)


def _case(job: Job) -> Case:
    """Return the case of a job, read again when a job of another scene comes."""
    global _read
    if _read is None or (_read[0].file, _read[0].document) != (job.file, job.document):
        _read = (job, case_of(job.name, job.file, job.document))
    return _read[1]


def row(job: Job) -> dict[str, Any]:
    """Return the record of a cell; see `rows.row_of`."""
    return row_of(_case(job), job.method, job.settings, _references)


def reference(job: Job) -> None:
    """Find the reference of a cell and keep it in the folder that workers share."""
    _references.of(*api.physics_of(_case(job).solved_by(job.method, job.settings)))


def times(job: Job, repeats: int) -> dict[str, Any]:
    """Return the cost of a cell; see `times_of`."""
    settle()
    return times_of(_case(job).solved_by(job.method, job.settings), repeats)


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
