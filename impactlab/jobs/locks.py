"""Locks of files, which the system frees when their process ends."""

from __future__ import annotations

import sys


def locked(descriptor: int) -> bool:
    """Take the lock of a file and return whether it was free.

    The system frees it when the process ends.
    """
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
