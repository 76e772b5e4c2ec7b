"""Limits of the values of a case: how many, how deep, and which texts."""

from __future__ import annotations

from typing import Any

from impactlab.casefile.text.words import shown
from impactlab.errors import CaseError

MAX_VALUES = 25_000  # keys, list entries and values: YAML takes some 40 us for each
MAX_GIVEN = 2_000_000  # the same of a case made in Python
MAX_DEPTH = 24  # levels of nesting
MAX_KEY = 120  # characters

Keys = tuple[str, ...]
"""Where a value stands: keys and list positions from the top, as texts."""

SERIES = "A case describes a scene; keep measured series outside it."
REMEDY = "A case holds plain keys and values only; see `impactlab new` for one to start from."


def too_deep(line: int) -> CaseError:
    """Return the error of values nested too deep."""
    return CaseError(f"nested deeper than {MAX_DEPTH} levels, the most a case may have", remedy=REMEDY, line=line)


def too_many(line: int | None = None, most: int = MAX_VALUES) -> CaseError:
    """Return the error of too many values."""
    return CaseError(f"more than {most} values, the most a case may have", remedy=SERIES, line=line)


def check_tree(data: Any, most: int = MAX_VALUES) -> None:
    """Raise `CaseError` on too many values, or a key that cannot be shown."""
    count, waiting = 0, [data]
    while waiting:
        value = waiting.pop()
        count += 1
        if count > most:
            raise too_many(most=most)
        if isinstance(value, dict):
            for key in value:
                plain_key(key, None)
        if isinstance(value, (dict, list)):
            waiting.extend(value.values() if isinstance(value, dict) else value)


def plain_key(key: str, line: int | None) -> str:
    """Return a key that is safe to show in a message, or refuse it."""
    if len(key) > MAX_KEY or not key.isprintable():
        raise CaseError(
            f"the key {shown(key)} is not a plain word of at most {MAX_KEY} characters", remedy=REMEDY, line=line
        )
    return key


def check_texts(data: Any, path: Keys = ()) -> None:
    """Raise `CaseError` where a text holds a lone surrogate, which no output can show."""
    if isinstance(data, str):
        if data.isascii():
            return
        try:
            data.encode("utf-8")
        except UnicodeEncodeError:
            raise CaseError(
                f"{shown(data)} contains an incomplete Unicode character (lone surrogate)",
                remedy="Remove the characters that are not text.",
                path=dotted(path),
            ) from None
    elif isinstance(data, dict):
        for key, value in data.items():
            check_texts(key, path)
            check_texts(value, (*path, key))
    elif isinstance(data, list):
        for number, value in enumerate(data):
            check_texts(value, (*path, str(number)))


def dotted(path: Keys) -> str:
    """Return a path as a message shows it."""
    return ".".join(path)[:200]
