"""The commands that show a run: ``report`` from its file, ``animate`` as a film."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from impactlab.cli.lazy_modules import (
    api,
    console,
    figure_files,
    files,
    film_files,
    output,
    progress_bar,
    provenance,
    run_report,
    sampling,
)
from impactlab.cli.options import CaseFile, Figures, Method, Sets, Variant, Width, load
from impactlab.cli.reporting import reporting


def report(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="history.nc, or a file of history.to_netcdf().")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Write the page and its figures into this folder.")],
    figures: Figures = None,
    width: Width = None,
) -> None:
    """Write the page of a run again, from its file, without another run."""
    with reporting(file, as_json=False):
        drawn_as = figure_files.figure_files(figures, width)
        output.check_target(out)
        kept = files.read_netcdf(file)
        origin = provenance.Provenance(**kept.texts) if kept.texts else provenance.of_case(kept.case)
        console.say(f"drawing figures for {out} ...")
        with output.output_folder(out) as draft:
            data = files.write_data(draft, kept.history, kept.summary, kept.reference, origin._asdict())
            run_report.write_run(draft, kept.summary, kept.history, kept.reference, origin, drawn_as, data)
        console.say(f"written: {out}")


def animate(
    case: CaseFile,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="The film: .gif, or .mp4 with ffmpeg.")],
    sets: Sets = None,
    method: Method = None,
    variant: Variant = None,
    seconds: Annotated[
        float, typer.Option("--seconds", metavar="S", min=0.5, max=120.0, help="Length of the film in s.")
    ] = 8.0,
) -> None:
    """Run a case and write a film of its bodies and its waves.

    Bodies are coloured by their load; waves are shown in their diagram.
    """
    with reporting(case, as_json=False):
        film_files.check_target(out)
        loaded = load(case, sets, method, variant)
        console.log_compiling()
        with progress_bar.progress() as show:
            history = api.run(loaded, lambda fraction: show(loaded.label, fraction), sampling.FRAMES)
        history.animate(out, seconds)
        console.say(f"written: {out}")
