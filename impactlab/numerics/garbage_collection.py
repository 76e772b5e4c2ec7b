"""Python's garbage collector, paused where thousands of objects are made that all stay.

It walks over all objects whenever many have been made: in the set-up of ten thousand bodies that takes as long as the
work itself, and finds nothing. So it does while numba compiles.
"""

from __future__ import annotations

import gc
from types import TracebackType

MIN_PAUSED = 200  # bodies or contacts, from which the collector takes as long as the work itself


class GarbageCollectionPaused:
    """A context without garbage collection.

    Where the collector is off already it stays off.

    Parameters
    ----------
    count : int
        Bodies or contacts that are made inside: of fewer than `MIN_PAUSED` the collector is left alone.
    """

    def __init__(self, count: int = MIN_PAUSED) -> None:
        self._pauses = count >= MIN_PAUSED

    def __enter__(self) -> None:
        self._was_on = self._pauses and gc.isenabled()
        if self._was_on:
            gc.disable()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._was_on:
            gc.enable()
