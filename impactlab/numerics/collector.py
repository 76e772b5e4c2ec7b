"""Python's collector of cycles, paused while thousands of small objects are made that all stay."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

MANY = 200  # bodies or contacts, from which the collector takes as long as the work itself: it walks all that is kept


@contextmanager
def collector_paused(count: int) -> Iterator[None]:
    """Pause the collector inside where there are many bodies or contacts; it goes on afterwards, if it did before."""
    if count < MANY or not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
