"""Shards of a sweep and their locks.

Several programs compute them in one folder.

A program that computes a whole sweep holds ``sweep.lock`` to its end. A shard holds it only while it opens the folder,
then a lock of its own. The system frees a lock when its holder ends.
"""

from __future__ import annotations

import contextlib
import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from impactlab.casefile.text.words import shown
from impactlab.errors import CaseError
from impactlab.jobs.files import locked

LOCK, SHARD_LOCKS = "sweep.lock", "shard-*.lock"
PATIENCE_S = 10.0  # s that a shard waits for others to open the folder
MAX_SHARDS = 1_000_000
WAIT = "Wait for it, or give another --out."


class Shard(NamedTuple):
    """One of several equal parts of a sweep: every ``parts``-th chunk."""

    number: int  # from 1
    parts: int

    def has(self, chunk: int) -> bool:
        """Return whether a chunk, numbered from 0, belongs to it."""
        return chunk % self.parts == self.number - 1

    @property
    def lock(self) -> str:
        """Name of its lock file."""
        return f"shard-{self.number}-of-{self.parts}.lock"


def read_shard(given: str | tuple[int, int]) -> Shard:
    """Return the shard of a text ``K/N``, or of two numbers.

    Raise `CaseError` unless 1 <= K <= N.
    """
    text = given if isinstance(given, str) else "/".join(map(str, given))
    found = re.fullmatch(r"\s*(\d{1,7})\s*/\s*(\d{1,7})\s*", text)
    shard = Shard(int(found[1]), int(found[2])) if found else Shard(0, 0)
    if not 1 <= shard.number <= shard.parts <= MAX_SHARDS:
        raise CaseError(
            f"{shown(text)} is not a shard", path="--shard", remedy="Write K/N with K from 1 to N, as in 3/40."
        )
    return shard


@contextlib.contextmanager
def held(path: Path, shard: Shard | None, prepare: Callable[[], None] = lambda: None) -> Iterator[None]:
    """Hold the lock of a folder or shard.

    ``prepare`` is called first, while no other program opens the folder.

    Raises
    ------
    CaseError
        If another program is at work on the same points.
    """
    with contextlib.ExitStack() as kept:
        with contextlib.ExitStack() as opening:
            gate = opening.enter_context((path / LOCK).open("a"))
            until = time.monotonic() + (PATIENCE_S if shard else 0.0)
            while not locked(gate.fileno()):
                if time.monotonic() >= until:
                    raise CaseError(f"another sweep is at work in {str(path)!r}", path="--out", remedy=WAIT)
                time.sleep(0.05)
            for lock in sorted(path.glob(SHARD_LOCKS)):
                _refuse_overlap(lock, shard)
            if shard is None:
                kept.push(opening.pop_all())
            else:
                locked(kept.enter_context((path / shard.lock).open("a")).fileno())
            prepare()
        yield


def _refuse_overlap(lock: Path, shard: Shard | None) -> None:
    """Raise `CaseError` where the shard of a lock file has points of this sweep."""
    number, _, parts = lock.stem.removeprefix("shard-").partition("-of-")
    other = f"{number}/{parts}"
    if shard is not None and parts == str(shard.parts) and number != str(shard.number):
        return
    with lock.open("a") as stream:
        if locked(stream.fileno()):
            return
    here = "" if shard is None else f"; shard {shard.number}/{shard.parts} overlaps with it"
    raise CaseError(f"shard {other} is at work in {str(lock.parent)!r}{here}", path="--shard", remedy=WAIT)
