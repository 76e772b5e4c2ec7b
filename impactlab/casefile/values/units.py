"""Numbers with a unit, as texts: ``210 GPa``, ``0.3 m``, ``58 us``.

One strict pattern stands before pint, which would read "0,3 m" as 0 m and hang on "9**9**9"; pint itself only ever
sees a unit made of known letters, and is imported only for one that is not among the usual ones.
"""

from __future__ import annotations

import math
import re
from decimal import Decimal
from functools import cache, lru_cache
from typing import Any

from impactlab.casefile.text.words import shown
from impactlab.casefile.values.usual_units import usual_factor

MAX_LENGTH = 64  # characters

_TERM = r"[A-Za-zµμ]{1,16}(?:(?:\^|\*\*)?-?[1-9](?:\.[0-9]{1,3})?)?"
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_PATTERN = re.compile(
    r"([+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?)"
    rf"(?:\s*({_TERM}(?:\s*[*/·]\s*{_TERM}|\s+{_TERM}){{0,5}})|\s+1\s*/\s*({_TERM}))"
)  # 20 kN/mm, or 500 1/s
_RAISED = re.compile("[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+")  # as in cm²
_LOWERED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_POWER = re.compile(r"([A-Za-zµμ])(?:\^|\*\*)?(-?[1-9])")


STRAINS = {"1": 1.0, "m/m": 1.0, "strain": 1.0, "%": 1e-2, "mm/m": 1e-3, "1e-6": 1e-6} | dict.fromkeys(
    ("um/m", "µm/m", "μm/m", "µε", "με", "ue", "µstrain", "μstrain", "ustrain", "microstrain"), 1e-6
)
"""Units of a strain, with the sign micro and with the Greek letter."""


def strain_of(text: str) -> float:
    """Return a text such as ``2 um/m`` as a strain.

    Raises
    ------
    ValueError
        If it is not a number with a unit of strain.
    """
    match = re.fullmatch(rf"({_NUMBER.pattern})\s*(\S+)", text.strip()) if len(text) <= MAX_LENGTH else None
    if match is None or match.groups()[-1] not in STRAINS:
        raise ValueError(f"{shown(text)} is not a strain. Allowed: a plain number, or a number and % or um/m")
    return float(Decimal(match[1]) * Decimal(f"{STRAINS[match.groups()[-1]]:.15g}"))


def takes_texts(unit: str) -> bool:
    """Return whether a field in this unit, without an optional power, takes numbers with units."""
    return unit != "1" and not unit.endswith("^n")


def with_power(unit: str, n: float) -> str:
    """Return a unit whose power is an option, such as N/m^n, with its number."""
    return f"{unit.removesuffix('n')}{n:g}"


def is_si(unit: str) -> bool:
    """Return whether a unit, also of a part's option, is an SI unit without prefix."""
    if unit == "1":
        return True
    base = re.sub(r"\^[A-Za-z]+$", "", unit)  # of N/m^n
    try:
        return math.isclose(float(_units().Quantity(1.0, _pint_text(base)).to_base_units().magnitude), 1.0)
    except Exception:  # noqa: BLE001 - of pint, by an author's text
        return False


@lru_cache(maxsize=1024)  # cases of a sweep give the same texts again
def to_si(text: str, unit: str) -> float:
    """Return a text such as ``210 GPa`` as a number in an SI unit.

    Parameters
    ----------
    text : str
        A decimal number and a unit.
    unit : str
        The SI unit of the field, e.g. ``Pa``.

    Raises
    ------
    ValueError
        If the text is not a number with a unit of that dimension; the message lists the allowed forms.
    """
    plain = _RAISED.sub(lambda raised: "^" + raised[0].translate(_LOWERED), text.strip())
    match = _PATTERN.fullmatch(plain) if len(text) <= MAX_LENGTH else None
    if not takes_texts(unit):
        why = ", without unit" if unit == "1" else f" in {unit}, whose n is another option"
        raise ValueError(f"{shown(text)} is not a number. Allowed: a plain number{why}")
    allowed = f"allowed: a number in {unit}, or a number and a unit such as {_example(unit)}"
    if len(text) <= MAX_LENGTH and _NUMBER.fullmatch(text.strip()):
        raise ValueError(f"{shown(text)} is not a number with a unit; write a plain number without quotes; {allowed}")
    if match is None:
        comma = "; write the decimal point as '.'" if "," in text else ""
        raise ValueError(f"{shown(text)} is not a number with a unit{comma}; {allowed}")
    given = _pint_text(match.group(2)) if match.group(2) else f"1/{_pint_text(match.group(3))}"
    factor = _factor(given, _pint_text(unit))
    if isinstance(factor, str):
        raise ValueError(f"{shown(text)} {factor}; {allowed}")
    # Decimal, so that "9 cm^2" is the very number 9e-4.
    number = float(Decimal(match.group(1)) * Decimal(f"{factor:.15g}"))
    if not math.isfinite(number):
        raise ValueError(f"{shown(text)} is beyond any finite number; {allowed}")
    return number


def _example(unit: str) -> str:
    examples = {"m": "30 cm", "Pa": "210 GPa", "s": "58 us", "m2": "9 cm^2", "kg": "2 g", "m/s": "1 mm/s"}
    examples |= {"kg/m3": "7.9 g/cm^3", "N/m": "1 kN/mm", "N/m^1.5": "1 kN/mm^1.5", "rad/s": "600 rpm", "rad": "60 deg"}
    examples |= {"N": "5 kN", "J": "3 kJ", "N m": "2 kN m", "m/s2": "9.81 m/s^2", "Hz": "2 kHz"}
    return repr(examples.get(unit, f"1 {unit}"))


def _pint_text(unit: str) -> str:
    spaced = re.sub(r"\s*[*·]\s*|(?<=[\w])\s+(?=[A-Za-zµμ])", "*", _POWER.sub(r"\1^\2", unit.replace("**", "^")))
    return spaced.replace("^", "**").replace("μ", "µ")


@cache
def _factor(given: str, wanted: str) -> float | str:
    """Return the factor from one unit to another, or the reason why there is none."""
    if (usual := usual_factor(given, wanted)) is not None:
        return usual
    units = _units()
    from pint.errors import DimensionalityError, PintError

    try:
        quantity = units.Quantity(1.0, given)
        factor = float(quantity.to(wanted).magnitude)
        if any(
            name.endswith("ton") and not name.endswith(("newton", "metric_ton")) for name, _ in quantity.unit_items()
        ):
            return "may be a metric, short or long ton: write t for 1000 kg"
        if any(name.endswith(("grade", "gradian", "gon")) for name, _ in quantity.unit_items()):
            return "may be degrees or gon (400 to a turn): write deg"
        if "rad" in wanted and any(name.endswith("hertz") for name, _ in quantity.unit_items()):
            return "may count turns or radians"
        if wanted == "Hz" and "radian" in dict(quantity.to_root_units().unit_items()):
            return "is an angular rate, and a frequency counts cycles"
        return factor
    except DimensionalityError:
        return "has a unit of another dimension"
    except (PintError, AttributeError, ValueError, TypeError, ArithmeticError):
        return "has a unit that is not known (letters matter: 'GPa', not 'gpa')"


@cache
def _units() -> Any:
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=False, cache_folder=None)
