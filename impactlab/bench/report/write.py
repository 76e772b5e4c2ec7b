"""Writes the report of a bench from its table alone."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from impactlab.bench.report.looks import Look, looks
from impactlab.bench.report.pages import Folders, write_case, write_index
from impactlab.bench.report.read import read_table
from impactlab.bench.report.views import SceneRows, gathered
from impactlab.errors import CaseError

PARTS = ("figures", "tables", "cases", "index.html")  # in this order they appear: the page comes last
DRAFT = ".report."  # begins the name of a folder in which a report is made, the number of its process follows
STABILITY = ("stability.md", "stability.html")
MANIFEST = ".impactlab-report"
"""Names the files of a report in its folder, so that nothing else is ever replaced."""


def write_bench(
    out_dir: Path, table_path: Path, cores: int = 1, progress: Callable[[float], None] | None = None
) -> None:
    """Write ``index.html``, ``cases/``, ``figures/`` and ``tables/`` into a folder, from the table alone.

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

    Raises
    ------
    CaseError
        If the file is not the table of a bench, or the folder holds files of others where the report would stand.
    """
    check_report(out_dir)
    rows = read_table(table_path)
    scenes = gathered(rows)
    _sweep(out_dir)
    draft = Path(tempfile.mkdtemp(prefix=f"{DRAFT}{os.getpid()}.", dir=out_dir))
    try:
        folders = Folders(draft)
        for folder in (folders.figures, folders.tables, folders.cases):
            folder.mkdir()
        look = looks(scenes)
        cases: dict[str, list[SceneRows]] = {}
        for scene in scenes:
            cases.setdefault(scene.case, []).append(scene)
        _draw(folders, cases, look, cores, progress)
        write_index(folders, rows, scenes, look)
        written = sorted(name for part in PARTS for name in _files(draft, part))
        check_report(out_dir)  # it may have changed while the report was made
        (out_dir / MANIFEST).write_text("\n".join([*written, *_written(out_dir)]) + "\n", encoding="utf-8")
        others = _written(out_dir) & set(STABILITY)
        for name in PARTS:
            _replace(out_dir / name, draft / name)
        (out_dir / MANIFEST).write_text("\n".join([*written, *sorted(others)]) + "\n", encoding="utf-8")
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    if progress is not None:
        progress(1.0)


def _sweep(out_dir: Path) -> None:
    """Delete the drafts of killed reports; a report at work keeps its folder."""
    if sys.platform == "win32":
        return  # no harmless signal there tells whether a process lives
    for path in out_dir.glob(f"{DRAFT}*"):
        number = path.name.removeprefix(DRAFT).partition(".")[0]
        try:
            os.kill(int(number), 0)
        except (ValueError, ProcessLookupError):
            shutil.rmtree(path, ignore_errors=True)
            path.unlink(missing_ok=True)
        except OSError:
            continue  # it lives, and is another user's


def write_pages(out_dir: Path, pages: Mapping[str, str]) -> None:
    """Write pages into a folder beside what is there, by name; files of others are not replaced."""
    check_report(out_dir, tuple(pages))
    known = _written(out_dir)
    (out_dir / MANIFEST).write_text("\n".join(sorted(known | set(pages))) + "\n", encoding="utf-8")
    for name, text in pages.items():
        draft = out_dir / f"{DRAFT}{os.getpid()}.{name}"
        draft.write_text(text, encoding="utf-8")
        draft.replace(out_dir / name)


def check_report(out_dir: Path, parts: Sequence[str] = PARTS) -> None:
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


def _draw(
    folders: Folders,
    cases: dict[str, list[SceneRows]],
    look: dict[str, Look],
    cores: int,
    progress: Callable[[float], None] | None,
) -> None:
    """Write the pages of all cases, on several cores if asked."""
    work = [(folders, case, tuple(scenes), look) for case, scenes in cases.items()]
    total = sum(len(scenes) for scenes in cases.values()) + 1
    done = 0

    def tell(scenes: Sequence[SceneRows]) -> None:
        nonlocal done
        done += len(scenes)
        if progress is not None:
            progress(done / total)

    if min(cores, len(work)) <= 1:
        for folders_, case, scenes, look_ in work:
            write_case(folders_, case, scenes, look_)
            tell(scenes)
        return
    with ProcessPoolExecutor(min(cores, len(work), os.cpu_count() or 1)) as pool:
        waiting = [(pool.submit(write_case, *each), each[2]) for each in work]
        for future, scenes in waiting:
            future.result()
            tell(scenes)


def _replace(target: Path, new: Path) -> None:
    """Replace a file or folder by a new one."""
    if target.is_dir() and not target.is_symlink():
        shutil.rmtree(target)
    elif target.exists() or target.is_symlink():
        target.unlink()
    new.replace(target)
