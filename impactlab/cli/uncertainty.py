"""The command ``uncertainty``: one case at samples of its uncertain numbers."""

from __future__ import annotations

from typing import Annotated

import typer

from impactlab.cli.lazy_modules import axes, console, given_twice, sweeps, uncertainties
from impactlab.cli.options import CaseFile, Json, Method, Sets, Variant, command_line, load, names_in, option
from impactlab.cli.reporting import CommandFailed, given_by, reporting
from impactlab.cli.sweep import Cluster, Kept, Quantities, Shard, Workers
from impactlab.errors import CaseError


def uncertainty(
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
        bool, typer.Option("--indices/--no-indices", help="Sobol indices; d numbers take d + 2 times the runs.")
    ] = True,
    failed: Annotated[str, typer.Option("--failed", help="How to treat failed points: stop, or leave_out.")] = "stop",
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
        options = [*(f"--vary={text}" for text in vary), f"--samples={samples}", f"--seed={seed}"]
        options += [f"--quantities={','.join(names)}", f"--percentiles={percentiles}", f"--failed={failed}"]
        options += [] if indices else ["--no-indices"]
        console.log_compiling(loaded.simulation())
        with given_by("--vary", axes.BY_DRAWING), console.progress() as show:
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
                repeat=command_line("run", case, sets, method, variant, None).removesuffix(" --out DIR"),
                command=command_line("uncertainty", case, sets, method, variant, None, *options),
            )
        if out is not None:
            console.say(f"written: {out}" if shard is None else f"shard {shard} is kept in {out}")
        console.print_json(found.to_dict()) if as_json else print(found)
        if not sweeps.counts(found.data).keys() & {"missing", "completed", "tolerance_not_met"}:
            raise CommandFailed(1)


def _percent(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise CaseError(
            f"the percentile {text!r} is not a number", path="--percentiles", remedy="Write 5,50,95, for example."
        ) from None
