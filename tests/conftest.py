"""Settings shared by all tests: random examples, and compilation before two workers start."""

from __future__ import annotations

import functools
import gc
import os
import re
import signal
from collections.abc import Generator
from pathlib import Path

import pytest
import typer.testing
from hypothesis import HealthCheck, settings

# Before numpy is imported: threads of linear algebra spin while they wait for a processor, which other workers use.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from impactlab.report import page

# In CI the same examples every time; elsewhere new ones at each run.
settings.register_profile(
    "impactlab",
    deadline=None,
    max_examples=50,
    print_blob=True,
    derandomize=bool(os.environ.get("CI")),
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("impactlab")
os.environ.setdefault("IMPACTLAB_COMPILERS", "1")  # the workers of the tests compile side by side already
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as a shell sets it for what it starts with &
    signal.signal(signal.SIGINT, signal.default_int_handler)  # processes that tests interrupt would ignore it, too
# Commands are made of their functions once in a process, as at a terminal; each call in a test would take 30 ms for it.
typer.testing._get_command = functools.cache(typer.testing._get_command)
# Workers keep all processors busy: figures of a page are drawn in them; in copies of them they take half as long again.
if "PYTEST_XDIST_WORKER" in os.environ:
    page.side_by_side = lambda calls: [call() for call in calls]
WAITING = ("test_bench_killed", "test_bench_workers", "test_sweep_cluster", "test_sweeps")
ALL_SLOW = re.compile(r"^pytestmark = .*\bmark\.slow\b", re.MULTILINE)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Import no module whose tests are all left out: all slow without slow ones, or none slow of slow ones alone."""
    wanted = config.option.markexpr
    if collection_path.suffix != ".py" or wanted not in ("slow", "not slow"):
        return None
    text = collection_path.read_text(encoding="utf-8")
    left_out = ALL_SLOW.search(text) if wanted == "not slow" else "mark.slow" not in text
    return True if left_out else None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with tests that wait for processes: at the end one of them would keep its worker alone for a minute."""
    items.sort(key=lambda item: item.path.stem not in WAITING)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Keep modules and tests, which stay to the end, out of the garbage collector's walks over all objects.

    The kernels are compiled once, a half in each of two workers: by the first before it imports the tests, whose
    bytecode the second writes meanwhile, and by the second afterwards.
    """
    worker = os.environ.get("PYTEST_XDIST_WORKER")
    if worker == "gw0":
        compile_kernels(0)
    gc.disable()
    try:
        result = yield
    finally:
        gc.freeze()
        gc.set_threshold(5000, 10, 20)  # by default its walks take 4 % of the time of the tests
        gc.enable()
    if worker == "gw1":
        compile_kernels(1)
    return result


@pytest.fixture
def _no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw no figures for pages of fits and sweeps, where files and messages are looked at."""
    for room in ("fits", "sweeps", "uncertainties"):
        monkeypatch.setattr(f"impactlab.{room}.page.write_figures", lambda *_: ([], ""))


def compile_kernels(number: int) -> None:
    """Compile a half of the kernels where they are not compiled yet."""
    from tests.compiling import compile_half

    compile_half(number)
