"""Files written whole or not at all, by renaming a temporary file, and their locks."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

DRAFT = ".part"  # ending of a file that is being written


@contextlib.contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Yield the temporary path of a file, which then replaces ``path``; each process has its own."""
    draft = path.with_name(f"{path.name}.{os.getpid()}{DRAFT}")
    yield draft
    draft.replace(path)


def write_whole(path: Path, text: str) -> None:
    """Write a text as a whole file."""
    with whole(path) as draft:
        draft.write_text(text, encoding="utf-8")


def locked(descriptor: int) -> bool:
    """Take a file's lock until the process ends; return whether it was free."""
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
