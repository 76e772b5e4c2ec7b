"""Writes everything that a bench shows, from its table alone."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from impactlab.bench.report.looks import Look, looks
from impactlab.bench.report.pages import Folders, write_case, write_index
from impactlab.bench.report.read import read_table
from impactlab.bench.report.views import SceneRows, gathered

PARTS = ("figures", "tables", "cases", "index.html")  # in this order they appear: the page comes last


def write_bench(
    out_dir: Path, table_path: Path, cores: int = 1, progress: Callable[[float], None] | None = None
) -> None:
    """Write ``index.html``, ``cases/``, ``figures/`` and ``tables/`` into a folder, from the table alone.

    What an earlier report left there is replaced; all else in the folder stays. Everything is made beside it first, so
    that a report that cannot be made leaves the old one whole.

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
        If the file is not the table of a bench.
    """
    rows = read_table(table_path)
    scenes = gathered(rows)
    draft = Path(tempfile.mkdtemp(prefix=".report.", dir=out_dir))
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
        for name in PARTS:
            _replace(out_dir / name, draft / name)
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    if progress is not None:
        progress(1.0)


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
    """Put what was made in the place of what was there."""
    if target.is_dir() and not target.is_symlink():
        shutil.rmtree(target)
    elif target.exists() or target.is_symlink():
        target.unlink()
    new.replace(target)
