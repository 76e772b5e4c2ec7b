"""Factors between the units that nearly all cases use.

They stand in a table, as pint takes half a second to load. Units that are not here, and units of different dimensions,
are left to pint (`impactlab.casefile.values.units`).
"""

from __future__ import annotations

import math
import re
from fractions import Fraction
from typing import NamedTuple

_PREFIXES = {"n": -9, "µ": -6, "u": -6, "m": -3, "c": -2, "k": 3, "M": 6, "G": 9}
_SHORT = ("n", "µ", "u", "m")  # prefixes of short times and of small angles
_LARGE = ("m", "k", "M", "G")


class _Unit(NamedTuple):
    """A unit in kg, m, s, rad and Hz.

    Radians and hertz stand for no other unit.
    """

    factor: Fraction | float
    powers: tuple[int, int, int, int, int]


_NAMED = {
    "g": (_Unit(Fraction(1, 1000), (1, 0, 0, 0, 0)), ("m", "k")),
    "t": (_Unit(Fraction(1000), (1, 0, 0, 0, 0)), ()),
    "m": (_Unit(Fraction(1), (0, 1, 0, 0, 0)), ("n", "µ", "u", "m", "c", "k")),
    "s": (_Unit(Fraction(1), (0, 0, 1, 0, 0)), _SHORT),
    "min": (_Unit(Fraction(60), (0, 0, 1, 0, 0)), ()),
    "N": (_Unit(Fraction(1), (1, 1, -2, 0, 0)), _LARGE),
    "Pa": (_Unit(Fraction(1), (1, -1, -2, 0, 0)), ("k", "M", "G")),
    "J": (_Unit(Fraction(1), (1, 2, -2, 0, 0)), _LARGE),
    "W": (_Unit(Fraction(1), (1, 2, -3, 0, 0)), ("m", "k", "M")),
    "rad": (_Unit(Fraction(1), (0, 0, 0, 1, 0)), ("m",)),
    "deg": (_Unit(math.pi / 180.0, (0, 0, 0, 1, 0)), ()),
    "rpm": (_Unit(math.pi / 30.0, (0, 0, -1, 1, 0)), ()),
    "Hz": (_Unit(Fraction(1), (0, 0, 0, 0, 1)), ("k", "M")),
}
_UNITS = {
    prefix + name: _Unit(unit.factor * Fraction(10) ** _PREFIXES.get(prefix, 0), unit.powers)
    for name, (unit, prefixes) in _NAMED.items()
    for prefix in ("", *prefixes)
}
_TERM = re.compile(r"([*/]?)([A-Za-zµ]+)(?:\*\*(-?[0-9.]+))?")


def usual_factor(given: str, wanted: str) -> float | None:
    """Return the factor between two units of one dimension.

    None where a unit is not in the table. Both are texts as pint reads them, such as ``kN/mm**1.5``.
    """
    one, other = _read(given), _read(wanted)
    if one is None or other is None or one[1] != other[1]:
        return None
    return float(one[0] / other[0])


def _read(text: str) -> tuple[Fraction | float, tuple[float, ...]] | None:
    """Return factor and dimension of a product of units; None if one is not in the table."""
    factor: Fraction | float = Fraction(1)
    powers: tuple[float, ...] = (0.0,) * 5
    at = 1 if text.startswith("1/") else 0
    while at < len(text):
        term = _TERM.match(text, at)
        if term is None or term[2] not in _UNITS:
            return None
        unit, power = _UNITS[term[2]], float(term[3] or 1.0) * (-1.0 if term[1] == "/" else 1.0)
        factor *= unit.factor ** (int(power) if power.is_integer() else power)
        powers = tuple(had + power * own for had, own in zip(powers, unit.powers, strict=True))
        at = term.end()
    return factor, powers
