"""The command ``sensitivities``: derivatives of results of a run by numbers of its case."""

from __future__ import annotations

from typing import Annotated

from impactlab.cli.lazy_modules import console, derivatives
from impactlab.cli.options import CaseFile, Json, Method, Sets, Variant, load, names_in, option
from impactlab.cli.reporting import given_by, reporting


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
        console.print_json(found.to_dict()) if as_json else print(found)
