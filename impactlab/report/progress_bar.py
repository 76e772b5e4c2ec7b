"""Progress bars on a terminal, of the commands and of long runs from Python."""

from __future__ import annotations

import contextlib
import sys
import threading
import time as clock
from collections.abc import Callable, Iterator
from multiprocessing import parent_process
from typing import Any, Self

from impactlab.types import Progress

SHOWN_AFTER_S = 1.0  # of a run from Python: a shorter one, as in a loop, draws nothing

_drawing = threading.Lock()  # held while a bar may be drawn: two of them would overwrite each other


@contextlib.contextmanager
def progress() -> Iterator[Callable[[str, float], None]]:
    """Yield a function of (label, fraction done) that draws a progress bar.

    The bar has the time left, and is drawn on a terminal only.
    """
    if not _take_terminal():
        yield lambda _label, _fraction: None
        return
    try:
        with _bar() as bar:
            task = bar.add_task("", total=1.0)
            yield lambda label, fraction: bar.update(task, description=label, completed=fraction)
    finally:
        _drawing.release()


class LateBar:
    """A bar of a run from Python: it begins with the first report after `SHOWN_AFTER_S`.

    Parameters
    ----------
    label : str
        Name of the case, before the bar.
    choosing : bool
        Whether an automatic choice is made: each of its runs is counted, as the bar begins again with each.
    """

    def __init__(self, label: str, choosing: bool) -> None:
        self.label, self.choosing = label, choosing
        self.began, self.runs, self.fraction = clock.perf_counter(), 0, 1.0
        self.bar: Any = None

    def __call__(self, fraction: float) -> None:
        """Draw the fraction done; where it falls, another run of an automatic choice has begun."""
        self.runs += 1 if fraction < self.fraction else 0
        self.fraction = fraction
        if self.bar is None and clock.perf_counter() - self.began >= SHOWN_AFTER_S:
            self.bar = _bar()
            self.task = self.bar.add_task("", total=1.0)
            self.bar.start()
        if self.bar is not None:
            words = f"{self.label}: run {self.runs} of the automatic choice" if self.choosing else self.label
            self.bar.update(self.task, description=words, completed=fraction)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Remove the bar, so that another one may be drawn."""
        if self.bar is not None:
            self.bar.stop()
        _drawing.release()


def of_long_run(
    label: str, choosing: bool, given: Progress | None = None
) -> LateBar | contextlib.nullcontext[Progress | None]:
    """Return a context whose value takes the fraction done: ``given`` if it is, else a `LateBar`.

    Its value is None where no bar may be drawn (`_take_terminal`).
    """
    return LateBar(label, choosing) if given is None and _take_terminal() else contextlib.nullcontext(given)


def _take_terminal() -> bool:
    """Take the lock where a bar may be drawn: on a terminal, by the main process and thread, without another bar."""
    if not sys.stderr.isatty():
        return False
    here = parent_process() is None and threading.current_thread() is threading.main_thread()
    return here and _drawing.acquire(blocking=False)


def _bar() -> Any:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    return Progress(*columns, console=Console(stderr=True), transient=True)
