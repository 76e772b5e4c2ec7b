"""Options of a law that are relative to a rod, in SI."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection
from typing import Any

from impactlab.errors import PairingError
from impactlab.types import Relative, SideFacts


def in_si(given: float | Relative, name: str, references: Collection[float]) -> float:
    """Return an option in SI units; a relative one times the smallest of its references.

    There is one reference for each rod.
    """
    if not isinstance(given, Relative):
        return given
    if not references:
        raise PairingError(
            f"{name} is relative to a rod, and this contact has none", remedy="Give it in SI.", path=name
        )
    return given.relative * min(references)


def relative_options(law: Any, left: SideFacts, right: SideFacts) -> dict[str, float]:
    """Return the relative options of a law in SI units, empty without a rod."""
    found: dict[str, float] = {}
    rods = [facts for facts in (left, right) if facts.kind == "rod"]
    for each in dataclasses.fields(law):
        value = getattr(law, each.name)
        if rods and isinstance(value, Relative):
            of_springs = each.metadata["unit"] == "N/m"
            references = [rod.element_stiffness if of_springs else rod.impedance for rod in rods]
            found[each.name] = in_si(value, each.name, references)
    return found
