"""Parameters: numbers of a case, by their dotted paths."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from impactlab.casefile import Case
from impactlab.casefile.edit import numbered
from impactlab.errors import CaseError


class Parameter(NamedTuple):
    """A number of a case."""

    path: str  # dotted
    value: float  # in SI
    unit: str

    @property
    def scale(self) -> float:
        """The size to which changes are proportional, in SI; of a zero a thousandth."""
        return abs(self.value) or 1e-3

    def case(self, case: Case, value: float) -> Case:
        """Return the case with another value; raises the errors of the case."""
        return case.with_(self.path, value)


def read_parameters(case: Case, paths: str | Sequence[str]) -> tuple[Parameter, ...]:
    """Return parameters by path.

    Raises
    ------
    CaseError
        If there is no such path, it holds no number, or it is given twice.
    """
    if isinstance(paths, str):
        paths = [each.strip() for each in paths.split(",")]
    if not paths:
        raise CaseError("no parameter is given", remedy="Name numbers of the case, such as bodies.hammer.mass.")
    refuse_twice(case, paths)
    return tuple(_read(case, path) for path in paths)


def refuse_twice(case: Case, paths: Sequence[str]) -> None:
    """Raise `CaseError` where two paths lead to one number: alike, or a contact by its number and by its name."""
    before: dict[str, str] = {}
    for path in paths:
        number = numbered(case.document.data, path)
        if number in before:
            words = "" if before[number] == path else f": {before[number]} is the same number"
            raise CaseError(f"a parameter that is given twice{words}", path=path, remedy="Name it once.")
        before[number] = path


def _read(case: Case, path: str) -> Parameter:
    found: Any = case.resolved()
    for key in numbered(case.document.data, path).split("."):
        if isinstance(found, list) and key.isdecimal() and int(key) < len(found):
            found = found[int(key)]
        elif isinstance(found, dict) and key in found:
            found = found[key]
        else:
            case.with_(path, 1.0)  # names the closest paths where there is none
            raise CaseError(
                "the case turns this key into others, or it has no value yet",
                path=path,
                remedy="Name a number of the resolved case, such as an area in place of a diameter.",
            )
    if isinstance(found, bool) or not isinstance(found, (int, float)) or not math.isfinite(found):
        raise CaseError("not a number with a derivative", path=path, remedy="Name a number of the case.")
    return Parameter(path, float(found), case.unit_of(path))
