"""Parameters: numbers of a case, by their dotted paths."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import reduce
from typing import Any, NamedTuple

from impactlab.casefile import Case
from impactlab.casefile.edit import numbered, refuse_unknown_body
from impactlab.casefile.path_units import entry
from impactlab.casefile.text.words import shown
from impactlab.casefile.values.units import to_si
from impactlab.errors import CaseError, texts
from impactlab.sweeps.axes import takes_whole

HELD = {
    "solve.step": (
        "the step is fixed while derivatives are computed, so that there is no derivative with respect to it",
        "Compare runs of two steps, as in: impactlab sweep CASE --over {path}=A,B.",
    ),
    "solve.tolerance": (
        "the tolerance chooses a method, which is fixed while derivatives are computed",
        "Compare runs of two tolerances, as in: impactlab sweep CASE --over {path}=A,B.",
    ),
}
"""Numbers of the method by which nothing is differentiated: the reason, and the remedy."""


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
    paths = _listed(paths)
    if not paths:
        raise CaseError("no parameter is given", remedy="Name numbers of the case, such as bodies.hammer.mass.")
    refuse_twice(case, paths)
    return tuple(_read(case, path) for path in paths)


def _listed(paths: str | Sequence[str]) -> list[str]:
    if isinstance(paths, str):
        return [each.strip() for each in paths.split(",")]
    return texts("parameters", paths, "Name numbers of the case, such as bodies.hammer.mass.")


def refuse_held(paths: str | Sequence[str]) -> None:
    """Raise `CaseError` for a number of the method that is held while derivatives are taken."""
    for path in _listed(paths):
        for held, (text, remedy) in HELD.items():
            if f"{path}.".startswith(f"{held}."):
                raise CaseError(text, path=path, remedy=remedy.format(path=path))


def refuse_twice(case: Case, paths: Sequence[str]) -> None:
    """Raise `CaseError` where two paths, alike or by number and name, lead to one number."""
    before: dict[str, str] = {}
    for path in paths:
        number = numbered(case.document.data, path)
        if number in before:
            words = "" if before[number] == path else f": {before[number]} is the same number"
            raise CaseError(f"a parameter that is given twice{words}", path=path, remedy="Name it once.")
        before[number] = path


def _read(case: Case, path: str) -> Parameter:
    if path == "schema_version":
        text = "the version of the format of the file is not a number of the case"
        raise CaseError(text, path=path, remedy="Name a number of the case, such as bodies.hammer.mass.")
    refuse_unknown_body(case.document.data, path)
    keys = numbered(case.document.data, path).split(".")
    unit = case.unit_of(path)
    found: Any = reduce(entry, keys, case.resolved())
    if found is None:
        given = reduce(entry, keys, case.document.data)  # such as a diameter, of which the case makes an area
        found = _in_si(given, unit)
        if found is None:
            _refuse_whole(case, path)
            case.with_(path, 1.0)  # names the closest paths where there is none
            raise CaseError(
                "the case does not give a number for this key", path=path, remedy="Name a number that it gives."
            )
    if type(found) is int:
        _refuse_whole(case, path)
    if isinstance(found, bool) or not isinstance(found, (int, float)) or not math.isfinite(found):
        text = f"the case gives {shown(found)} here, which is not a number with a derivative"
        raise CaseError(text, path=path, remedy="Name a number of the case.")
    parameter = Parameter(path, float(found), unit)
    try:
        parameter.case(case, parameter.value)
    except CaseError as error:
        raise CaseError(
            f"the case cannot change this number alone ({error.path}: {error.text})",
            path=path,
            remedy="Name a number that the case gives, such as a diameter in place of its area; or give the constants "
            "of a material in place of its name.",
        ) from error
    return parameter


def _in_si(given: Any, unit: str) -> float | None:
    """Return a number as a case file gives it, in SI; None of anything else."""
    if isinstance(given, str):
        try:
            return to_si(given, unit or "1")
        except ValueError:
            return None
    return given if isinstance(given, (int, float)) and not isinstance(given, bool) else None


def _refuse_whole(case: Case, path: str) -> None:
    """Raise `CaseError` where a case takes whole numbers alone."""
    if takes_whole(case, path):
        text = "a whole number: it changes in steps, and has no derivative"
        raise CaseError(text, path=path, remedy=f"Compare runs, as in: impactlab sweep CASE --over {path}=A,B.")
