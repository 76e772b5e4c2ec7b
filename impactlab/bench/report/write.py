"""Writer of the report of a bench, beside its files, from its table alone."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

from impactlab.bench.report.method_styles import styles_of
from impactlab.bench.report.pages import FOLDERS, draw_scene, write_index
from impactlab.bench.report.read import read_table
from impactlab.bench.report.views import gathered
from impactlab.errors import CaseError
from impactlab.report.output import delete_old_drafts, files_in, new_draft, record, written_in

PARTS = (*FOLDERS, "index.html")  # the files and folders of a report, the page last: it comes when all else is there
STABILITY = ("stability.md", "stability.html")
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
        styles = styles_of(scenes)
        each: Callable[..., Iterable[str]] = map
        if min(cores, len(scenes)) > 1:
            each = stack.enter_context(ProcessPoolExecutor(min(cores, len(scenes), os.cpu_count() or 1))).map
        drawn = []
        for name in each(partial(draw_scene, draft, tuple(formats), styles), scenes):
            drawn.append(name)
            progress(len(drawn) / (len(scenes) + 1))
        write_index(draft, rows, scenes, styles, drawn, formats, command)
    progress(1.0)


@contextlib.contextmanager
def replaced(out_dir: Path, parts: Sequence[str]) -> Iterator[Path]:
    """Yield a folder for the parts of a report.

    They then take the places of those of the last report.

    Raises
    ------
    CaseError
        If one of them would replace a file that no report wrote.
    """
    check_report(out_dir, parts)
    delete_old_drafts(out_dir)
    draft = new_draft(out_dir, "report")
    try:
        yield draft
        check_report(out_dir, parts)  # it may have changed while the report was made
        written = {name for part in parts for name in files_in(draft, part)}
        before = written_in(out_dir, MANIFEST)
        others = {name for name in before if Path(name).parts[0] not in parts}
        record(out_dir, written | before, MANIFEST)
        for part in parts:
            _move(draft / part, out_dir / part)
        record(out_dir, written | others, MANIFEST)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def check_report(out_dir: Path, parts: Sequence[str]) -> None:
    """Raise `CaseError` if a report would replace files that no report wrote."""
    if not out_dir.is_dir():
        raise CaseError(f"there is no folder {str(out_dir)!r} to write in", remedy="Make it, or give another --out.")
    known = written_in(out_dir, MANIFEST)
    other_files = sorted(name for part in parts for name in files_in(out_dir, part) if name not in known)
    if other_files:
        raise CaseError(
            f"the report would replace {other_files[0][:80]!r} in {str(out_dir)!r}, which no report wrote",
            remedy="Give another --out.",
        )


def _move(new: Path, target: Path) -> None:
    """Move a file or folder to a place; one that stands there is deleted."""
    if target.is_dir() and not target.is_symlink():
        shutil.rmtree(target)
    else:
        target.unlink(missing_ok=True)
    new.replace(target)
