"""The commands for one case at many points: ``sweep``, ``uncertainty``, and ``sensitivities`` beside one point."""

from __future__ import annotations

import shutil
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from impactlab.cli.lazy_modules import (
    axes,
    axis_texts,
    console,
    derivatives,
    given_twice,
    progress_bar,
    sweeps,
    uncertainties,
)
from impactlab.cli.options import CaseFile, Json, Method, Sets, Variant, command_line, load, names_in, option, run_line
from impactlab.cli.reporting import CommandFailed, given_by, print_result, reporting
from impactlab.errors import CaseError, DoubtfulResult

if TYPE_CHECKING:
    import pandas

MIN_WIDTH = 120  # letters of a line where the width of the screen is not known
MAX_COLUMNS = 24  # of a table on the screen: more are left out in its middle

Quantities = Annotated[
    str | None,
    option(
        "--quantities",
        "A,B,...",
        "Quantities to record (`impactlab plugins` lists them), or 'max(CHANNEL)', 'min(CHANNEL)'.",
    ),
]
Workers = Annotated[
    int,
    typer.Option("--workers", metavar="N", min=0, max=1024, help="Number of worker processes; 0: run in this process."),
]
Kept = Annotated[
    Path | None,
    option("--out", "DIR", "Folder of finished points and results; an interrupted sweep continues from it."),
]
Shard = Annotated[
    str | None,
    option("--shard", "K/N", "Compute only part K of N; a last call without this option collects all parts in DIR."),
]
Cluster = Annotated[
    str | None,
    option(
        "--cluster",
        "ADDRESS",
        "Compute on a Dask cluster: tcp://HOST:PORT of its scheduler, or local:2 for two processes here.",
    ),
]


def sweep(
    context: typer.Context,
    case: CaseFile,
    over: Annotated[
        list[str] | None,
        option(
            "--over", "PATH=VALUES", "An axis: A,B,C or FIRST:LAST:COUNT, or FIRST:LAST:COUNTlog. Several make a grid."
        ),
    ] = None,
    points: Annotated[
        Path | None,
        option(
            "--points", "FILE.csv", "Points as rows of a table, in place of axes; columns are headed by path and unit."
        ),
    ] = None,
    quantities: Quantities = None,
    sets: Sets = None,
    method: Method = None,
    variant: Variant = None,
    workers: Workers = 0,
    out: Kept = None,
    shard: Shard = None,
    cluster: Cluster = None,
    as_json: Json = False,
) -> None:
    """Run one case at many points: a labelled table of results.

    Finished points are kept in DIR.
    """
    with reporting(case, as_json):
        loaded = load(case, sets, method, variant)
        read = [axis_texts.read_over(loaded, text) for text in over or []]
        given_twice.refuse_twice(loaded, [path for path, _ in read])
        names = sweeps.DEFAULT if quantities is None else names_in(quantities)
        console.log_compiling(loaded.simulation())
        with progress_bar.progress() as show, warnings.catch_warnings():
            warnings.simplefilter("ignore", DoubtfulResult)  # of a sweep without values: the reason is said below
            found = sweeps.sweep(
                loaded,
                dict(read) or None,
                points=axis_texts.read_points(points) if points is not None else None,
                quantities=names,
                workers=workers,
                out=out,
                shard=shard,
                cluster=cluster,
                progress=lambda fraction: show(loaded.label, fraction),
                repeat=run_line(context),
                command=command_line(context),
            )
        counts = sweeps.counts(found)
        if set(counts) - {"missing", "completed"}:
            console.say(f"first point without values: {sweeps.first_reason(found)}")
        _say_where(out, shard)
        if as_json:
            made = {"schema_version": 1, "points": int(found.status.size), "status": counts}
            console.print_json(made if out is not None else {**made, "rows": sweeps.rows(found).to_dict("records")})
        elif out is None:
            _print_table(sweeps.rows(found))
        else:
            print(f"{found.status.size} points: " + ", ".join(f"{count} {name}" for name, count in counts.items()))
        if set(counts) - {"missing", "completed"} and not counts.get("completed"):
            raise CommandFailed(1)


def _say_where(out: Path | None, shard: str | None) -> None:
    """Print the folder with the results."""
    if out is not None:
        console.say(f"written: {out}" if shard is None else f"shard {shard} is kept in {out}")


