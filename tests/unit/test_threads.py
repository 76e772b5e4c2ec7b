"""Threads that run the same case at once have arrays of their own, and plans checked in one leave the others alone."""

from __future__ import annotations

import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from types import FrameType
from typing import Any

import numpy as np
import pytest

from impactlab.contact.penalty import Penalty
from impactlab.integrators.newmark import Newmark
from impactlab.models.finite_element import FiniteElement
from impactlab.numerics import addresses
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import run
from impactlab.simulate.stepped_run import Prepared
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.testing.scenes import mass_on_rod

RUNS, THREADS = 40, 4


def struck(step: float) -> Simulation:
    return mass_on_rod(FiniteElement(8), Penalty(), Newmark(), StepRule(courant=step), round_trips=1.0)


def interrupted(prepared: Prepared, at: int) -> list[Assembly | None]:
    """Return the arrays of two runs; the second gets its own as the first has executed so many lines of its call."""
    found: list[Assembly | None] = []
    lines = 0

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        nonlocal lines
        if frame.f_code.co_filename != sys.modules[Prepared.__module__].__file__:
            return None
        lines += event == "line"
        if lines == at and not found:
            sys.settrace(None)
            found.append(prepared.assembly())
        return trace

    sys.settrace(trace)
    try:
        first = prepared.assembly()
    finally:
        sys.settrace(None)
    return [first, *found]


@pytest.mark.parametrize("runs_before", [0, 1, 2])
@pytest.mark.parametrize("at", [1, 2, 3, 4, 5, 6])
def test_two_runs_at_once_have_arrays_of_their_own(runs_before: int, at: int) -> None:
    prepared = Prepared(*struck(0.31))
    seen = [prepared.assembly() for _ in range(runs_before)]
    seen += interrupted(prepared, at)
    seen += [prepared.assembly()]
    states = [each.memory.state for each in seen if each is not None]
    assert len(states) == len(seen)
    assert len({state.ctypes.data for state in states}) == len(seen)
    kept = prepared.kept()
    assert kept is not None
    assert all(kept.memory.state is not state for state in states)


def test_a_case_that_threads_run_at_once_has_one_result() -> None:
    asked = struck(0.32)
    name, times = asked.scene.contacts[0].name, np.linspace(0.0, asked.scene.duration, 101)

    def bits(_: int) -> tuple[bytes, bytes]:
        history = run(*asked)
        return history.evaluate(times, f"force:{name}").tobytes(), history.energy.total.tobytes()

    with ThreadPoolExecutor(THREADS) as pool:
        assert len({*pool.map(bits, range(RUNS))}) == 1


def test_a_plan_that_one_thread_checks_leaves_the_runs_of_others_alone() -> None:
    seen: list[bool] = []
    with addresses.trial(), addresses.interpreted(1):
        assert addresses.in_trial()
        other = threading.Thread(target=lambda: seen.append(addresses.in_trial()))
        other.start()
        other.join()
    assert seen == [False]
    assert not addresses.in_trial()
