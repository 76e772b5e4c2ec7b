"""Calls in copies of this process."""

import os
import threading
from functools import partial

import pytest

from impactlab.report.side_by_side import side_by_side


def divided(number: int, by: int) -> float:
    return number / by


def test_results_come_in_the_order_of_the_calls():
    assert side_by_side([partial(divided, number, 2) for number in range(7)]) == [number / 2 for number in range(7)]
    assert side_by_side([]) == []


def test_an_exception_is_raised_here():
    with pytest.raises(ZeroDivisionError):
        side_by_side([partial(divided, 1, by) for by in (1, 0, 2)])


def test_beside_other_threads_all_calls_run_here():
    done = threading.Event()
    thread = threading.Thread(target=done.wait)
    thread.start()
    try:
        assert side_by_side([os.getpid, os.getpid]) == [os.getpid()] * 2
    finally:
        done.set()
        thread.join()
