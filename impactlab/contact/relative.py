"""Options of a law that are relative to a rod, in SI."""

from __future__ import annotations

from collections.abc import Collection

from impactlab.errors import PairingError
from impactlab.types import Relative


def in_si(given: float | Relative, name: str, references: Collection[float]) -> float:
    """Return an option in SI; a relative one is a share of the smallest reference (one of each rod)."""
    if not isinstance(given, Relative):
        return given
    if not references:
        raise PairingError(
            f"{name} is relative to a rod, and this contact has none", remedy="Give it in SI.", path=name
        )
    return given.relative * min(references)
