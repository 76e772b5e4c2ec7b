"""Unknowns of a fit: bounded numbers of the case, and settings of instruments."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from impactlab.casefile import Case
from impactlab.casefile.document import parse_value
from impactlab.casefile.text.words import shown
from impactlab.casefile.values.units import strain_of, to_si
from impactlab.derivatives.parameters import read_parameters
from impactlab.errors import CaseError
from impactlab.fits.signals import SETTINGS, Signal, unit_of

MAX_OFFSET = 3.0  # times the range of the samples: an offset that is free
COMMON = "common"  # of a shift: one that all signals of an experiment share, whose instruments have one clock
PLAIN = {"gain": 1.0, "offset": 0.0, "shift": 0.0}


def is_of_instrument(path: str) -> bool:
    """Return whether an unknown is a gain, offset or shift, such as ``gain of CHANNEL``, not a number of the case."""
    return " of " in path


class Unknown(NamedTuple):
    """A number that is fitted, possibly by a logarithm.

    It is the logarithm of the ratio to the start for a positive number of the case.
    """

    path: str  # of the case; or ``gain of CHANNEL``
    start: float  # in SI
    low: float
    high: float
    unit: str
    scale: float = 0.0  # of the scaled unknown; 0 where it is the logarithm

    @property
    def is_positive(self) -> bool:
        """Whether the logarithm is fitted."""
        return self.scale == 0.0

    def scaled(self, value: float) -> float:
        """Return the scaled unknown of a value."""
        return math.log(value / self.start) if self.is_positive else value / self.scale

    def value(self, scaled: float) -> float:
        """Return the value of a scaled unknown."""
        found = self.start * math.exp(scaled) if self.is_positive else scaled * self.scale
        return min(max(found, self.low), self.high)


def read_bounds(text: str) -> tuple[str, tuple[Any, Any]]:
    """Return path and bounds of a text such as ``bodies.hammer.mass=1 kg:4 kg``."""
    path, equals, ends = (part.strip() for part in text.partition("="))
    low, colon, high = (part.strip() for part in ends.partition(":"))
    if not equals or not colon or not path or not low or not high:
        remedy = f"Write {path[:80] or 'bodies.hammer.mass'}=LOW:HIGH, the range in which it is sought."
        raise CaseError(f"--parameters {shown(text)} is not PATH=LOW:HIGH", remedy=remedy)
    if "," in high and "=" in high:
        raise CaseError(
            f"--parameters {shown(text)} gives several numbers",
            remedy="Give the option once for each: --parameters A=LOW:HIGH --parameters B=LOW:HIGH.",
        )
    try:
        return path, (parse_value(low), parse_value(high))
    except CaseError as error:
        error.path, error.line, error.given_by = path, None, "--parameters"
        raise


def read_setting(text: str) -> Any:
    """Return a setting of an instrument from a text: ``free``, ``fixed``, a number, or ``LOW:HIGH``."""
    low, colon, high = (part.strip() for part in text.partition(":"))
    return (low, high) if colon else low


def unknown(case: Case, path: str, bounds: Any) -> Unknown:
    """Return a fitted number of the case.

    Raise `CaseError` where its bounds are wrong.
    """
    (parameter,) = read_parameters(case, [path])
    try:
        low, high = bounds
    except (TypeError, ValueError):
        raise CaseError(f"{bounds!r} is not a pair of bounds", path=path, remedy="Give (lower, upper).") from None
    ends = [_number(end, parameter.unit, path) for end in (low, high)]
    if not ends[0] < ends[1]:
        text = f"the lower bound {low} is not below the upper one, {high}"
        raise CaseError(text, path=path, remedy="Give the lower one first, as in (1.0, 3.0).")
    if not ends[0] <= parameter.value <= ends[1]:
        raise CaseError(
            f"the start {parameter.value:g} lies outside {ends[0]:g} to {ends[1]:g} {parameter.unit}", path=path,
            remedy="Give the case a value inside the bounds.",
        )  # fmt: skip
    scale = 0.0 if ends[0] > 0.0 else ends[1] - ends[0]
    return Unknown(path, parameter.value, ends[0], ends[1], parameter.unit, scale)


def setting(signal: Signal, name: str, given: Any, label: str) -> float | Unknown:
    """Return gain, offset or shift of a signal: a number if known, else an unknown."""
    own = getattr(signal, name)
    chosen = given if own is None else own
    usual = PLAIN[name]
    if name == "gain":
        unit, scale, widest = "1", 1.0, math.inf
    elif name == "offset":
        unit, scale = unit_of(signal.channel), signal.scale
        widest = MAX_OFFSET * float(max(signal.values) - min(signal.values)) or math.inf
    else:
        unit, scale, widest = "s", signal.width, len(signal.time) * signal.width
    if chosen in (None, "fixed"):
        return usual
    path, is_strain = f"{name} of {label}", name == "offset" and unit == "1"
    if chosen == "free" or (chosen == COMMON and name == "shift"):
        low = 0.0 if name == "gain" else usual - widest
        return Unknown(path, usual, low, usual + widest, unit, scale)
    if isinstance(chosen, (tuple, list)) and len(chosen) == 2:
        low, high = (_number(end, unit, path, is_strain) for end in chosen)
        if not low < high:
            text = f"the lower bound {chosen[0]} is not below the upper one, {chosen[1]}"
            raise CaseError(text, path=path, remedy="Give the lower one first.")
        return Unknown(path, min(max(usual, low), high), low, high, unit, scale)
    try:
        return _number(chosen, unit, path, is_strain)
    except CaseError as error:
        raise CaseError(error.text, path=path, remedy="Give a number, (lower, upper), 'free' or 'fixed'.") from None


def _number(given: Any, unit: str, path: str, is_strain: bool = False) -> float:
    try:
        found = float(given)
    except (TypeError, ValueError):
        try:
            found = strain_of(str(given)) if is_strain else to_si(str(given), unit)
        except ValueError as error:
            plain = unit == "1" and not is_strain
            remedy = "Give a plain number." if plain else "Give a number in SI units, or a text with its unit."
            raise CaseError(str(error), path=path, remedy=remedy) from None
    if not math.isfinite(found):
        raise CaseError(f"{given} is not finite", path=path, remedy="Give a finite number, or 'free'.")
    return found


def settings(signal: Signal, given: dict[str, Any], label: str) -> dict[str, float | Unknown]:
    """Return gain, offset and shift of a signal.

    ``given`` are those of the fit for signals without their own.
    """
    return {name: setting(signal, name, given.get(name), label) for name in SETTINGS}


def frequency(given: float | str) -> float:
    """Return a bandwidth [Hz] of a number, or of a text such as ``100 kHz``."""
    return _number(given, "Hz", "bandwidth")
