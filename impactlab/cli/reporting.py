"""Failures of a command: a message on standard error, an exit code and, with ``--json``, a document."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from impactlab.cli.lazy_modules import api, console
from impactlab.errors import NO_ROOM, ImpactlabError, StepError, SweepError

if TYPE_CHECKING:
    from impactlab.casefile import Case
    from impactlab.derivatives.table import Sensitivities
    from impactlab.fits.result import Fit
    from impactlab.uncertainties.result import Uncertainty

    Result = Sensitivities | Fit | Uncertainty

BY_WITH = "with_()"  # gave a value that no file and no option holds


class CommandFailed(SystemExit):
    """A command that reported its failure leaves with this."""


@contextlib.contextmanager
def reporting(case: Path | None, as_json: bool) -> Iterator[None]:
    """Turn any failure inside into a message, a JSON document and an exit code.

    The message is on standard error, the document is printed with ``--json``.
    """
    try:
        yield
    except (typer.Exit, typer.Abort, BrokenPipeError):
        raise
    except KeyboardInterrupt as error:
        _report(case, as_json, error, str(error) or "interrupted")
        raise CommandFailed(130) from None
    except Exception as error:
        if os.environ.get("IMPACTLAB_DEBUG"):
            raise
        _report(case, as_json, error, words(error))
        raise CommandFailed(code_of(error)) from None


@contextlib.contextmanager
def given_by(option: str, before: str = BY_WITH) -> Iterator[None]:
    """Name the option in errors of values that it gave.

    It takes the place of the function or part that put them in.
    """
    try:
        yield
    except ImpactlabError as error:
        for each in (error, *error.others):
            if each.given_by == before:
                each.given_by = option
        raise


def output_fault(leaving: BaseException) -> OSError | None:
    """Return the error of standard output, such as a full disk, or None."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:  # its reader has left
        return None
    except OSError as error:
        return error
    return leaving if isinstance(leaving, OSError) and leaving.errno in NO_ROOM else None


def left_without_output(fault: OSError) -> CommandFailed:
    """Report that standard output cannot be written, and return the exit status.

    The rest of the output is dropped.
    """
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    print(words(fault), file=sys.stderr)
    return CommandFailed(1)


def _report(case: Path | None, as_json: bool, error: BaseException, text: str) -> None:
    console.say(text)
    if as_json and not (isinstance(error, OSError) and error.errno in NO_ROOM):
        print_failure(case, error)


def print_failure(case: Path | None, error: BaseException) -> None:
    """Print the JSON document of a command that failed."""
    console.print_json(api.failure(case.stem if case is not None else "", error))


def words(error: BaseException) -> str:
    """Return the message of an error for a user."""
    if isinstance(error, ImpactlabError):
        return str(error)
    if isinstance(error, OSError) and error.errno in NO_ROOM:
        return f"the output could not be written: {str(error)[:500]}\nMake room, or write elsewhere."
    text = f"{type(error).__name__}: {str(error)[:500]}"
    return f"{text}\nThis is a fault of a part or of impactlab itself; IMPACTLAB_DEBUG=1 shows where."


def code_of(error: BaseException) -> int:
    """Return the exit code of an error."""
    return 2 if isinstance(error, ImpactlabError) and not isinstance(error, (StepError, SweepError)) else 1


def print_result(found: Result, as_json: bool) -> None:
    """Print the result of a command as JSON, or as text."""
    if as_json:
        console.print_json(found.to_dict())
    else:
        print(found)


def print_hints(case: Case) -> None:
    """Print on standard error the values of a case that may be mistakes."""
    for hint in case.hints:
        console.say(f"{case.file}: {hint}")
