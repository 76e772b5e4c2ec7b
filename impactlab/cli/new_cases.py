"""The commands ``new`` and ``cases``: files to start from; ``schema`` and ``plugins``: the installed parts."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from impactlab.cli.lazy_modules import casefile, console, jsonschema, listings, registries, starter, verdicts
from impactlab.cli.options import Json, option
from impactlab.cli.reporting import CommandFailed, reporting


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the case.", show_default=False)],
    like: Annotated[
        str, typer.Option("--like", metavar="KIND", help="hammer, hopkinson, pile, drill, ball, beam or chain.")
    ] = "hammer",
) -> None:
    """Write NAME.yaml here: a commented case to start from."""
    with reporting(None, as_json=False):
        path = starter.write_starter(name, Path.cwd(), like)
        console.say(f"written: {path}\nRun it with: impactlab run {path.name}")


def cases(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="Print this case; all are listed if none is given.")
    ] = None,
    copy: Annotated[bool, typer.Option("--copy", help="Write NAME.yaml here instead of printing it.")] = False,
    as_json: Json = False,
) -> None:
    """List the cases that come with impactlab, print one, or copy one here.

    All commands take them by name.
    """
    with reporting(None, as_json):
        if name is not None:
            file = starter.case_named(name)
            if copy:
                console.say(f"written: {starter.write_copy(file, name, Path.cwd())}")
            else:
                print(file.read_text(encoding="utf-8"), end="")
            return
        titles = {each: casefile.load_case(file).title for each, file in starter.cases().items()}
        if as_json:
            console.print_json({"schema_version": 1, "cases": titles})
            return
        width = max(map(len, titles))
        print("\n".join(f"{each:{width}}  {title}" for each, title in titles.items()))


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
            console.print_json(found.document()) if as_json else print(console.verdict_text(found.document()))
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
            print(
                f"  {line.name:28} {'broken: ' + line.fault if line.fault else line.description}  [{line.distribution}]"
            )
