"""The chunks of a sweep: consecutive points, computed together and kept as one file each.

A file is written under a temporary name and renamed, so that it is there whole or not at all. One program at a time
holds the folder, by a lock that dies with it. ``sweep.json`` states what the chunks are of; another content is refused.
"""

from __future__ import annotations

import contextlib
import json
import os
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from impactlab.bench.store import locked
from impactlab.casefile.words import shown
from impactlab.errors import CaseError
from impactlab.types import Array

LOCK, CONTENT, CHUNKS, TEMPORARY = "sweep.lock", "sweep.json", "chunks", ".part"
OURS = {LOCK, CONTENT, CHUNKS, "sweep.nc", "table.csv", "figures"}
STATUSES = ("missing", "completed", "tolerance_not_met", "refused", "failed", "hung", "crashed")
"""Status of a point, by its number in the result; a point is missing until it is computed."""


class Chunk(NamedTuple):
    """Results of consecutive points."""

    first: int  # number of its first point
    status: NDArray[np.int8]  # (points,), place in `STATUSES`
    reason: tuple[str, ...]  # (points,), empty where the run ended well
    values: tuple[Array, ...]  # of each quantity (points, values at a point); NaN where missing


class Folder:
    """The folder of a sweep. Made by `opened`, which holds its lock, or to read one."""

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def content(self) -> dict[str, Any]:
        """What the sweep is of, as it was written."""
        try:
            found: dict[str, Any] = json.loads((self.path / CONTENT).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise CaseError(f"{str(self.path)!r} holds no sweep: {error}", remedy="Give the folder of one.") from None
        return found

    def put(self, chunk: Chunk) -> None:
        """Keep a chunk; it is there whole or not at all."""
        arrays: dict[str, Any] = {f"value{number}": values for number, values in enumerate(chunk.values)}
        arrays |= {"status": chunk.status, "reason": np.array(chunk.reason, dtype=str)}
        path = self.path / CHUNKS / f"{chunk.first:08d}.npz"
        draft = path.with_name(f"{path.name}{TEMPORARY}")
        with draft.open("wb") as stream:
            np.savez(stream, **arrays)
        draft.replace(path)

    def chunks(self) -> Iterator[Chunk]:
        """Give the chunks that are kept; a file that is none is deleted."""
        for path in sorted((self.path / CHUNKS).glob("*.npz")):
            try:
                with np.load(path, allow_pickle=False) as found:
                    values = tuple(found[f"value{number}"] for number in range(len(found.files) - 2))
                    yield Chunk(int(path.stem), found["status"], tuple(found["reason"].tolist()), values)
            except (OSError, ValueError, KeyError, zipfile.BadZipFile, EOFError):
                path.unlink(missing_ok=True)


@contextlib.contextmanager
def opened(path: Path, content: Mapping[str, Any]) -> Iterator[Folder]:
    """Give the folder of a sweep, made where there is none, and hold its lock.

    Raises
    ------
    CaseError
        If it holds other files, or a sweep of another content, or another program is at work in it.
    """
    if path.is_symlink() or (path.exists() and not path.is_dir()):
        raise CaseError(f"the output {str(path)!r} is not a folder", remedy="Give another --out.")
    strangers = sorted(each.name for each in path.iterdir() if each.name not in OURS) if path.is_dir() else []
    if strangers:
        text = f"the output folder {str(path)!r} holds files that no sweep wrote, such as {shown(strangers[0])}"
        raise CaseError(text, remedy="Give a new folder with --out.")
    (path / CHUNKS).mkdir(parents=True, exist_ok=True)
    with (path / LOCK).open("a") as lock:
        if not locked(lock.fileno()):
            raise CaseError(f"another sweep is at work in {str(path)!r}", remedy="Wait for it, or give another --out.")
        folder = Folder(path)
        if (path / CONTENT).exists():
            refuse_other(folder.content, content, path)
        else:
            draft = path / f"{CONTENT}.{os.getpid()}"
            draft.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
            draft.replace(path / CONTENT)
        for draft in (path / CHUNKS).glob(f"*{TEMPORARY}"):
            draft.unlink(missing_ok=True)
        yield folder


def refuse_other(before: Mapping[str, Any], now: Mapping[str, Any], path: Path) -> None:
    """Raise `CaseError` where a folder holds a sweep of another content, naming what differs."""
    now = json.loads(json.dumps(now))
    differing = [name for name in now if name not in ("command", "date") and before.get(name) != now[name]]
    if differing:
        raise CaseError(
            f"{str(path)!r} holds another sweep; different: {', '.join(differing)}",
            remedy="Give a new folder with --out, or remove this one.",
        )
