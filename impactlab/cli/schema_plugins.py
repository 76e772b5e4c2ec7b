"""The commands ``schema`` and ``plugins``: the installed parts."""

from __future__ import annotations

from typing import Annotated

import typer

from impactlab.cli.lazy_modules import console, jsonschema, listings, registries, verdicts
from impactlab.cli.options import Json, option
from impactlab.cli.reporting import CommandFailed, reporting


def schema(builtin: Annotated[bool, typer.Option("--builtin", help="Leave out the parts of plugins.")] = False) -> None:
    """Print the JSON schema of case files, with the fields of every installed part."""
    with reporting(None, as_json=False):
        installed = registries.registry()
        console.print_json(jsonschema.case_schema(installed.only("impactlab") if builtin else installed))


def plugins(
    check_name: Annotated[
        str | None,
        option(
            "--check",
            "NAME",
            "Run the contract suite of this part and measure it; law:NAME where two kinds share a name.",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """List the installed models, contact laws and integrators; or check one of them.

    Broken ones are listed with the reason.
    """
    with reporting(None, as_json):
        if check_name is not None:
            console.log_compiling()
            found = verdicts.verdict(check_name, registries.registry())
            if as_json:
                console.print_json(found.document())
            else:
                print(console.verdict_text(found.document()))
            if not found.ok:
                raise CommandFailed(1)
            return
        listing = listings.listing(registries.registry())
        if as_json:
            console.print_json({"schema_version": 1, "parts": [line._asdict() for line in listing]})
            return
        group = ""
        for line in listing:
            if line.group != group:
                group = line.group
                print(group)
            words = f"broken: {line.fault}" if line.fault else line.description
            print(f"  {line.name:28} {words}  [{line.distribution}]")
