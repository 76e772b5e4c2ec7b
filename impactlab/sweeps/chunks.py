"""The chunks of a sweep: consecutive points, computed together and kept as one file each.

A file is written under a temporary name and renamed, so that it is there whole or not at all. ``sweep.json`` states
the sweep that the chunks belong to; another one is refused.
"""

from __future__ import annotations

import contextlib
import json
import os
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatch
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from impactlab.casefile.text.words import shown
from impactlab.errors import CaseError
from impactlab.jobs.files import DRAFT, whole, write_whole
from impactlab.sweeps.shards import LOCK, SHARD_LOCKS, Shard, held
from impactlab.types import Array

CONTENT, CHUNKS = "sweep.json", "chunks"
RESULTS = ("sweep.nc", "table.csv", "uncertainty.json", "figures", "index.html", "case.yaml", "citations.bib")
OURS = (LOCK, SHARD_LOCKS, CONTENT, CHUNKS, *RESULTS, f"*{DRAFT}")
WORDS = {
    "resolved": "its values in SI",
    "code": "the code of impactlab",
    "environment": "versions of libraries",
    "design": "the samples",
}
"""Parts of the content of a sweep in a message."""
MAY_DIFFER = ("command", "date", "chunk")  # of two sweeps with the same results
STATUSES = ("missing", "completed", "tolerance_not_met", "refused", "failed", "hung", "crashed")
"""Status of a point, by its number in the result; a point is missing until it is computed."""
ENGINES = ("none", "run", "batch")
"""How a point was computed, by its number in the result: by a run of its own, or in a batch of exact runs."""


class Chunk(NamedTuple):
    """Results of consecutive points."""

    first: int  # number of its first point
    status: NDArray[np.int8]  # (points,), place in `STATUSES`
    reason: tuple[str, ...]  # (points,), empty where the run ended well
    values: tuple[Array, ...]  # of each quantity (points, values at a point); NaN where missing
    engine: NDArray[np.int8]  # (points,), place in `ENGINES`


def joined(parts: Sequence[Chunk]) -> Chunk:
    """Return chunks that follow each other as one."""
    first, status, reason, values, engine = zip(*parts, strict=True)
    tables = tuple(np.concatenate(each) for each in zip(*values, strict=True))
    return Chunk(first[0], np.concatenate(status), tuple(chain(*reason)), tables, np.concatenate(engine))


class Folder:
    """The folder of a sweep, made by `opened` under its lock, or to read one."""

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def content(self) -> dict[str, Any]:
        """Case, axes, quantities and code of the sweep, as they were written."""
        try:
            found: dict[str, Any] = json.loads((self.path / CONTENT).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise CaseError(f"{str(self.path)!r} holds no sweep: {error}", remedy="Give the folder of one.") from None
        return found

    def put(self, chunk: Chunk) -> None:
        """Keep a chunk; it is there whole or not at all."""
        reasons, which = np.unique(np.array(chunk.reason, dtype=str), return_inverse=True)
        arrays: dict[str, Any] = {f"value{number}": values for number, values in enumerate(chunk.values)}
        arrays |= {"status": chunk.status, "reasons": reasons, "reason": which.astype(np.int32), "engine": chunk.engine}
        with whole(self.path / CHUNKS / f"{chunk.first:08d}.npz") as draft, draft.open("wb") as stream:
            np.savez(stream, **arrays)

    def chunks(self) -> Iterator[Chunk]:
        """Yield the chunks that are kept, without files that are none."""
        for path in sorted((self.path / CHUNKS).glob("*.npz")):
            with (
                contextlib.suppress(OSError, ValueError, KeyError, zipfile.BadZipFile, EOFError),
                np.load(path, allow_pickle=False) as found,
            ):
                count = sum(name.startswith("value") for name in found.files)
                values = tuple(found[f"value{number}"] for number in range(count))
                words = found["reasons"].tolist()
                reason = tuple(words[number] for number in found["reason"].tolist())
                yield Chunk(int(path.stem), found["status"], reason, values, found["engine"])


def refuse_folder(path: Path, content: Mapping[str, Any], shard: Shard | None) -> None:
    """Raise `CaseError` where a sweep cannot be kept in a folder; nothing is written.

    It may hold other files or another sweep, or another program is at work in it.
    """
    if path.is_symlink() or (path.exists() and not path.is_dir()):
        raise CaseError(f"the output {str(path)!r} is not a folder", path="--out", remedy="Give another --out.")
    if not path.is_dir():
        parent = next(each for each in path.absolute().parents if each.exists())
        if not parent.is_dir() or not os.access(parent, os.W_OK):
            text = f"the output folder {str(path)!r} cannot be made in {str(parent)!r}"
            raise CaseError(text, path="--out", remedy="Give another --out.")
        return
    other_files = sorted(each.name for each in path.iterdir() if not any(fnmatch(each.name, name) for name in OURS))
    if not (path / CONTENT).exists():
        other_files += [f"{CHUNKS}/{each.name}" for each in (path / CHUNKS).glob("*.npz")]
    if other_files:
        text = f"the output folder {str(path)!r} holds files that no sweep wrote, such as {shown(other_files[0])}"
        raise CaseError(text, path="--out", remedy="Give a new folder with --out.")
    if (path / CONTENT).exists():
        _refuse_other(path, content)
        with held(path, shard):
            pass


@contextlib.contextmanager
def opened(path: Path, content: Mapping[str, Any], shard: Shard | None = None) -> Iterator[Folder]:
    """Yield the folder of a sweep under a lock, made if it is missing.

    The lock is that of the folder, or of the shard.

    Raises
    ------
    CaseError
        If it holds a sweep of another content, or another program is at work on the same points.
    """
    folder = Folder(path)

    def prepare() -> None:
        if (path / CONTENT).exists():
            _refuse_other(path, content)
        else:
            write_whole(path / CONTENT, json.dumps(content, indent=1) + "\n")
        if shard is None:  # no other program writes
            for draft in path.rglob(f"*{DRAFT}"):
                draft.unlink(missing_ok=True)

    (path / CHUNKS).mkdir(parents=True, exist_ok=True)
    with held(path, shard, prepare):
        yield folder


def _refuse_other(path: Path, now: Mapping[str, Any]) -> None:
    """Raise `CaseError` where a folder holds a sweep of another content, naming the difference."""
    before, now = Folder(path).content, json.loads(json.dumps(now))
    differing = [name for name in now if name not in MAY_DIFFER and before.get(name) != now[name]]
    if differing:
        raise CaseError(
            f"{str(path)!r} holds another sweep; different: {', '.join(WORDS.get(name, name) for name in differing)}",
            path="--out",
            remedy="Give a new folder with --out, or remove this one.",
        )
