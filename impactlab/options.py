"""Fields of a part that a case file may give, with unit, limits and description."""

from __future__ import annotations

import dataclasses
from typing import Any


@dataclasses.dataclass(frozen=True)
class Relative:
    """A value relative to a reference of the scene; a case writes ``{relative: 0.8}``."""

    relative: float


def option(
    default: Any = dataclasses.MISSING,
    *,
    unit: str = "1",
    description: str,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
    group: str = "",
    records: tuple[type[Any], ...] = (),
) -> Any:
    """Return a dataclass field of a part, with the values that a case may give.

    `impactlab.casefile` reads unit, limits and description from here; a part needs no other schema.
    Limits on a `Relative` value hold for its number. ``group`` is the entry-point group of a field that holds a part:
    a case gives ``kind: name`` and its parameters there, or the name alone. ``records`` are the classes of a field that
    holds a record of options: a case names one by its ``kind``, or gives the keys of the one without.
    """
    limits = {"gt": above, "ge": at_least, "lt": below, "le": at_most}
    given = {k: v for k, v in limits.items() if v is not None}
    metadata = {"unit": unit, "description": description, "limits": given, "group": group, "records": records}
    return dataclasses.field(default=default, metadata=metadata)
