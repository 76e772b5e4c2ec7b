"""Numbers with a unit and its SI prefix, for axes and short reprs."""

from __future__ import annotations

import math
from typing import NamedTuple

PREFIXES = {1e9: "G", 1e6: "M", 1e3: "k", 1.0: "", 1e-3: "m", 1e-6: "µ", 1e-9: "n"}


class Unit(NamedTuple):
    """How a quantity is shown: values are divided by ``size`` and labelled ``label``."""

    size: float
    label: str


def scaled(unit: str, largest: float) -> Unit:
    """Return the prefix that brings ``largest`` [unit] to between 1 and 1000."""
    if not math.isfinite(largest) or largest <= 0.0:
        return Unit(1.0, unit)
    size = next((size for size in PREFIXES if largest >= 0.9999 * size), 1e-9)
    return Unit(size, PREFIXES[size] + unit)


def prefixed(value: float | None, unit: str) -> str:
    """Return a number with its unit, such as ``16 mm``; ``none`` if it is None."""
    if value is None:
        return "none"
    shown = scaled(unit, abs(float(value)))
    return f"{float(value) / shown.size:.4g} {shown.label}"


def prefixed_range(low: float, high: float, unit: str) -> str:
    """Return a range such as ``0 to 600 µs``, with the prefix of the larger size."""
    shown = scaled(unit, max(abs(float(low)), abs(float(high))))
    return f"{float(low) / shown.size:.4g} to {float(high) / shown.size:.4g} {shown.label}"
