"""Folders of the repository, commands in this process, and codes of warnings, for all tests."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from typer.testing import CliRunner

if TYPE_CHECKING:
    from click.testing import Result

    from impactlab.history import AbstractHistory

ROOT = Path(__file__).parents[1]
CASES, DOCS = ROOT / "cases", ROOT / "docs"
PAPER = CASES / "axial_impact.yaml"  # the impact of the 1999 paper


def invoke(*arguments: str) -> Result:
    """Return the result of an impactlab command: `exit_code`, `output`, `stdout` and `stderr`."""
    from impactlab.cli import app

    return CliRunner().invoke(app, list(arguments))


def codes(history: AbstractHistory) -> set[str]:
    """Return the codes of the warnings of a run."""
    return {warned.code for warned in history.warnings}
