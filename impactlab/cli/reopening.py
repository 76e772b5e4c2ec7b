"""The command that shows a run from its file: ``report``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from impactlab.cli.reporting import reporting
from impactlab.cli.rooms import console, files, output, provenance, run_report


def report(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="history.nc, or what history.to_netcdf() wrote.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Write the page and its figures into this folder.")],
) -> None:
    """Write the page of a run again, from its file: nothing is computed anew."""
    with reporting(file, as_json=False):
        output.check_target(out)
        kept = files.read_netcdf(file)
        origin = provenance.Provenance(**kept.texts) if kept.texts else provenance.of_case(kept.case)
        console.say(f"drawing figures for {out} ...")
        with output.output_folder(out) as draft:
            files.write_data(draft, kept.history, kept.summary, kept.reference, origin._asdict())
            run_report.write_run(draft, kept.summary, kept.history, kept.history.scene, kept.reference, origin)
        console.say(f"written: {out}")
