"""Ctrl-C that Python drops inside destructors and callbacks of libraries.

There it is printed and forgotten.
"""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from types import FrameType


@contextlib.contextmanager
def remembered() -> Iterator[Callable[[], None]]:
    """Yield a function for loops that raises `KeyboardInterrupt` after Ctrl-C.

    Ctrl-C raises at once as well, so that nothing waits for the next call. Outside the main thread, and under a
    handler that the caller has set, signals are left alone.
    """
    pressed = False

    def remember(number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        pressed = True
        signal.default_int_handler(number, frame)

    def check() -> None:
        if pressed:
            raise KeyboardInterrupt

    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield check
        return
    previous = sys.unraisablehook

    def pass_on(dropped: sys.UnraisableHookArgs) -> None:
        if not issubclass(dropped.exc_type, KeyboardInterrupt):
            previous(dropped)

    sys.unraisablehook = pass_on
    signal.signal(signal.SIGINT, remember)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.unraisablehook = previous
