"""The command ``bench``: rows, table and report."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

import typer

from impactlab.cli.lazy_modules import (
    bench_report,
    benching,
    cells,
    console,
    figure_files,
    output,
    progress_bar,
    stability_report,
)
from impactlab.cli.lazy_modules import grid as grids
from impactlab.cli.options import Figures, Json, command_line, found, names_in, option
from impactlab.cli.reporting import CommandFailed, reporting


def bench(
    context: typer.Context,
    cases: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[CASES]...", help="Case files; by default those of the suite.", show_default=False),
    ] = None,
    suite: Annotated[
        str,
        typer.Option(
            "--suite",
            metavar="NAME",
            help="standard: cases/*.yaml here, or the bundled cases; hard: cases/hard/*.yaml.",
        ),
    ] = "standard",
    grid: Annotated[
        Path | None,
        option("--grid", "FILE", "Grid file in place of that of the suite; with extends: builtin in addition to it."),
    ] = None,
    methods: Annotated[
        str | None, option("--methods", "A,B,...", "Methods of the grid to run, own: those of the cases; default: all.")
    ] = None,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder of the rows and the table.")] = Path(
        "out/bench"
    ),
    jobs: Annotated[
        int, typer.Option("--jobs", metavar="N", min=0, max=1024, help="Processes; 0 for one per core.")
    ] = 1,
    repeats: Annotated[
        int, typer.Option("--repeats", metavar="N", min=1, max=1000, help="Largest number of repeats of a timed run.")
    ] = 9,
    no_timing: Annotated[bool, typer.Option("--no-timing", help="Leave out the times.")] = False,
    time_limit: Annotated[
        float,
        typer.Option(
            "--time-limit", metavar="S", min=0.001, max=1e6, help="Seconds after which a run is stopped as hung."
        ),
    ] = 60.0,
    no_report: Annotated[bool, typer.Option("--no-report", help="Leave out figures, tables and pages.")] = False,
    table: Annotated[
        Path | None, option("--from", "TABLE", "Run nothing: write the report of this table into DIR.")
    ] = None,
    figures: Figures = None,
    as_json: Json = False,
) -> None:
    """Measure speed against error: a grid of methods over cases, one row per run.

    Existing rows are kept.
    """
    with reporting(None, as_json):
        formats = figure_files.figure_files(figures, None).formats if figures else ()
        if table is not None:
            with _made(out):
                page = _draw_bench(out, table, jobs, suite, formats, "")
            if as_json:
                console.print_json({"schema_version": 1, "report": str(page)})
            return
        output.check_writable(out)
        files = cells.case_files([found(case) for case in cases or []], suite)
        names = names_in(methods) if methods is not None else None
        families = grids.chosen(grids.read_grid(grid or grids.of_suite(suite)), names)
        options = benching.Options(jobs, repeats, not no_timing, time_limit)
        console.log_compiling()
        with progress_bar.progress() as show:
            made = benching.bench(files, suite, families, out, options, names, show, console.say)
        counts = ", ".join(f"{count} {status}" for status, count in sorted(made.counts.items()))
        console.say(f"written: {out / 'table.csv'}")
        if made.first_reason:
            console.say(f"first row without a result: {made.first_reason}")
        if not no_report:
            _draw_bench(out, out / "table.csv", jobs, suite, formats, command_line(context))
        if as_json:
            console.print_json(made.document)
        else:
            print(f"{len(made.cells)} rows: {counts}")
        if made.cells and not made.counts["completed"]:
            raise CommandFailed(1)


@contextlib.contextmanager
def _made(folder: Path) -> Iterator[None]:
    """Make a folder if needed; remove it again after a failure if nothing was written."""
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    try:
        yield
    except BaseException:
        for each in missing:
            with contextlib.suppress(OSError):  # it is not empty
                each.rmdir()
        raise


def _draw_bench(out: Path, table: Path, jobs: int, suite: str, formats: Sequence[str], command: str) -> Path:
    """Draw the report of a table and return its page.

    Nothing is timed, so any number of processes may draw.
    """
    if suite == "hard":
        count = stability_report.write_stability(out, table)
        console.say(f"written: {out / 'stability.html'}; violations: {count}")
        return out / "stability.html"
    console.say(f"drawing figures for {out} ...")
    with progress_bar.progress() as show:
        bench_report.write_bench(
            out, table, jobs or os.cpu_count() or 1, lambda fraction: show("report", fraction), formats, command
        )
    console.say(f"written: {out / 'index.html'}")
    return out / "index.html"
