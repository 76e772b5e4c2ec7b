"""The commands ``new`` and ``cases``: files to start from, and packaged cases."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from impactlab.cli.lazy_modules import casefile, console, starter
from impactlab.cli.options import Json
from impactlab.cli.reporting import reporting


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the case.", show_default=False)],
    like: Annotated[
        str, typer.Option("--like", metavar="KIND", help="hammer, hopkinson, pile, drill, ball, beam, chain or arm.")
    ] = "hammer",
) -> None:
    """Write NAME.yaml here: a commented case to start from."""
    with reporting(None, as_json=False):
        path = starter.write_starter(name, Path.cwd(), like)
        console.say(f"written: {path}\nRun it with: impactlab run {path.name}")


def cases(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="Case to print; without a name all cases are listed.")
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
                console.say(f"written: {starter.write_copy(file, file.stem, Path.cwd())}")
            else:
                print(file.read_text(encoding="utf-8"), end="")
            return
        titles = {each: casefile.load_case(file).title for each, file in starter.cases().items()}
        if as_json:
            console.print_json({"schema_version": 1, "cases": titles})
            return
        width = max(map(len, titles))
        print("\n".join(f"{each:{width}}  {title}" for each, title in titles.items()))
