"""Arguments that several commands share, and loading of the case that they name."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from impactlab.cli.lazy_modules import casefile, edit, settings_of, starter
from impactlab.errors import expect_path
from impactlab.startup.wall_time import spent_on

if TYPE_CHECKING:
    from impactlab.casefile import Case


def option(name: str, metavar: str, words: str) -> Any:
    """Return an option with a value, whose help does not show a default."""
    return typer.Option(name, metavar=metavar, help=words, show_default=False)


CaseFile = Annotated[
    Path,
    typer.Argument(
        metavar="CASE",
        help="Case file (.yaml, .toml, .json), or the name of a case that comes with impactlab.",
        show_default=False,
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Out = Annotated[Path | None, option("--out", "DIR", "Write history and figures into this folder.")]
Figures = Annotated[
    str | None, option("--figures", "A,B,...", "Also write all figures in these formats: svg, png, pdf.")
]
Width = Annotated[str | None, option("--width", "one|two", "Width of the figures: one or two columns of a journal.")]
Sets = Annotated[
    list[str] | None, option("--set", "PATH=VALUE", "Change a value, as in solve.step.dt=1e-7; may be repeated.")
]
Method = Annotated[str | None, option("--method", "NAME", "Use this method of the case.")]

Variant = Annotated[str | None, option("--variant", "NAME", "Use this variant of the case.")]

Metrics = Annotated[
    list[str] | None, option("--metric", "NAME", "Also evaluate this metric of a plugin; may be repeated.")
]


OF_CASE = ("case", "sets", "method", "variant")  # parameters of a command that name a case
NOT_REPEATED = ("out", "as_json", "figures", "width", "workers", "shard", "cluster", "jobs")  # do not change results


def command_line(context: typer.Context) -> str:
    """Return the command that repeats one in progress, as a shell takes it.

    Its output folder is left to be named.
    """
    names = [name for name in context.params if name not in NOT_REPEATED]
    return shlex.join(["impactlab", str(context.info_name), *_given(context, names)]) + " --out DIR"


def run_line(context: typer.Context) -> str:
    """Return the command that runs the case of a command in progress, as a shell takes it."""
    return shlex.join(["impactlab", "run", *_given(context, OF_CASE)])


def _given(context: typer.Context, names: Collection[str]) -> Iterator[str]:
    """Yield the words of the parameters of these names that differ from their defaults."""
    for known in context.command.params:
        given = context.params.get(str(known.name))
        if known.name not in names or given in (None, [], ()) or given == known.default:
            continue
        if isinstance(given, bool):
            yield known.opts[0] if given else known.secondary_opts[0]
            continue
        for each in given if isinstance(given, (list, tuple)) else [given]:
            if known.param_type_name != "argument":
                yield known.opts[0]
            yield each.name if isinstance(each, Path) else str(each)


def names_in(text: str) -> list[str]:
    """Return the names of an option that takes several, with commas between."""
    return [name.strip() for name in text.split(",") if name.strip()]


def found(case: Path) -> Path:
    """Return the file of a case, also by the name of a packaged one."""
    expect_path(case, "a command")
    return starter.case_file(case)


def load(
    file: Path, sets: list[str] | None, method: str | None, variant: str | None = None, metrics: list[str] | None = None
) -> Case:
    """Return the case that a command names, its variant and method chosen, its values set."""
    with spent_on("checking"):
        path = found(file)
        if sets or method or variant:  # values of the file that they replace are not checked
            settings = [edit.read_setting(setting, str(path)) for setting in sets or ()]
            loaded, tolerance = settings_of.load_with_settings(
                path, settings, variant=variant or "base", method=method or "base"
            )
            _report_tolerance(tolerance, settings)
        else:
            loaded = casefile.load_case(path)
        if metrics:
            loaded = loaded.with_settings([("metrics", [*loaded.checked.metrics, *metrics])], by="--metric")
        return loaded


def _report_tolerance(tolerance: Any, settings: list[tuple[str, Any]]) -> None:
    """Print the setting that replaces the tolerance of a case.

    From then on no error is bounded.
    """
    by = next((path for path, value in settings if edit.replaces_tolerance(path, value)), "")
    if isinstance(tolerance, float) and by and all(path != "solve.tolerance" for path, _ in settings):
        print(
            f"note: --set {by} takes the place of solve.tolerance {tolerance:g}: of model, integrator, step "
            "and laws, those that are not given have their defaults, and no error is bounded",
            file=sys.stderr,
        )
