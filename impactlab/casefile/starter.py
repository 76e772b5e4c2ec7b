"""Writes a commented case to start from."""

from __future__ import annotations

import re
from pathlib import Path

from impactlab.casefile.words import shown
from impactlab.errors import CaseError

_STARTER = Path(__file__).with_name("starter.yaml")


def write_starter(name: str, folder: Path) -> Path:
    """Write ``name.yaml`` into the folder and return its path; an existing file is never replaced."""
    name = name.removesuffix(".yaml")
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_-]{0,59}", name):
        raise CaseError(
            f"{shown(name)} is not a name for a case. Allowed: letters, digits, _ and -, beginning with a letter",
            remedy="The file is written into the present folder; give its name alone.",
        )
    path = folder / f"{name}.yaml"
    text = _STARTER.read_text(encoding="utf-8")
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError as error:
        raise CaseError(f"{path.name!r} is already there", remedy="Give another name.") from error
    return path
