"""The command ``fit``: numbers of a case from measured signals."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from impactlab.cli.lazy_modules import console, fits, output
from impactlab.cli.options import CaseFile, Json, Method, Sets, Variant, command_line, load, option
from impactlab.cli.reporting import given_by, print_result, reporting
from impactlab.errors import CaseError


def _of_instruments(name: str, words: str) -> Any:
    """Return the option of a setting of the instruments."""
    forms = "free, VALUE or LOW:HIGH; of one signal COLUMN=..."
    return option(f"--{name}", "SETTING", f"{words}: {forms}.")


def fit(
    context: typer.Context,
    case: CaseFile,
    data: Annotated[Path, typer.Argument(metavar="DATA.csv", help="Signals: columns headed by name and unit.")],
    parameters: Annotated[list[str], option("--parameters", "PATH=LOW:HIGH", "A number to fit, with bounds.")],
    signal: Annotated[
        list[str],
        option("--signal", "COLUMN=CHANNEL", "A column of the data and its channel, as 'force [kN]=force:a|b'."),
    ],
    experiment: Annotated[
        list[str] | None,
        option("--experiment", "CASE=DATA.csv", "Another case with its signals, fitted together with the first."),
    ] = None,
    gain: Annotated[list[str] | None, _of_instruments("gain", "Gain of the instruments")] = None,
    offset: Annotated[
        list[str] | None, _of_instruments("offset", "Offset of the instruments, in the unit of the channel")
    ] = None,
    shift: Annotated[
        list[str] | None,
        _of_instruments(
            "shift", "Start of the run on the clock of the instruments (common: one for all signals of a case)"
        ),
    ] = None,
    loss: Annotated[str, typer.Option("--loss", help="Loss: linear, or huber for signals with outliers.")] = "linear",
    noise: Annotated[
        str,
        typer.Option(
            "--noise",
            help=(
                "Noise of the signals: white; ar1, correlated from sample to sample; std, from columns "
                "headed std and the heading of the signal."
            ),
        ),
    ] = "white",
    bandwidth: Annotated[
        str,
        typer.Option(
            "--bandwidth",
            metavar="FREQUENCY",
            help="Low-pass filter of data and model, such as '100 kHz'; 0: no filter.",
        ),
    ] = "0",
    intervals: Annotated[
        str,
        typer.Option(
            "--intervals",
            metavar="A,B",
            help=(
                "Further intervals, besides those from derivatives: profile (likelihood), bootstrap "
                "(blocks of residuals)."
            ),
        ),
    ] = "jacobian",
    resamples: Annotated[int, typer.Option("--resamples", help="Number of fits of the bootstrap.")] = 500,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the bootstrap.", min=0)] = 0,
    sets: Sets = None,
    method: Method = None,
    variant: Variant = None,
    out: Annotated[Path | None, option("--out", "DIR", "Write the fitted case, numbers and a page here.")] = None,
    as_json: Json = False,
) -> None:
    """Fit numbers of a case to measured signals, with their 95 % intervals."""
    with reporting(case, as_json):
        if out is not None:
            output.check_writable(out)
        pairs = [(case, data), *(_pair(text) for text in experiment or [])]
        cases = [load(each, sets, method, variant) for each, _ in pairs]
        bounds = dict(fits.read_bounds(text) for text in parameters)
        columns = dict(_named(text) for text in signal)
        tables = [file for _, file in pairs]
        instruments = {"gain": gain, "offset": offset, "shift": shift}
        signals = fits.read_tables(tables, columns, {name: texts or [] for name, texts in instruments.items()})
        console.log_compiling(*(each.simulation() for each in cases))
        with given_by("--parameters"):
            found = fits.fit(
                list(zip(cases, signals, strict=True)), parameters=bounds, loss=loss, noise=noise, bandwidth=bandwidth,
                intervals=intervals, resamples=resamples, seed=seed,
            )  # fmt: skip
        if out is not None:
            found.write(out, command_line(context))
            console.say(f"written: {out}")
        print_result(found, as_json)


def _pair(text: str) -> tuple[Path, Path]:
    case, equals, data = (part.strip() for part in text.rpartition("="))
    if not equals or not case or not data:
        raise CaseError(f"--experiment {text!r} is not CASE=DATA", remedy="Write second.yaml=second.csv, for example.")
    return Path(case), Path(data)


def _named(text: str) -> tuple[str, str]:
    column, equals, channel = (part.strip() for part in text.partition("="))
    if not equals or not column or not channel:
        raise CaseError(f"--signal {text!r} is not COLUMN=CHANNEL", remedy="Write 'force [kN]=force:a|b', for example.")
    return column, channel