def _print_table(table: pandas.DataFrame) -> None:
    """Print the rows of a sweep, within the width of the screen."""
    known = table.dropna(axis="columns", how="all")  # quantities that no contact or body of the case has
    width = shutil.get_terminal_size((MIN_WIDTH, 0)).columns
    print(known.to_string(max_rows=60, max_cols=MAX_COLUMNS, float_format="{:.6g}".format, line_width=width))
    if table.shape[1] > MAX_COLUMNS:  # as of a chain, whose contacts have columns each
        console.say(f"{table.shape[1]} columns; --quantities names fewer, --out DIR writes all to table.csv")


def uncertainty(
    context: typer.Context,
    case: CaseFile,
    vary: Annotated[
        list[str],
        option(
            "--vary",
            "PATH=DISTRIBUTION",
            "An uncertain number: normal(MEAN, DEVIATION), lognormal(MEAN, DEVIATION), uniform(LOW, HIGH), "
            "table(VALUE: WEIGHT, ...) or table(FILE.csv, COLUMN).",
        ),
    ],
    samples: Annotated[int, typer.Option("--samples", metavar="N", help="Number of samples, a power of two.")] = 4096,
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Seed of the samples.")] = 1,
    quantities: Quantities = None,
    percentiles: Annotated[
        str, typer.Option("--percentiles", metavar="A,B,...", help="Percentiles, between 0 and 100.")
    ] = "5,50,95",
    indices: Annotated[
        bool,
        typer.Option(
            "--indices/--no-indices",
            help="Compute Sobol indices; with d uncertain numbers this takes d + 2 times the runs.",
        ),
    ] = True,
    failed: Annotated[
        str, typer.Option("--failed", help="Treatment of failed points for Sobol indices: stop, or leave_out.")
    ] = "stop",
    sets: Sets = None,
    method: Method = None,
    variant: Variant = None,
    workers: Workers = 0,
    out: Kept = None,
    shard: Shard = None,
    cluster: Cluster = None,
    as_json: Json = False,
) -> None:
    """Run one case at samples of its uncertain numbers, and print the spread.

    Printed are percentiles, probabilities of contacts and Sobol indices.
    """
    with reporting(case, as_json):
        loaded = load(case, sets, method, variant)
        read = [uncertainties.read_vary(text) for text in vary]
        given_twice.refuse_twice(loaded, [path for path, _ in read])
        names = uncertainties.DEFAULT if quantities is None else names_in(quantities)
        console.log_compiling(loaded.simulation())
        with given_by("--vary", axes.BY_DRAWING), progress_bar.progress() as show:
            found = uncertainties.uncertainty(
                loaded,
                dict(read),
                names,
                samples=samples,
                seed=seed,
                percentiles=[_percent(text) for text in names_in(percentiles)],
                indices=indices,
                failed=failed,
                workers=workers,
                out=out,
                shard=shard,
                cluster=cluster,
                progress=lambda fraction: show(loaded.label, fraction),
                repeat=run_line(context),
                command=command_line(context),
            )
        _say_where(out, shard)
        print_result(found, as_json)
        if not sweeps.counts(found.data).keys() & {"missing", "completed", "tolerance_not_met"}:
            raise CommandFailed(1)


def _percent(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise CaseError(
            f"the percentile {text!r} is not a number", path="--percentiles", remedy="Write 5,50,95, for example."
        ) from None


def sensitivities(
    case: CaseFile,
    parameters: Annotated[str, option("--parameters", "A,B,...", "Paths of numbers of the case.")],
    quantities: Annotated[
        str | None, option("--quantities", "A,B,...", "Quantities to differentiate (`impactlab plugins` lists them).")
    ] = None,
    sets: Sets = None,
    method: Method = None,
    variant: Variant = None,
    as_json: Json = False,
) -> None:
    """Print derivatives of results of a run by numbers of its case.

    Values at which the sequence of contacts changes are printed, too.
    """
    with reporting(case, as_json):
        loaded = load(case, sets, method, variant)
        console.log_compiling(loaded.simulation())
        names = derivatives.DEFAULT if quantities is None else names_in(quantities)
        with given_by("--parameters"):
            found = derivatives.sensitivities(loaded, names_in(parameters), names)
        print_result(found, as_json)
