"""The folder of a bench: each finished row is a file.

So no finished row is lost. A file is written under a temporary name and renamed, so that it is there whole or not at
all, whatever moment the process ends. One bench at a time holds the folder, by a lock that dies with its owner.

``rows/KEY.json`` the record of a run, ``times/KEY.json`` its times, ``cells.json`` the rows of the table,
``table.csv``, ``environment.json``, ``references.json``.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

from impactlab.errors import CaseError
from impactlab.jobs.files import DRAFT, locked, whole

LOCK = "bench.lock"
SESSION = "session-"  # a folder that lives as long as one bench
Kind = Literal["rows", "times"]


class Store:
    """A folder of rows. Made by `opened`, which holds the lock."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @property
    def session(self) -> Path:
        """The folder that is gone after this bench."""
        return self.folder / f"{SESSION}{os.getpid()}"

    def put(self, kind: Kind, key: str, record: Mapping[str, Any]) -> None:
        """Keep a record; it is there whole or not at all."""
        text = json.dumps(record, ensure_ascii=False, allow_nan=False, sort_keys=True, separators=(",", ":"))
        self.write(f"{kind}/{key}.json", text + "\n")

    def get(self, kind: Kind, key: str) -> dict[str, Any] | None:
        """Return a record, or None; a file that is not a record is deleted."""
        path = self.folder / kind / f"{key}.json"
        try:
            found = json.loads(path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return None
        except (ValueError, UnicodeDecodeError):
            path.unlink(missing_ok=True)  # cut short by something worse than a kill
            return None
        return found if isinstance(found, dict) else None

    def write(self, name: str, text: str) -> None:
        """Write a file of the folder under a temporary name and rename it."""
        with whole(self.folder / name) as draft:
            draft.write_text(text, encoding="utf-8", newline="\n")

    def write_json(self, name: str, data: Any, *, sort_keys: bool = False) -> None:
        """Write a document of the folder."""
        self.write(name, json.dumps(data, indent=1, sort_keys=sort_keys, ensure_ascii=False) + "\n")

    def delete_drafts(self) -> None:
        """Delete the drafts of benches that were killed."""
        for path in self.folder.rglob(f"*{DRAFT}"):
            path.unlink(missing_ok=True)
        for path in self.folder.glob(f"{SESSION}*"):
            shutil.rmtree(path, ignore_errors=True)


@contextlib.contextmanager
def opened(folder: Path) -> Iterator[Store]:
    """Give the store in a folder, made where there is none, and hold its lock.

    Raises
    ------
    CaseError
        If the folder holds files that no bench wrote, or another bench is at work in it.
    """
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise CaseError(f"the output {str(folder)!r} is not a folder", remedy="Give another --out.")
    if folder.is_dir() and not (folder / LOCK).exists() and any(folder.iterdir()):
        stranger = min(path.name for path in folder.iterdir())
        raise CaseError(
            f"the output folder {str(folder)!r} holds files that no bench wrote, such as {stranger[:80]!r}",
            remedy="Give a new folder with --out.",
        )
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / LOCK).open("a") as lock:
        if not locked(lock.fileno()):
            raise CaseError(
                f"another bench is at work in {str(folder)!r}", remedy="Wait for it, or give another --out."
            )
        store = Store(folder)
        for name in ("rows", "times"):
            (folder / name).mkdir(exist_ok=True)
        store.delete_drafts()
        store.session.mkdir()
        try:
            yield store
        finally:
            shutil.rmtree(store.session, ignore_errors=True)
