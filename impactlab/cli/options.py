"""Arguments that several commands share, and loading of the case that they name."""

from __future__ import annotations

import shlex
import sys
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


def command_line(
    command: str,
    case: Path,
    sets: list[str] | None,
    method: str | None,
    variant: str | None,
    metrics: list[str] | None,
    *others: str,
) -> str:
    """Return the command that repeats a run, as a shell takes it.

    Its output folder is left to be named.
    """
    words = ["impactlab", command, case.name]
    for option, values in (
        ("--variant", [variant]),
        ("--method", [method]),
        ("--set", sets or []),
        ("--metric", metrics or []),
    ):
        words += [word for value in values if value is not None for word in (option, value)]
    return shlex.join([*words, *others]) + " --out DIR"


def names_in(text: str) -> list[str]:
    """Return the names of an option that takes several, with commas between."""
    return [name.strip() for name in text.split(",") if name.strip()]


def found(case: Path) -> Path:
    """Return the file of a case, also by the name of a packaged one."""
    expect_path(case, "a command")
    return case if case.suffix or case.exists() or len(case.parts) > 1 else starter.case_named(str(case))


def load(
    file: Path, sets: list[str] | None, method: str | None, variant: str | None = None, metrics: list[str] | None = None
) -> Case:
    """Return the case that a command names, its variant and method chosen, its values set."""
    with spent_on("checking"):
        return _loaded(file, sets, method, variant, metrics)


def _loaded(
    file: Path, sets: list[str] | None, method: str | None, variant: str | None, metrics: list[str] | None
) -> Case:
    if sets or method or variant:  # values of the file that they replace are not checked
        settings = [edit.read_setting(setting, str(found(file))) for setting in sets or ()]
        loaded, tolerance = settings_of.load_with_settings(
            found(file), settings, variant=variant or "base", method=method or "base"
        )
        _report_tolerance(tolerance, settings)
    else:
        loaded = casefile.load_case(found(file))
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
