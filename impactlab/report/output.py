"""Output folders, written under a temporary name and renamed: a reader sees all files or none."""

from __future__ import annotations

import contextlib
import os
import platform
import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from impactlab.errors import NO_ROOM, CaseError

DRAFT = ".impactlab-"  # in the names of folders that are being written; host and process follow
DAY = 86400.0  # s, after which a draft of another machine, or of a number that a process has again, is left over
MANIFEST = ".impactlab"
"""Names the files that impactlab wrote into a folder, so that only such a folder is ever replaced."""


def check_target(folder: Path) -> None:
    """Raise `CaseError` unless the folder is new, empty, or holds only files that impactlab wrote.

    Anything else may be somebody's work, and a run must not replace it.
    """
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise CaseError(f"the output {str(folder)!r} is not a folder", remedy="Give another --out.")
    parent = folder.absolute().parent
    if not parent.is_dir():
        raise CaseError(f"there is no folder {str(parent)!r} to write in", remedy="Make it, or give another --out.")
    check_writable(parent)
    if folder.is_dir():
        other_files = sorted(files_in(folder) - written_in(folder) - {MANIFEST})
        if other_files:
            raise CaseError(
                f"the output {str(folder)!r} holds files not written by impactlab, such as {other_files[0][:80]!r}",
                remedy="Give a new folder with --out.",
            )


def check_writable(folder: Path) -> None:
    """Raise `CaseError` unless a folder can be written.

    If it does not exist, the nearest one above it is checked, before a run.
    """
    place = next(each for each in (folder.absolute(), *folder.absolute().parents) if each.exists())
    try:
        new_draft(place, "check").rmdir()
    except OSError as error:
        if error.errno in NO_ROOM:
            raise
        raise CaseError(
            f"the folder {str(place)!r} cannot be written: {error.strerror}", remedy="Give another --out."
        ) from error


@contextlib.contextmanager
def output_folder(folder: Path) -> Iterator[Path]:
    """Yield a temporary folder that takes the place of ``folder`` on success only."""
    check_target(folder)
    target = folder.absolute()
    delete_old_drafts(target.parent)
    draft = new_draft(target.parent, target.name)
    try:
        yield draft
        record(draft, files_in(draft))
        draft.chmod(0o777 & ~_umask())
        if target.exists():
            check_target(target)  # it may have changed while the run went on
            old = new_draft(target.parent, target.name)
            target.replace(old / "old")
            draft.replace(target)
            shutil.rmtree(old)
        else:
            draft.replace(target)
    except BaseException:
        shutil.rmtree(draft, ignore_errors=True)
        raise


def new_draft(parent: Path, name: str) -> Path:
    """Return a new folder for an output, named also by host and process."""
    return Path(tempfile.mkdtemp(prefix=f".{name[:100]}{DRAFT}{_host()}-{os.getpid()}.", dir=parent))


def delete_old_drafts(parent: Path) -> None:
    """Delete the drafts in a folder, except those of processes at work."""
    for path in parent.glob(f".*{DRAFT}*"):
        host, _, number = path.name.rpartition(DRAFT)[2].partition(".")[0].rpartition("-")
        with contextlib.suppress(OSError):
            old = time.time() - path.lstat().st_mtime > DAY
            if old or (host == _host() and number.isdigit() and not _is_running(int(number))):
                shutil.rmtree(path, ignore_errors=True)


def _host() -> str:
    return "".join(letter for letter in platform.node() if letter.isalnum())[:40] or "host"


def _is_running(number: int) -> bool:
    if os.name != "posix":  # there os.kill would end it
        return True
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


def files_in(folder: Path, part: str = "") -> set[str]:
    """Return the files in a folder, or in its ``part``, by relative name."""
    top = folder / part
    if part and (top.is_symlink() or top.is_file()):
        return {part}
    return {str(path.relative_to(folder)) for path in top.rglob("*") if path.is_symlink() or not path.is_dir()}


def written_in(folder: Path, manifest: str = MANIFEST) -> set[str]:
    """Return the names of the files that impactlab recorded in a folder."""
    names = folder / manifest
    return set(names.read_text(encoding="utf-8").splitlines()) if names.is_file() else set()


def record(folder: Path, names: set[str], manifest: str = MANIFEST) -> None:
    """Record the names of the files that impactlab wrote into a folder."""
    (folder / manifest).write_text("\n".join(sorted(names)) + "\n", encoding="utf-8")


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
