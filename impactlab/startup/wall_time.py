"""Wall time of a command by stage.

A stopwatch always runs for exactly one stage, so that the times of all add up to the whole. Stages nest: the time of
the inner one is not that of the outer one. Without a stopwatch, as in a session of Python, `spent_on` does nothing.
"""

from __future__ import annotations

import os
import time as clock
from pathlib import Path
from types import TracebackType

STARTING, LOADING, COMPILING = "starting", "loading", "compiling"
CHOOSING, REFERENCE = "choosing", "reference"
STAGES: dict[str, str] = {
    STARTING: "Python and the command line",
    LOADING: "importing libraries",
    COMPILING: "compiling code, or reading it from disk",
    "reading": "the case file",
    "checking": "the case",
    "set-up": "before the first step",
    "solving": "the steps, or the march",
    "checks": "of the finished run",
    CHOOSING: "trials of the automatic choice",
    REFERENCE: "and the errors against it",
    "writing": "summary, figures and files",
    "other": "between them",
}
"""All stages, with the work that each is."""
WHOLE = (CHOOSING, REFERENCE)  # stages whose runs are not separated
INSIDE = (LOADING, COMPILING)  # stages that stay apart in these, too


class WallTime:
    """A stopwatch by stage.

    Parameters
    ----------
    began : float
        Reading of `time.perf_counter` at its start [s].
    stage : str
        The first stage.
    """

    def __init__(self, began: float, stage: str = STARTING) -> None:
        self._began = self._since = began
        self._stack = [stage]
        self._spent: dict[str, float] = {}

    def enter(self, stage: str) -> None:
        """Begin a stage inside the present one."""
        present = self._stack[-1]
        self._book()
        self._stack.append(present if present in WHOLE and stage not in INSIDE else stage)

    def leave(self) -> None:
        """Go on with the stage before."""
        self._book()
        self._stack.pop()

    def change(self, stage: str) -> None:
        """End the present stage and begin another in its place."""
        self._book()
        self._stack[-1] = stage

    def _book(self) -> None:
        now = clock.perf_counter()
        present = self._stack[-1]
        self._spent[present] = self._spent.get(present, 0.0) + now - self._since
        self._since = now

    def seconds(self) -> dict[str, float]:
        """Return the seconds of each stage that took any, in the order of `STAGES`.

        They add up to the time so far.
        """
        self._book()
        return {stage: self._spent[stage] for stage in STAGES if stage in self._spent}


_watch: list[WallTime] = []


class spent_on:  # noqa: N801 - it reads as a phrase: with spent_on("reading")
    """Context whose time belongs to a stage of the stopwatch that runs, if any."""

    __slots__ = ("_stage", "_watch")

    def __init__(self, stage: str) -> None:
        self._stage = stage

    def __enter__(self) -> None:
        self._watch = _watch[-1] if _watch else None
        if self._watch is not None:
            self._watch.enter(self._stage)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._watch is not None:
            self._watch.leave()


class timed:  # noqa: N801 - likewise
    """Context with a stopwatch that began with this process."""

    def __enter__(self) -> WallTime:
        watch = WallTime(clock.perf_counter() - age_of_process())
        _watch.append(watch)
        watch.change("other")
        return watch

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        _watch.pop()


def age_of_process() -> float:
    """Return the time since this process began [s], to 0.01 s.

    It is 0 where the system does not give it. 0 also for a process in which a command before this one has run: that
    earlier start is not its own.
    """
    if _asked:
        return 0.0
    _asked.append(True)
    try:
        fields = Path("/proc/self/stat").read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
        return max(0.0, clock.clock_gettime(clock.CLOCK_BOOTTIME) - int(fields[19]) / os.sysconf("SC_CLK_TCK"))
    except (OSError, ValueError, IndexError, AttributeError):
        return 0.0


_asked: list[bool] = []
