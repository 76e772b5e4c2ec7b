"""The command line, whose commands import heavy modules on first use (`cli.lazy_modules`).

``--help`` is therefore quick.

Exit codes: 0 done, 1 a run failed, 2 the input is wrong, 130 after Ctrl-C.
"""

from __future__ import annotations

import gc
import io
import re
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from impactlab import __version__
from impactlab.cli import (
    bench,
    check_choose_cite,
    fit,
    new_cases,
    run_compare,
    saved_runs,
    schema_plugins,
    sweep,
)
from impactlab.cli.reporting import CommandFailed, left_without_output, output_fault, print_failure
from impactlab.errors import CaseError, ImpactlabError
from impactlab.startup.environment import check_environment

SETTING = ("--set", "--over", "--vary", "--parameters")  # options that take PATH=VALUE
UNIT = re.compile(r"[a-zA-Zµ%][\w*/^µ]{0,7}")
MIN_COLLECTED = 200_000
"""New objects (some 20 MB) before cycles are collected: by the default of 700, libraries load a sixth slower."""

app = typer.Typer(
    name="impactlab",
    help="Impacts of rods, beams, mechanisms and rigid bodies: run a case, compare methods, see cost and error.",
    no_args_is_help=True,
    rich_markup_mode=None,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"impactlab {__version__}")
        raise typer.Exit


START = "\b\nTo start:\n  impactlab new my_case --like pile\n  impactlab run my_case.yaml --out out"


@app.callback(epilog=START)
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    pass


# In this order --help lists them.
for command, summary, examples in (
    (
        run_compare.run,
        "Run one case; print and save its results.",
        [
            "impactlab run my_case.yaml",
            "impactlab run hopkinson_chain --method continuous --out out",
            "impactlab run my_case.yaml --set 'contacts.0.law={kind: penalty, stiffness: 1e9}' --json",
        ],
    ),
    (
        run_compare.compare,
        "Run all methods of a case and compare their errors.",
        ["impactlab compare axial_impact --out out", "impactlab compare my_case.yaml --methods base,elements"],
    ),
    (
        bench.bench,
        "Measure speed and error of many methods on many cases.",
        ["impactlab bench two_rods.yaml --methods exact,central_difference --out out/bench"],
    ),
    (
        sweep.sweep,
        "Run a case over a grid of values.",
        [
            "impactlab sweep axial_impact --method continuous --over 'bodies.hammer.mass=0.2 kg:20 kg:50log'",
            "impactlab sweep my_case.yaml --over contacts.0.gap=0,1e-4 --over method=base,elements --out out/sweep",
        ],
    ),
    (
        sweep.sensitivities,
        "Differentiate results by numbers of a case.",
        ["impactlab sensitivities axial_impact --method continuous --parameters bodies.hammer.mass,contacts.0.gap"],
    ),
    (
        fit.fit,
        "Fit numbers of a case to measured signals.",
        [
            "impactlab fit my_case.yaml data.csv --signal 'force [kN]=force:hammer|rod.left' \\",
            "    --parameters contacts.0.law.stiffness=1e8:1e10 --shift free --out out",
        ],
    ),
    (
        sweep.uncertainty,
        "Propagate uncertain inputs: percentiles, Sobol indices.",
        [
            "impactlab uncertainty axial_impact --method continuous --vary 'bodies.hammer.mass=normal(2.133 kg, 1 %)'",
            "impactlab uncertainty my_case.yaml --vary 'contacts.0.gap=uniform(0 mm, 0.1 mm)' --samples 1024 --out out",
        ],
    ),
    (saved_runs.report, "Make the page of a saved run again.", ["impactlab report out/history.nc --out again"]),
    (
        saved_runs.animate,
        "Write an animation of a run (.gif or .mp4).",
        ["impactlab animate hopkinson_chain -o waves.gif", "impactlab animate my_case.yaml -o waves.mp4"],
    ),
    (check_choose_cite.check, "Check a case; print all its values in SI.", ["impactlab check my_case.yaml"]),
    (
        check_choose_cite.choose,
        "Show how a tolerance chooses a method, and its cost.",
        ["impactlab choose two_material_rod --tolerance 1e-3"],
    ),
    (new_cases.new, "Write a commented case file to start from.", ["impactlab new my_test --like hopkinson"]),
    (
        new_cases.cases,
        "List, print or copy the bundled cases.",
        ["impactlab cases", "impactlab cases hopkinson_chain --copy"],
    ),
    (schema_plugins.schema, "Print the JSON schema of case files.", ["impactlab schema > case.schema.json"]),
    (
        schema_plugins.plugins,
        "List models, laws, integrators, ...; check one of them.",
        ["impactlab plugins", "impactlab plugins --check hertz"],
    ),
    (
        check_choose_cite.cite,
        "Print BibTeX entries of the sources a case uses.",
        ["impactlab cite my_case.yaml > sources.bib"],
    ),
):
    listed = "\b\nExamples:\n" + "\n".join(f"  {line}" for line in examples)
    app.command(short_help=summary, epilog=listed)(command)


def main() -> None:
    """Run the command line and exit with its exit code."""
    gc.set_threshold(MIN_COLLECTED)
    if isinstance(sys.stdout, io.TextIOWrapper) and "utf" not in sys.stdout.encoding.lower():
        sys.stdout.reconfigure(errors="replace")  # of letters that it lacks
    try:
        _run()
    except (SystemExit, OSError) as leaving:
        fault = output_fault(leaving)
        if fault is None:
            raise
        raise left_without_output(fault) from leaving
    finally:
        gc.freeze()  # else Python looks for cycles in all that libraries hold as it ends, for a quarter of a second


def _run() -> None:
    if "--help" not in sys.argv:
        _check_surroundings()
    try:
        app()
    except KeyboardInterrupt:
        sys.exit(130)
    except CommandFailed:
        raise
    except SystemExit as leaving:
        if leaving.code == 2 and (advice := quotes_for(sys.argv)):
            print(advice, file=sys.stderr)
        if leaving.code == 2 and "--json" in sys.argv:  # typer has printed the reason on standard error
            print_failure(None, CaseError("the command line is wrong", remedy="See standard error, or --help."))
        raise


def quotes_for(arguments: Sequence[str]) -> str:
    """Return the advice to quote a value with a unit, or nothing.

    The shell has split off the unit.
    """
    for option, value, unit in zip(arguments, arguments[1:], arguments[2:], strict=False):
        if option in SETTING and "=" in value and value[-1].isdigit() and UNIT.fullmatch(unit):
            return f"A value with a space needs quotes: {option} '{value} {unit}'."
    return ""


def _check_surroundings() -> None:
    """Leave with 2 where memory limits or environment variables rule out a run.

    Nothing heavy is imported.
    """
    try:
        check_environment()
    except ImpactlabError as error:
        print(error, file=sys.stderr)
        if "--json" in sys.argv:
            import json

            places = dict.fromkeys(("file", "line", "path"))
            fault = {"kind": type(error).__name__, **places, "text": error.text, "remedy": error.remedy}
            print(json.dumps({"schema_version": 1, "case": "", "status": "refused", "error": fault}, indent=1))
        raise CommandFailed(2) from None
