"""Starter cases: a commented case, or a copy of a packaged one."""

from __future__ import annotations

import re
from pathlib import Path

from impactlab.casefile.text.words import listed, shown
from impactlab.errors import CaseError, closest

STARTERS = Path(__file__).with_name("starters")  # one commented case for each kind of problem
PACKAGE = Path(__file__).resolve().parents[1]


def kinds() -> list[str]:
    """Return the names of the commented cases to start from."""
    return sorted(file.stem for file in STARTERS.glob("*.yaml"))


def cases() -> dict[str, Path]:
    """Return the cases that come with the package, by name."""
    folder = PACKAGE / "cases"  # of an installed package
    if not folder.is_dir():
        folder = PACKAGE.parent / "cases"  # of a checkout
    return {file.stem: file for file in sorted(folder.glob("*.yaml"))}


def case_named(name: str) -> Path:
    """Return the file of a case that comes with the package.

    Raises
    ------
    CaseError
        If there is none of that name.
    """
    known = cases()
    if name not in known:
        here = Path(f"{name}.yaml")
        remedy = f"Did you mean {str(here)!r}?" if here.exists() else closest(name, known).strip()
        remedy = remedy or "Give the path of a case file; `impactlab cases` lists the bundled cases."
        raise CaseError(f"there is no file {shown(name)}, and no case of that name comes with impactlab", remedy=remedy)
    return known[name]


def write_starter(name: str, folder: Path, kind: str) -> Path:
    """Write a commented case of a kind as ``name.yaml`` and return its path.

    Raises
    ------
    CaseError
        If there is no such kind, the name is not a valid name for a file, or the file exists.
    """
    if kind not in kinds():
        text = f"there is no case like {shown(kind)} to start from. Allowed: {listed(kinds())}"
        raise CaseError(text, remedy=closest(kind, kinds()).strip() or "Take one of these.")
    return write_copy(STARTERS / f"{kind}.yaml", name, folder)


def write_copy(file: Path, name: str, folder: Path) -> Path:
    """Copy a case file and its tables into a folder as a new ``name.yaml``; return its path."""
    name = name.removesuffix(".yaml")
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_-]{0,59}", name):
        raise CaseError(
            f"{shown(name)} is not a name for a case. Allowed: letters, digits, _ and -, beginning with a letter",
            remedy="The file is written into the present folder; give its name alone.",
        )
    path, text = folder / f"{name}.yaml", file.read_text(encoding="utf-8")
    tables = [table for table in file.parent.glob("*.csv") if f"file: {table.name}" in text]
    for there in (path, *(folder / table.name for table in tables)):
        if there.exists():
            raise CaseError(f"{there.name!r} is already there", remedy="Give another name, or go to another folder.")
    with path.open("x", encoding="utf-8") as stream:
        stream.write(text)
    for table in tables:
        (folder / table.name).write_bytes(table.read_bytes())
    return path
