"""Files that are there whole or not at all: written under a temporary name, then renamed."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

DRAFT = ".part"  # ending of a file that is being written


@contextlib.contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Give the temporary path of a file to write, which then takes the place of ``path``."""
    draft = path.with_name(f"{path.name}{DRAFT}")
    yield draft
    draft.replace(path)


def write_whole(path: Path, text: str) -> None:
    """Write a text as a whole file."""
    with whole(path) as draft:
        draft.write_text(text, encoding="utf-8")
