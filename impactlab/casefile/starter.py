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
    """Return the cases that come with the package by name: ``axial_impact``, ``granular/solitary_wave``."""
    folder = PACKAGE / "cases"  # of an installed package
    if not folder.is_dir():
        folder = PACKAGE.parent / "cases"  # of a checkout
    files = [*sorted(folder.glob("*.yaml")), *sorted(folder.glob("*/*.yaml"))]
    return {file.relative_to(folder).with_suffix("").as_posix(): file for file in files}


def known_case(name: str) -> Path | None:
    """Return the file of a case by its name, that of its folder first or left out; None if there is none."""
    known = cases()
    return known.get(name) or next((file for file in known.values() if file.stem == name), None)


def case_file(given: Path) -> Path:
    """Return a case file: the one at a path, or the one that comes with the package under that name.

    Raises
    ------
    CaseError
        If it has no ending of a file, and no such case comes with the package.
    """
    if given.suffix or given.is_file() or (given.is_dir() and known_case(given.as_posix()) is None):
        return given
    return case_named(given.as_posix())


def case_named(name: str) -> Path:
    """Return the file of a case that comes with the package; its folder may be left out: ``solitary_wave``.

    Raises
    ------
    CaseError
        If there is none of that name.
    """
    file = known_case(name)
    if file is None:
        here, names = Path(f"{name}.yaml"), [each.rpartition("/")[2] for each in cases()]
        remedy = f"Did you mean {str(here)!r}?" if here.exists() else closest(name, names).strip()
        remedy = remedy or "Give the path of a case file; `impactlab cases` lists the bundled cases."
        raise CaseError(f"there is no file {shown(name)}, and no case of that name comes with impactlab", remedy=remedy)
    return file


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
