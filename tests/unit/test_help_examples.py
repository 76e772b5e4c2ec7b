"""Examples in the help of commands work on the file that `impactlab new` writes."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from impactlab.cli import app
from impactlab.cli.new_cases import new
from tests.support import invoke

ON_STARTER = ("run", "compare", "sweep", "check", "cite")  # commands whose data is the case alone, and quick


def examples() -> list[list[str]]:
    """Return the examples of these commands that name the starter."""
    epilogs = [command.epilog or "" for command in app.registered_commands]
    lines = [line.partition(" > ")[0].strip(" \\") for epilog in epilogs for line in epilog.splitlines()]
    words = [shlex.split(line) for line in lines if line.startswith("impactlab ")]
    return [each[1:] for each in words if each[1] in ON_STARTER and "my_case.yaml" in each]


@pytest.mark.parametrize("words", examples(), ids=" ".join)
def test_an_example_works_on_the_starter(words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    new("my_case", "hammer")
    result = invoke(*words)
    assert result.exit_code == 0, result.output
