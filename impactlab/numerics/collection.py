"""The collector of unreachable objects, held back where thousands of objects are made that all stay.

It walks over all objects whenever many have been made: in the set-up of ten thousand bodies that takes as long as the
work itself, and finds nothing.
"""

from __future__ import annotations

import gc
from types import TracebackType


class Uncollected:
    """A context in which nothing is collected; where the collector is off already it stays off."""

    def __enter__(self) -> None:
        self._was_on = gc.isenabled()
        gc.disable()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._was_on:
            gc.enable()
