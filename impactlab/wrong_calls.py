"""Wrong calls of a public class: an error that names its parameters, in place of Python's TypeError."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from functools import wraps
from typing import Any, NoReturn, TypeVar

from impactlab.errors import CaseError, closest

T = TypeVar("T", bound=type)
VARIABLE = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
MAX_NAMED = 6  # parameters in a message


def names_parameters(kind: T) -> T:
    """Make wrong calls of a class a `CaseError` that names its parameters; return the class."""
    own = kind.__init__  # type: ignore[misc]

    @wraps(own)
    def checked(self: Any, *values: Any, **named: Any) -> None:
        try:
            own(self, *values, **named)
        except TypeError:
            _refuse_wrong_call(kind, values, named)
            raise

    kind.__init__ = checked  # type: ignore[misc]
    return kind


def _refuse_wrong_call(kind: type, values: Sequence[Any], named: Mapping[str, Any]) -> None:
    """Raise `CaseError` if a class cannot be called with these values."""
    known = list(inspect.signature(kind).parameters.values())
    unnamed = [each.name for each in known if each.kind is inspect.Parameter.POSITIONAL_OR_KEYWORD]
    usable = {each.name for each in known}
    is_open = any(each.kind is inspect.Parameter.VAR_KEYWORD for each in known)
    needed = [each.name for each in known if each.default is each.empty and each.kind not in VARIABLE]
    missing = [name for name in needed if name not in named and name not in unnamed[: len(values)]]
    unknown = [] if is_open else [name for name in named if name not in usable]
    name = kind.__name__
    if len(values) > len(unnamed):
        beyond = ", ".join(map(repr, values[len(unnamed) :]))
        _refuse(name, known, f"a value of {name} is given without the name of its parameter: {beyond[:80]}")
    if unknown:
        _refuse(name, known, f"{name} has no parameter {unknown[0]!r}.{closest(unknown[0], usable)}")
    if missing:
        _refuse(name, known, f"{name} needs {' and '.join(missing)}{' too' if values or named else ''}")


def _refuse(name: str, known: Sequence[inspect.Parameter], text: str) -> NoReturn:
    words = [
        each.name if each.kind is inspect.Parameter.POSITIONAL_OR_KEYWORD else f"{each.name}=..."
        for each in known
        if each.kind not in VARIABLE
    ]
    more = ", ..." if len(words) > MAX_NAMED else ""
    raise CaseError(text, remedy=f"Write {name}({', '.join(words[:MAX_NAMED])}{more}).") from None
