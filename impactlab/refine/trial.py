"""A run of the automatic choice, checked only if it is chosen.

Of several runs one is chosen, and the checks of a run take as long as the steps of a short one.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from functools import partial

from impactlab.exact.cost import StartedMarch
from impactlab.history.base import AbstractHistory
from impactlab.numerics.garbage_collection import GarbageCollectionPaused
from impactlab.scene.method import Simulation, is_exact
from impactlab.simulate import driver, stepped_run
from impactlab.simulate.checks import check_run
from impactlab.simulate.stepping import loop
from impactlab.simulate.stepping.results.history import RecordedHistory
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.startup.wall_time import spent_on
from impactlab.types import Progress

Check = Callable[[], None]  # of a run, once; raises `StepError` where it broke a balance


def run(
    made: Simulation, progress: Progress | None, begun: StartedMarch | None, like: Simulation | None
) -> tuple[AbstractHistory, Check]:
    """Return the history of a run without warnings, and its check.

    The check is left to be called. It raises as `impactlab.simulate.driver.run` does, except for what the check raises;
    ``begun``, ``like`` as there.
    """
    began = clock.perf_counter()
    if (like is None or like is made) and is_exact(*made):
        return driver.run(*made, progress, with_warnings=False, begun=begun), no_check
    with spent_on("set-up"), GarbageCollectionPaused():
        plan, assembly = stepped_run.prepared_like(made if like is None else like, *made)
        if plan.march is not None or assembly is None:
            return driver.run(*made, progress, with_warnings=False, like=like), no_check
    stepped, status = stepped_run.step_through(plan, assembly, progress, began)
    if status in (loop.LAW_FAILED, loop.NOT_FINITE):
        check_run(status, assembly, stepped)
    return stepped, partial(_checked, status, assembly, stepped)


def _checked(status: int, assembly: Assembly, history: RecordedHistory) -> None:
    began = clock.perf_counter()
    with spent_on("checks"), GarbageCollectionPaused():
        check_run(status, assembly, history)
    history.cost.checks_s = clock.perf_counter() - began


def no_check() -> None:
    """Check nothing: of a run that has been checked."""
