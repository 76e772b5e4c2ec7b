"""File and line of the faults of refused or failed rows.

Records of runs are kept by their content, whatever file holds it, and so without a place.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from impactlab.bench.cells import Cell
from impactlab.bench.schema import BASE, OWN
from impactlab.casefile import Case, load_case
from impactlab.errors import ImpactlabError


class Place(NamedTuple):
    """A place in a case file."""

    file: str
    line: int | None  # from 1; None where the value is not in the file, or no part of it is at fault

    def __str__(self) -> str:
        return self.file if self.line is None else f"{self.file}:{self.line}"


def places_of(
    files: Sequence[Path], cells: Iterable[Cell], records: Mapping[str, Mapping[str, Any]]
) -> dict[tuple[str, str, str, int], Place]:
    """Return the place of each row's fault by case, variant, method and level."""
    by_name = {file.stem: file for file in files}
    read: dict[str, Case] = {}
    found = {}
    for cell in cells:
        error = records[cell.key]["summary"].get("error")
        if not error or cell.case not in by_name:
            continue
        file = str(by_name[cell.case])
        if file not in read:
            read[file] = load_case(file)
        found[cell.row_id] = Place(file, _line(read[file], cell, error.get("path") or ""))
    return found


def _line(written: Case, cell: Cell, path: str) -> int | None:
    """Return the line of a path in a case under the method of a cell."""
    try:
        case = written if cell.variant == BASE else written.variant(cell.variant)
        if not cell.method.startswith(OWN):
            given = any(path == each or path.startswith(f"{each}.") for each in cell.settings)
            return None if given or not path else case.locate(path)  # values of the grid are not in the file
        name = cell.method.removeprefix(OWN)
        case = case if name == BASE else case.method(name)
    except ImpactlabError as error:
        return error.line
    return case.locate(path) if path else None
