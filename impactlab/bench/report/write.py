"""Writes the report of a bench from its table alone, beside the files of the bench."""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

from impactlab.bench.report.looks import looks
from impactlab.bench.report.pages import FOLDERS, draw_scene, write_index
from impactlab.bench.report.read import read_table
from impactlab.bench.report.views import gathered
from impactlab.errors import CaseError

PARTS = (*FOLDERS, "index.html")  # the files and folders of a report, the page last: it comes when all else is there
STABILITY = ("stability.md", "stability.html")
DRAFT = ".report."  # begins the name of a folder in which a report is made, the number of its process follows
MANIFEST = ".impactlab-report"
"""Names the files of a report in its folder, so that nothing else is ever replaced."""


def write_bench(
    out_dir: Path,
    table_path: Path,
    cores: int = 1,
    progress: Callable[[float], None] = lambda _: None,
    formats: Sequence[str] = (),
    command: str = "",
) -> None:
    """Write ``index.html``, ``figures/`` and ``tables/`` into a folder, from the table alone.

    An earlier report there is replaced; all else in the folder stays. The new one is made beside it first, so that a
    failure leaves the old one whole.

    Parameters
    ----------
    out_dir : Path
        An existing folder, as a rule that of the table.
    table_path : Path
        The table: CSV, plain or compressed by gzip.
    cores : int
        Processes that draw at the same time.
    progress : callable, optional
        Called with the fraction that is drawn.
    formats : sequence of str
        Draw all figures, in these formats; if empty, one of each scene, of the map and of the profiles, as SVG.
    command : str
        The command that repeats the bench, as the page shows it.

    Raises
    ------
    CaseError
        If the file is not the table of a bench, or the folder holds files of others where the report would stand.
    """
    check_report(out_dir, PARTS)
    rows = read_table(table_path)
    scenes = gathered(rows)
    with replaced(out_dir, PARTS) as draft, contextlib.ExitStack() as stack:
        for name in FOLDERS:
            (draft / name).mkdir()
        look = looks(scenes)
        each: Callable[..., Iterable[str]] = map
        if min(cores, len(scenes)) > 1:
            each = stack.enter_context(ProcessPoolExecutor(min(cores, len(scenes), os.cpu_count() or 1))).map
        drawn = []
        for name in each(partial(draw_scene, draft, tuple(formats), look), scenes):
            drawn.append(name)
            progress(len(drawn) / (len(scenes) + 1))
        write_index(draft, rows, scenes, look, drawn, formats, command)
    progress(1.0)


@contextlib.contextmanager
def replaced(out_dir: Path, parts: Sequence[str]) -> Iterator[Path]:
    """Give a folder for the parts of a report, which then take the places of those of the last report.

    Raises
    ------
    CaseError
        If one of them would replace a file that no report wrote.
    """
    check_report(out_dir, parts)
    _sweep(out_dir)
    draft = Path(tempfile.mkdtemp(prefix=f"{DRAFT}{os.getpid()}.", dir=out_dir))
    try:
        yield draft
        check_report(out_dir, parts)  # it may have changed while the report was made
        written = {name for part in parts for name in _files(draft, part)}
        before = _written(out_dir)
        others = {name for name in before if Path(name).parts[0] not in parts}
        _record(out_dir, written | before)
        for part in parts:
            _move(draft / part, out_dir / part)
        _record(out_dir, written | others)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _sweep(out_dir: Path) -> None:
    """Delete the drafts of killed reports; a report at work keeps its folder."""
    if sys.platform == "win32":
        return  # it has no signal that tests for a process without ending it
    for path in out_dir.glob(f"{DRAFT}*"):
        try:
            os.kill(int(path.name.removeprefix(DRAFT).partition(".")[0]), 0)
        except (ValueError, ProcessLookupError):
            shutil.rmtree(path, ignore_errors=True)
            path.unlink(missing_ok=True)
        except OSError:
            continue  # a running process of another user


def check_report(out_dir: Path, parts: Sequence[str]) -> None:
    """Raise `CaseError` if a report would replace files that no report wrote."""
    if not out_dir.is_dir():
        raise CaseError(f"there is no folder {str(out_dir)!r} to write in", remedy="Make it, or give another --out.")
    known = _written(out_dir)
    strangers = sorted(name for part in parts for name in _files(out_dir, part) if name not in known)
    if strangers:
        raise CaseError(
            f"the report would replace {strangers[0][:80]!r} in {str(out_dir)!r}, which no report wrote",
            remedy="Give another --out.",
        )


def _files(folder: Path, part: str) -> list[str]:
    """Return the names of the files of one part of a report."""
    top = folder / part
    if top.is_symlink() or top.is_file():
        return [part]
    return [str(path.relative_to(folder)) for path in top.rglob("*") if path.is_symlink() or not path.is_dir()]


def _written(folder: Path) -> set[str]:
    manifest = folder / MANIFEST
    return set(manifest.read_text(encoding="utf-8").splitlines()) if manifest.is_file() else set()


def _record(folder: Path, names: set[str]) -> None:
    (folder / MANIFEST).write_text("\n".join(sorted(names)) + "\n", encoding="utf-8")


def _move(new: Path, target: Path) -> None:
    """Move a file or folder to a place; one that stands there is deleted."""
    if target.is_dir() and not target.is_symlink():
        shutil.rmtree(target)
    else:
        target.unlink(missing_ok=True)
    new.replace(target)
