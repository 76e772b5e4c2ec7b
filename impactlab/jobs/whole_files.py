"""Files written whole or not at all, by renaming a temporary file."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

DRAFT = ".part"  # ending of a file that is being written


@contextlib.contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Yield the temporary path of a file, which then replaces ``path``."""
    draft = path.with_name(f"{path.name}{DRAFT}")
    yield draft
    draft.replace(path)


def write_whole(path: Path, text: str) -> None:
    """Write a text as a whole file."""
    with whole(path) as draft:
        draft.write_text(text, encoding="utf-8")
