"""Errors for axes whose values another axis, or a setting of the command, gives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from impactlab.casefile import Case
from impactlab.casefile.edit import edited, numbered
from impactlab.casefile.places import given_by
from impactlab.casefile.text.words import shown
from impactlab.errors import CaseError


def refuse_twice(case: Case, paths: Sequence[str]) -> None:
    """Raise `CaseError` where a path is given twice, or by an option.

    It may be given alone or within a block. A contact by its number and the same one by its name are one.
    """
    by_number = [numbered(case.document.data, path) for path in paths]
    for number, path in enumerate(paths):
        own, before = f"{by_number[number]}.", list(zip(paths, by_number, strict=True))[:number]
        other = next((each for each, found in before if own.startswith(f"{found}.")), None)
        other = other or next((each for each, found in before if f"{found}.".startswith(own)), None)
        if other is not None:
            text = "an axis that is given twice" if other == path else f"an axis whose values {other} gives, too"
            raise CaseError(text, path=path, remedy="Give all of its values at once.")
        if given_by(case.document, by_number[number]) == "--set":
            raise CaseError("an axis that --set gives, too", path=path, remedy="Leave out one of the two.")
        keys = tuple(by_number[number].split("."))
        inside = (each for each, by in case.document.given.items() if by == "--set" and each[: len(keys)] == keys)
        if (found := next(inside, None)) is not None:
            text = f"an axis of blocks, and --set gives {'.'.join(found)} inside them"
            raise CaseError(text, path=path, remedy="Leave out --set, and give the key in each value of the axis.")


def refuse_removed(case: Case, path: str, values: Sequence[Any]) -> None:
    """Raise `CaseError` where a value of an axis removes one beside it that ``--set`` gives.

    A new kind stands alone, and a tolerance and a description replace each other.
    """
    document = case.document
    by_set = [keys for keys, option in document.given.items() if option == "--set"]
    if not by_set:
        return
    for value in (each for place, each in enumerate(values) if place == 0 or not isinstance(each, (int, float))):
        try:
            changed = edited(document, path, value, replace=False).data
        except CaseError:  # a value that is not allowed there is refused where it is read
            continue
        for keys in by_set:
            if _value_at(changed, keys) != _value_at(document.data, keys):
                raise CaseError(
                    f"an axis with the value {shown(value)}, which removes {'.'.join(keys)}, a key that --set gives",
                    remedy="Leave out --set, or sweep the whole block, with the key in each value of the axis.",
                    path=path,
                )


def _value_at(data: Any, keys: Sequence[str]) -> Any:
    """Return the value at some keys of a case; None where there is none."""
    for key in keys:
        if isinstance(data, list) and key.isdecimal() and int(key) < len(data):
            data = data[int(key)]
        elif isinstance(data, dict) and key in data:
            data = data[key]
        else:
            return None
    return data
