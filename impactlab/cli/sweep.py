"""The command ``sweep``: one case at many points."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from impactlab.cli.lazy_modules import axes, console, given_twice, sweeps
from impactlab.cli.options import CaseFile, Json, Method, Sets, Variant, command_line, load, names_in, option
from impactlab.cli.reporting import CommandFailed, reporting

MAX_COLUMNS = 24  # of a table on the screen: more are left out in its middle

Quantities = Annotated[
    str | None,
    option(
        "--quantities",
        "A,B,...",
        "Quantities to record (`impactlab plugins` lists them), or 'max(CHANNEL)', 'min(CHANNEL)'.",
    ),
]
Workers = Annotated[int, typer.Option("--workers", metavar="N", min=0, max=1024, help="Processes; 0 runs in this one.")]
Kept = Annotated[
    Path | None, option("--out", "DIR", "Folder of finished points and results; a sweep continues from it.")
]
Shard = Annotated[
    str | None, option("--shard", "K/N", "Compute part K of N only; a last call without it collects all parts in DIR.")
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
    case: CaseFile,
    over: Annotated[
        list[str] | None,
        option(
            "--over", "PATH=VALUES", "An axis: A,B,C or FIRST:LAST:COUNT, or FIRST:LAST:COUNTlog. Several make a grid."
        ),
    ] = None,
    points: Annotated[
        Path | None, option("--points", "FILE.csv", "Listed points, in place of axes: columns headed by path and unit.")
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
        read = [axes.read_over(loaded, text) for text in over or []]
        given_twice.refuse_twice(loaded, [path for path, _ in read])
        names = sweeps.DEFAULT if quantities is None else names_in(quantities)
        others = [*(f"--over={text}" for text in over or []), *([f"--points={points}"] if points is not None else [])]
        others += [f"--quantities={','.join(names)}"]
        console.log_compiling(loaded.simulation())
        with console.progress() as show:
            found = sweeps.sweep(
                loaded,
                dict(read) or None,
                points=axes.read_points(points) if points is not None else None,
                quantities=names,
                workers=workers,
                out=out,
                shard=shard,
                cluster=cluster,
                progress=lambda fraction: show(loaded.label, fraction),
                repeat=command_line("run", case, sets, method, variant, None).removesuffix(" --out DIR"),
                command=command_line("sweep", case, sets, method, variant, None, *others),
            )
        counts = sweeps.counts(found)
        if set(counts) - {"missing", "completed"}:
            console.say(f"first point without values: {sweeps.first_reason(found)}")
        if out is not None:
            console.say(f"written: {out}" if shard is None else f"shard {shard} is kept in {out}")
        if as_json:
            console.print_json({"schema_version": 1, "points": int(found.status.size), "status": counts})
        elif out is None:
            table = sweeps.rows(found)
            print(table.to_string(max_rows=60, max_cols=MAX_COLUMNS))
            if table.shape[1] > MAX_COLUMNS:  # as of a chain, whose contacts have columns each
                console.say(f"{table.shape[1]} columns; --quantities names fewer, --out DIR writes all to table.csv")
        else:
            print(f"{found.status.size} points: " + ", ".join(f"{count} {name}" for name, count in counts.items()))
        if set(counts) - {"missing", "completed"} and not counts.get("completed"):
            raise CommandFailed(1)
