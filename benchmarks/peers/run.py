"""The interface of a program, and the timing of its runs."""

from __future__ import annotations

import gc
import importlib.metadata
import importlib.util
import time
from collections.abc import Callable, Mapping
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from benchmarks.peers.cases import Case, Outcome

Setting = Mapping[str, Any]
Found = TypeVar("Found")


class Run(NamedTuple, Generic[Found]):
    """A prepared run: only ``solve`` is timed, once; ``outcome`` returns its results afterwards."""

    solve: Callable[[], None]
    outcome: Callable[[], Found]


def version_of(name: str) -> str | None:
    """Return the version of a distribution, or None where it is not installed."""
    return importlib.metadata.version(name) if importlib.util.find_spec(name) else None


class Peer(Protocol):
    """A program: a module of this room with these names."""

    NAME: str  # how tables call it
    LIBRARY: str  # what `version` is the version of

    def version(self) -> str | None:
        """Return its version, or None where it is not installed."""

    def settings(self, case: Case) -> list[dict[str, Any]]:
        """Return the settings a scan tries."""

    def build(self, case: Case, setting: Setting, record: bool) -> Run[Outcome]:
        """Return a run; without ``record`` a package writes nothing while it is timed."""


def timed(run: Run[Any]) -> tuple[float, float]:
    """Return the processor time and wall time of one solve [s].

    The collector is off; processor time is that of this thread.
    """
    gc.disable()
    try:
        wall, began = time.perf_counter(), time.thread_time()
        run.solve()
        spent, passed = time.thread_time() - began, time.perf_counter() - wall
    finally:
        gc.enable()
    return spent, passed
