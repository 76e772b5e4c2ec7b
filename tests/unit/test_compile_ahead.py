"""Functions compiled by other processes: kept on disk, waited for, and compiled here where another process fails."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import impactlab as il
from impactlab import api
from impactlab.numerics import ahead, compile_queue
from impactlab.numerics.addresses import COMPILED, FREE, RESPOND, is_missing, type_of
from impactlab.numerics.compile_queue import CompileQueue, Request
from impactlab.simulate import needed_kernels, stepped_run
from impactlab.simulate.stepping import loop

pytestmark = pytest.mark.skipif(not COMPILED, reason="nothing is compiled")
PATIENCE = 120.0  # s, for a process to start and compile on a busy machine
MODULE = """
def first(a, b):
    a[0] = 1.0


def second(a, b):
    a[0] = 2.0


def broken(a, b):
    a.nothing()
"""


def until(true: Callable[[], bool]) -> None:
    """Wait for something that another process does."""
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """Return a function that gives the request of a function of a module in a folder without compiled code."""
    name = f"asked_{tmp_path.name}"
    (tmp_path / f"{name}.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))
    return lambda function: Request(name, function, False, FREE, False)


def test_another_process_compiles_waiting_kernels_and_keeps_them_on_disk(asked):
    here: list[Request] = []
    queue = CompileQueue(1, here.append)
    first, second = asked("first"), asked("second")
    queue.add([first, asked("broken"), second])
    queue.add([first])  # waits once
    until(lambda: not is_missing(ahead.named(second), FREE, False))  # after the broken one, which ended nothing
    for request in (first, second):
        queue.before(*request[:2])
        assert not is_missing(ahead.named(request), FREE, False)
    assert not here
    files = list(Path(os.environ["NUMBA_CACHE_DIR"]).rglob("*.nbc"))
    assert len(files) == 2


def test_kernels_not_begun_are_left_to_their_caller(asked):
    queue = CompileQueue(0, lambda _: None)
    queue.add([asked("first")])
    queue.before(*asked("first")[:2])  # returns at once
    queue.add([asked("first")])  # not again
    assert not queue._waiting


def test_while_it_waits_a_process_compiles_kernels_not_begun(asked, monkeypatch):
    here: list[Request] = []
    queue = CompileQueue(0, here.append)
    first, second = asked("first"), asked("second")
    queue.add([first, second])
    assert queue._next() == first  # as a thread does for its process

    def compile_here(request: Request) -> None:
        here.append(request)
        queue._done(first)
        raise ValueError("no matter")

    queue._compile_here = compile_here
    queue.before(*first[:2])
    assert here == [second]


@pytest.mark.parametrize("program", ["import os; os._exit(3)", None])
def test_a_process_that_dies_or_does_not_start_keeps_nobody_waiting(asked, monkeypatch, tmp_path, program):
    if program is None:
        monkeypatch.setattr(compile_queue.sys, "executable", str(tmp_path / "no such program"))
    else:
        (tmp_path / "dying.py").write_text(program)
        monkeypatch.setattr(compile_queue, "WORKER", "dying")
    queue = CompileQueue(2, lambda _: None)
    queue.add([asked("first"), asked("second")])
    until(lambda: queue._ended == 2)
    queue.add([asked("broken")])  # no more processes
    assert not queue._threads
    for name in ("first", "second", "broken"):
        queue.before(*asked(name)[:2])


def test_a_process_that_does_not_reply_is_waited_for_up_to_a_limit(asked, monkeypatch):
    monkeypatch.setattr(compile_queue, "PATIENCE_S", 0.1)
    queue = CompileQueue(0, lambda _: None)
    queue.add([asked("first")])
    assert queue._next() == asked("first")  # as a thread does for its process, and no word after that
    queue.before(*asked("first")[:2])
    assert queue._under_way


def test_kernels_that_cannot_be_pickled_delay_nothing(asked):
    queue = CompileQueue(1, lambda _: None)
    queue.add([asked("first")._replace(signature=lambda: None)])  # not pickled
    until(lambda: queue._ended == 1)
    assert not queue._under_way


@pytest.mark.parametrize(("program", "count"), [("/opt/modeller", 1), (None, 1), ("/usr/bin/python3.11", 7)])
def test_a_program_that_holds_python_is_not_started_again(monkeypatch, program, count):
    monkeypatch.setenv(ahead.VARIABLE, "7")
    monkeypatch.setattr(ahead.sys, "executable", program)
    assert ahead.processes() == count


def test_kernels_are_handed_on_where_one_is_missing_and_found_by_name(monkeypatch):
    added: list[Any] = []

    class Queue:
        add = added.extend

        def before(self, *_: str) -> None:
            """Nothing to wait for."""

    monkeypatch.setattr(ahead, "queue", Queue)
    monkeypatch.setattr(ahead, "processes", lambda: 2)
    monkeypatch.setattr(ahead, "is_missing", lambda _: True)
    run = il.load_case("hammer_rod_wall").method("elements").simulation()
    with ahead.ahead(lambda: [*needed_kernels.of_steps(*run), *needed_kernels.of_exact()]):
        assert not added
        ahead.before_compiling(loop.start)
    names = [request.name for request in added]
    assert {"advance_dated", "advance", "end_error", "solve_several"} <= set(names)
    assert "start" not in names  # it is compiled here
    assert all(ahead.named(request) for request in added)
    before = list(added)
    ahead.before_compiling(loop.start)
    assert added == before


def test_kernels_that_cannot_be_cached_are_left_to_this_process():
    names: dict[str, Any] = {}
    exec(MODULE, names)  # without a file no place for compiled code
    assert not is_missing(names["first"], FREE, False)


def test_a_fault_of_a_later_kernel_stops_nothing_now(monkeypatch):
    monkeypatch.setattr(ahead, "processes", lambda: 2)

    def wrong() -> Any:
        raise il.CaseError("later")

    with ahead.ahead(wrong):
        ahead.before_compiling(loop.start)


def test_an_exact_run_needs_no_step_loop():
    case = il.load_case("axial_impact")
    assert not list(needed_kernels.of_steps(*case.method("continuous").simulation()))
    assert list(needed_kernels.of_steps(*case.simulation()))


def test_a_comparison_needs_the_code_of_all_its_methods(monkeypatch):
    case = il.load_case("axial_impact")
    given = api.code_ahead(case, ["base", "penalty", "continuous"])._kernels
    laws = [each.function for each in given() if each.signature is RESPOND]
    names = [each.function.__name__ for each in given()]
    assert len(laws) == 2
    assert "advance" in names
    assert "advance_dated" in names


def test_the_type_of_arrays_is_known_before_a_run():
    made = stepped_run.Prepared(*il.load_case("axial_impact").simulation()).kept()
    assert made is not None
    assert type_of(made.memory) is needed_kernels.type_of_arrays()


@pytest.mark.parametrize(("given", "count"), [("1", 1), ("7", 7), ("0", None), ("many", None), ("", None)])
def test_the_number_of_processes_is_that_of_processors_or_the_one_given(monkeypatch, given, count):
    monkeypatch.setenv(ahead.VARIABLE, given)
    own = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    assert ahead.processes() == (count or min(own or 1, ahead.MOST))
