"""The command ``sensitivities``: derivatives of results of a run by numbers of its case."""

from __future__ import annotations

from typing import Annotated

import typer

from impactlab.cli.lazy_modules import console, derivatives
from impactlab.cli.options import CaseFile, Json, Method, Sets, Variant, load, names_in
from impactlab.cli.reporting import given_by, reporting


def sensitivities(
    case: CaseFile,
    parameters: Annotated[
        str, typer.Option("--parameters", metavar="A,B,...", help="Paths of numbers of the case.", show_default=False)
    ],
    quantities: Annotated[
        str | None,
        typer.Option(
            "--quantities",
            metavar="A,B,...",
            help="Quantities to differentiate (`impactlab plugins` lists them).",
            show_default=False,
        ),
    ] = None,
    sets: Sets = None,
    method: Method = None,
    variant: Variant = None,
    as_json: Json = False,
) -> None:
    """Print derivatives of results of a run by numbers of its case, and where the sequence of contacts changes."""
    with reporting(case, as_json):
        loaded = load(case, sets, method, variant)
        console.log_compiling(loaded.simulation())
        names = derivatives.DEFAULT if quantities is None else names_in(quantities)
        with given_by("--parameters"):
            found = derivatives.sensitivities(loaded, names_in(parameters), names)
        if as_json:
            console.print_json(found.to_dict())
        else:
            print(found)
