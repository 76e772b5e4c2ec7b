"""Checks of values for functions on signals: units, and warnings of odd sizes."""

from __future__ import annotations

import math
import numbers
import sys
import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import ImpactlabError, RunWarning, UnusualValue
from impactlab.startup.lazy import lazy
from impactlab.types import Array

units = lazy("impactlab.casefile.values.units")  # loaded by the first string

MAX_SHOWN = 80  # characters of a value in a message
MAX_STRAIN = 0.02  # of a bar: the strongest steels yield below 1 %, bars of polymers below 2 %
MAX_SIZE = 0.5  # m, diameter of a bar, size of a specimen
MAX_DISTANCE = 100.0  # m, from a gauge to an end of its bar: the longest bars have some 100 m
MAX_INTERVAL = 10e-6  # s, between samples: a pulse of a striker of 0.25 m lasts ten of them
MILLISECONDS = 0.02  # an interval above it is taken for one in us, a smaller one for one in ms


def in_si(name: str, value: float | str, unit: str) -> float:
    """Return a number in SI units, from a number or a string with a unit.

    Unit ``1`` is that of plain numbers.

    Raises
    ------
    ImpactlabError
        If it is neither, or has a unit of another dimension.
    """
    plain = unit == "1"
    remedy = "Give a plain number." if plain else "Give a number in SI, or a number with its unit."
    if isinstance(value, str):
        try:
            return float(units.to_si(value, unit))
        except ValueError as error:
            raise ImpactlabError(f"{name}: {error}", remedy=remedy) from None
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        forms = "a plain number" if plain else f"a number in {unit} or a string with a unit"
        raise ImpactlabError(f"{name} is {_given(value)}; it must be {forms}", remedy=remedy)
    return float(value)


def finite(name: str, value: float | str, unit: str) -> float:
    """Return a finite number in an SI unit; raise `ImpactlabError` for any other."""
    found = in_si(name, value, unit)
    if not math.isfinite(found):
        remedy = "Give a finite number." if unit == "1" else f"Give a finite number in {unit}."
        raise ImpactlabError(f"{name} is {found:.6g}; it must be finite", remedy=remedy)
    return found


def above_zero(name: str, value: float | str, unit: str) -> float:
    """Return a finite number above 0 in an SI unit; raise `ImpactlabError` for any other."""
    found = in_si(name, value, unit)
    if not (found > 0.0 and math.isfinite(found)):
        raise ImpactlabError(
            f"{name} is {found:.6g} {unit}; it must be positive",
            remedy="Give it in SI units, or as a string with its unit.",
        )
    return found


def pair(name: str, values: Any, example: str = "(0.75, 0.5)") -> tuple[Any, Any]:
    """Return the two values of a pair.

    Raise `ImpactlabError` for one value, a text, or another number of values.
    """
    several = isinstance(values, Iterable) and not isinstance(values, (str, bytes, Mapping))
    found = [*values] if several else []
    if len(found) != 2:
        given = f"{len(found)} value{'' if len(found) == 1 else 's'}" if several else _given(values)
        raise ImpactlabError(f"{name}: {given} given. Allowed: a pair", remedy=f"Give two values, as in {example}.")
    return found[0], found[1]


def row_of_numbers(name: str, values: ArrayLike) -> Array:
    """Return numbers as an array of any shape, of a signal its values; raise `ImpactlabError` where they are none."""
    held = getattr(values, "values", None)  # of a signal that was read or measured
    try:
        return np.asarray(held if isinstance(held, np.ndarray) else values, float)
    except (TypeError, ValueError):
        raise ImpactlabError(
            f"{name} is {_given(values)}; it must be a row of numbers",
            remedy="Give an array or a list of numbers, such as the `values` of a signal.",
        ) from None


def one_of(name: str, value: Any, allowed: Sequence[str]) -> str:
    """Return a word; raise `ImpactlabError` unless it is one of the allowed ones."""
    if not isinstance(value, str) or value not in allowed:
        words = f"{', '.join(allowed[:-1])} or {allowed[-1]}"
        raise ImpactlabError(f"{name} is {_given(value)}. Allowed: {words}", remedy=f"Give {words}.")
    return value


def expect(given: object, kind: type, remedy: str) -> None:
    """Raise `ImpactlabError` unless a function was given an object of a class."""
    if not isinstance(given, kind):
        needed = kind.__name__.removeprefix("Abstract")
        raise ImpactlabError(f"a {needed} is needed, and {_given(given)} is given", remedy=remedy)


def _given(value: Any) -> str:
    """Return a value as a message shows it, never longer than some 80 characters."""
    text = repr(value)
    return text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]}..."


def listed(values: float | str | Iterable[float | str]) -> list[float | str]:
    """Return one value, or several, as a list; anything else as one value, refused later."""
    return [*values] if isinstance(values, Iterable) and not isinstance(values, (str, Mapping)) else [values]  # type: ignore[list-item]


def warn_size(name: str, value: float) -> None:
    """Issue an `UnusualValue` for a size [m] larger than that of any Hopkinson bar."""
    if value > MAX_SIZE:
        warn_unusual(
            f"the {name} is {value:.6g} m, and those of Hopkinson bars are below {MAX_SIZE:g} m. Lengths are in "
            f"metres: of {value:.6g} mm give {1e-3 * value:.6g}, or '{value:.6g} mm'."
        )


def warn_distance(name: str, value: float) -> None:
    """Issue an `UnusualValue` for a distance [m] along a bar that is longer than any bar."""
    if value > MAX_DISTANCE:
        warn_unusual(
            f"{name} is {value:.6g} m, and bars are shorter than {MAX_DISTANCE:g} m. Distances are in metres: of "
            f"{value:.6g} mm give {1e-3 * value:.6g}, or '{value:.6g} mm'."
        )


def warn_outside(name: str, value: float, unit: str, usual: tuple[float, float], example: str) -> None:
    """Issue an `UnusualValue` of a number outside the values that it has for solids."""
    if not usual[0] <= value <= usual[1]:
        warn_unusual(
            f"the {name} is {value:.6g} {unit}, and those of solids lie between {usual[0]:g} and {usual[1]:g} {unit}. "
            f"Give it in {unit}, or with its unit, as in {example}."
        )


def warn_samples(dt: float, *strains: Array) -> None:
    """Issue an `UnusualValue` of large strains or a long sampling interval.

    Strains are beyond those of a bar; the interval is in s.
    """
    peak = max((float(np.abs(strain).max()) for strain in strains if strain.size), default=0.0)
    if peak > MAX_STRAIN:
        warn_unusual(
            f"the largest strain of a bar is {peak:.6g}, and bars stay elastic below {MAX_STRAIN:g}. Strains are m/m: "
            "multiply those in um/m by 1e-6."
        )
    if dt > MAX_INTERVAL:
        unit, size = ("us", 1e-6) if dt > MILLISECONDS else ("ms", 1e-3)
        warn_unusual(
            f"the time between samples is {dt:.6g} s, longer than {1e6 * MAX_INTERVAL:g} us: pulses of Hopkinson bars "
            f"last some 100 us. Times are in seconds: of {dt:.6g} {unit} give {size * dt:.6g}."
        )


def warn_unusual(text: str) -> None:
    """Issue an `UnusualValue` at the first caller outside of impactlab."""
    warn(text, UnusualValue)


def warn(text: str, kind: type[RunWarning]) -> None:
    """Issue a warning at the first caller outside of impactlab."""
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith("impactlab."):
        level, frame = level + 1, frame.f_back
    warnings.warn(text, kind, stacklevel=level)
