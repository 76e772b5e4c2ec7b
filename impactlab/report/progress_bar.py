"""Progress bars on a terminal, of the commands and of long runs from Python."""

from __future__ import annotations

import contextlib
import sys
import threading
import time as clock
from collections.abc import Callable, Iterator
from multiprocessing import parent_process
from typing import Any

from impactlab.types import Progress

SHOWN_AFTER_S = 1.0  # of a run from Python: a shorter one, as in a loop, draws nothing

_drawing = threading.Lock()  # held while a bar may be drawn: two of them would overwrite each other


@contextlib.contextmanager
def progress() -> Iterator[Callable[[str, float], None]]:
    """Yield a function of (label, fraction done) that draws a progress bar.

    The bar has the time left, and is drawn on a terminal only.
    """
    with _free_terminal() as free:
        if not free:
            yield lambda _label, _fraction: None
            return
        with _bar() as bar:
            task = bar.add_task("", total=1.0)
            yield lambda label, fraction: bar.update(task, description=label, completed=fraction)


@contextlib.contextmanager
def of_long_run(label: str, choosing: bool, given: Progress | None = None) -> Iterator[Progress | None]:
    """Yield a function of the fraction done that draws a bar once a run has lasted `SHOWN_AFTER_S`.

    It yields None where no terminal is attached, in a worker, and while another bar is drawn.

    Parameters
    ----------
    label : str
        Name of the case, before the bar.
    choosing : bool
        Whether an automatic choice is made: each of its runs is counted, as the bar begins again with each.
    given : callable, optional
        A function of the fraction done that is yielded instead; no bar is drawn.
    """
    if given is not None:
        yield given
        return
    with _free_terminal() as free:
        if not free:
            yield None
            return
        bar = _LateBar(label, choosing)
        try:
            yield bar.show
        finally:
            bar.stop()


class _LateBar:
    """A bar that is drawn only if a run takes long: it begins with the first report after that time."""

    def __init__(self, label: str, choosing: bool) -> None:
        self.label, self.choosing = label, choosing
        self.began, self.runs, self.fraction = clock.perf_counter(), 0, 1.0
        self.bar: Any = None

    def show(self, fraction: float) -> None:
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

    def stop(self) -> None:
        """Remove the bar."""
        if self.bar is not None:
            self.bar.stop()


@contextlib.contextmanager
def _free_terminal() -> Iterator[bool]:
    """Yield whether a bar may be drawn: on a terminal, by the main process and thread, without another bar."""
    here = sys.stderr.isatty() and parent_process() is None and threading.current_thread() is threading.main_thread()
    free = here and _drawing.acquire(blocking=False)
    try:
        yield free
    finally:
        if free:
            _drawing.release()


def _bar() -> Any:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    return Progress(*columns, console=Console(stderr=True), transient=True)
