"""Calls that share nothing, run side by side in copies of this process."""

from __future__ import annotations

import gc
import multiprocessing
import os
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

R = TypeVar("R")
_calls: list[Callable[[], Any]] = []  # of the run in progress: copied with the process, so nothing is pickled


def side_by_side(calls: Sequence[Callable[[], R]]) -> list[R]:
    """Return the results of calls in their order, computed in parallel.

    Results must be picklable; exceptions are raised here. Each core takes its share in a copy of this process (fork).
    Where the system has no copies, on one core, or beside other threads, whose locks a copy would inherit, the calls
    run one after the other.
    """
    cores = len(os.sched_getaffinity(0)) if sys.platform == "linux" else 1
    if min(cores, len(calls)) < 2 or threading.active_count() > 1 or multiprocessing.current_process().daemon:
        return [call() for call in calls]
    _calls[:] = calls
    gc.freeze()  # a collection in a copy would visit, and so copy, all that the parent holds
    try:
        with multiprocessing.get_context("fork").Pool(min(cores, len(calls))) as pool:
            return pool.map(_called, range(len(calls)), chunksize=1)
    finally:
        gc.unfreeze()
        _calls.clear()


def _called(number: int) -> Any:
    return _calls[number]()
