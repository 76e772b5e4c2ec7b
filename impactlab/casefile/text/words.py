"""Words for messages: shortened values, lists of allowed values."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

MAX_SHOWN = 80  # characters of a value that a message may show
MAX_LISTED, FIRST_LISTED = 120, 20  # names in a message; of more, those that it shows


def shown(value: Any) -> str:
    """Return a value as a message shows it, never longer than 80 characters."""
    if isinstance(value, dict):
        text = "{" + ", ".join(f"{str(key)[:20]}: ..." for key in list(value)[:5]) + "}"
    elif isinstance(value, (list, tuple)):
        text = f"a list of {len(value)}"
    elif isinstance(value, str):
        text = repr(value[: MAX_SHOWN + 1])
    elif value is None:
        text = "nothing"
    elif isinstance(value, bool):
        text = "true" if value else "false"
    elif isinstance(value, int):
        text = str(value) if abs(value) < 10**60 else f"a whole number of {int(math.log10(abs(value))) + 1} digits"
    else:
        text = repr(value)
    return text if len(text) <= MAX_SHOWN else text[: MAX_SHOWN - 3] + "..."


def rows_of(names: Iterable[str]) -> dict[str, int]:
    """Return the rows NAME_1, NAME_2, ... NAME_n among names, as NAME to n."""
    every = set(names)
    rows = {name[:-2]: 2 for name in every if name.endswith("_1") and f"{name[:-2]}_2" in every}
    for name in rows:
        while f"{name}_{rows[name] + 1}" in every:
            rows[name] += 1
    return rows


def listed_bodies(names: Iterable[str]) -> str:
    """Return sorted names with commas, of a row its first and its last."""
    every = set(names)
    rows = rows_of(every)
    single = every.difference(*({f"{name}_{i}" for i in range(1, count + 1)} for name, count in rows.items()))
    return listed(single.union(f"{name}_1 to {name}_{count}" for name, count in rows.items()))


def listed(names: Iterable[str]) -> str:
    """Return sorted names with commas, of many the first few and their number, or ``none``."""
    every = sorted(names)
    if len(every) > MAX_LISTED:
        return f"{', '.join(every[:FIRST_LISTED])}, ... ({len(every)} in all)"
    return ", ".join(every) or "none"
