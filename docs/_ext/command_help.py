"""The help of every command, in Markdown."""

from __future__ import annotations

import typer
from typer.testing import CliRunner

from impactlab.cli import app

WIDTH = {"COLUMNS": "100"}


def page() -> str:
    """Return a section for each command with the text of its ``--help``."""
    lines: list[str] = []
    for name in typer.main.get_command(app).commands:  # type: ignore[attr-defined]  # of a group
        shown = CliRunner().invoke(app, [name, "--help"], prog_name="impactlab", env=WIDTH)
        lines += ["", f"## `{name}`", "", "```text", shown.output.strip(), "```"]
    return "\n".join(lines)
