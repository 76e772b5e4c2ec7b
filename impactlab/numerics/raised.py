"""Exceptions of compiled functions that the loop calls by address.

A C function cannot raise. Numba gives its exception to `sys.unraisablehook`, which prints it, and the caller goes on
with the results as they are. `keep_raised` puts a hook of its own in that place, for the calls of one thread.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Any

OF_NUMBA = "numba.core.cpu.CPUContext"  # the object that numba gives as the origin

_lock = threading.Lock()
_keepers = threading.local()
_before: list[Any] = []  # the hook that was there, for each call of `keep_raised` under way


class FirstException:
    """The first exception of compiled functions, None so far; ``react`` is called at each."""

    def __init__(self, react: Callable[[], None]) -> None:
        self.first: BaseException | None = None
        self.react = react


class keep_raised:  # noqa: N801 - a context, as those of contextlib
    """Keep the first exception that compiled functions raise inside.

    ``react`` is called at each, in place of printing. Other threads, and other exceptions that cannot be raised, keep
    the hook that was there before. The value of the context is a `FirstException`.
    """

    def __init__(self, react: Callable[[], None]) -> None:
        self._kept = FirstException(react)

    def __enter__(self) -> FirstException:
        self._outer: FirstException | None = getattr(_keepers, "kept", None)
        with _lock:
            if not _before:
                _before.append(sys.unraisablehook)
                sys.unraisablehook = _hook
            else:
                _before.append(_before[-1])
        _keepers.kept = self._kept
        return self._kept

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        _keepers.kept = self._outer
        with _lock:
            before = _before.pop()
            if not _before and sys.unraisablehook is _hook:
                sys.unraisablehook = before


def _hook(unraisable: Any) -> None:
    kept = getattr(_keepers, "kept", None)
    if kept is None or OF_NUMBA not in str(unraisable.object):
        before = _before[-1] if _before else sys.__unraisablehook__
        before(unraisable)
        return
    kept.first = kept.first or unraisable.exc_value
    kept.react()
