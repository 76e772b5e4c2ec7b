"""Results as text and plain values: counts with nouns, aligned columns, values for JSON."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

PLAIN = (str, int, bool, type(None))


def counted(number: int, noun: str) -> str:
    """Return a number with its noun: ``1 scene``, ``2 scenes``."""
    return f"{number} {noun}{'s' if number != 1 else ''}"


def first_of(words: Sequence[str], most: int = 8) -> str:
    """Return the first of some words, and how many more there are: ``a, b and 48 more``."""
    more = len(words) - most
    return ", ".join(words) if more < 2 else f"{', '.join(words[:most])} and {more} more"


def enumerated(words: Sequence[str]) -> str:
    """Return words as a sentence lists them: ``a, b and c``."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def at_most(limit: float, digits: int = 6) -> str:
    """Return the largest number of some digits that is not above a positive limit.

    A user who types it stays within the limit.
    """
    shown = float(f"{limit:.{digits}g}")
    if shown > limit:
        shown -= 10.0 ** (math.floor(math.log10(shown)) - digits + 1)
    return f"{shown:.{digits}g}"


def at_least(limit: float, digits: int = 6) -> str:
    """Return the smallest number of some digits that is not below a positive limit."""
    shown = float(f"{limit:.{digits}g}")
    if shown < limit:
        shown += 10.0 ** (math.floor(math.log10(shown)) - digits + 1)
    return f"{shown:.{digits}g}"


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows of texts as lines whose columns begin below each other."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def plain(value: Any) -> Any:
    """Return a value in plain Python types, for JSON.

    Records become mappings, and numbers that are not finite become None.
    """
    if type(value) in PLAIN or (type(value) is float and math.isfinite(value)):  # most of a long run's events
        return value
    match value:
        case Mapping():
            return {str(key): plain(item) for key, item in value.items()}
        case str() | bool() | int() | None:
            return value
        case float() | np.floating():
            return float(value) if math.isfinite(value) else None
        case np.bool_() | np.integer():
            return value.item()
        case tuple() if hasattr(value, "_asdict"):
            return {name: plain(item) for name, item in value._asdict().items()}
        case Iterable():
            return [plain(item) for item in value]
        case _:
            return str(value)
