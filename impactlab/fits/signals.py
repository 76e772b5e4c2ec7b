"""Measured signals, checked, and the settings of their instruments: gain, offset and trigger time."""

from __future__ import annotations

from dataclasses import InitVar, dataclass, replace
from typing import Any

import numpy as np

from impactlab.casefile.text.words import listed, shown
from impactlab.casefile.values.units import STRAINS, to_si
from impactlab.errors import CaseError, closest
from impactlab.history.units import UNITS
from impactlab.measurement.inputs import above_zero
from impactlab.prefixes import prefixed_range
from impactlab.printing import counted
from impactlab.types import Array
from impactlab.wrong_calls import names_parameters

MIN_SAMPLES = 4
MAX_OFF = 0.4  # of an interval, of a time beside equal ones: one missing sample moves times by half an interval or more
ROUNDING = 1e-9  # relative: a record of whole intervals ends with a sample
SETTINGS = ("gain", "offset", "shift")

Setting = Any
"""A number, or a text with a unit, that is known; (lower, upper), between which it is fitted; or "free"."""


def factor_of(unit: str, wanted: str) -> float:
    """Return the factor from a unit to an SI unit.

    Raise `CaseError` with units that are allowed.
    """
    if wanted == "1":
        if unit in STRAINS:
            return STRAINS[unit]
        raise CaseError(
            f"{shown(unit)} is not a unit of strain.{closest(unit, STRAINS)}",
            remedy="Write 1, %, mm/m, um/m or microstrain, for example.",
        )
    try:
        return to_si(f"1 {unit}", wanted)
    except ValueError as error:
        raise CaseError(str(error), remedy=f"Give a unit of {wanted}.") from None


def unit_of(channel: str) -> str:
    """Return the SI unit of a channel."""
    quantity = channel.partition(":")[0]
    if quantity not in UNITS:
        raise CaseError(
            f"{shown(channel)} is not a channel.{closest(quantity, UNITS)}",
            remedy=f"A channel begins with one of: {listed(UNITS)}.",
        )
    return UNITS[quantity]


def _numbers(given: Any, name: str) -> Array:
    remedy = "Give an array of numbers; unit= and time_unit= name their units."
    try:
        if not np.iscomplexobj(given):  # else numpy would drop the imaginary parts
            return np.asarray(given, dtype=float)
    except (TypeError, ValueError) as error:
        raise CaseError(f"{name} does not hold numbers: {str(error)[:80]}", remedy=remedy) from None
    raise CaseError(f"{name} holds complex numbers", remedy=remedy)


@names_parameters
@dataclass(frozen=True, eq=False)
class Signal:
    """A measured channel: each sample is the mean over its sampling interval.

    The instrument shows ``gain`` times the channel plus ``offset``, from ``shift`` on.

    Parameters
    ----------
    channel : str
        The channel of a run that it measures, such as ``force:hammer|rod.left``.
    time : array
        Middles of the sampling intervals, (n,), increasing.
    values : array
        Samples, (n,).
    std : array, optional
        Standard deviation of each sample, (n,), for ``noise="std"``.
    gain, offset, shift : optional
        Gain [1], offset in the unit of the channel, and the time [s] on the clock of this instrument at which the run
        starts: a number (or a text with a unit) where it is known, ``(lower, upper)`` or ``"free"`` where it is fitted.
        By default as the fit has it.
    unit : str, optional
        Unit of ``values`` and ``std``; SI if not given. They are kept in SI.
    time_unit : str, optional
        Unit of ``time``; s if not given.

    Raises
    ------
    CaseError
        If times, samples or units are wrong; names the sample.
    """

    channel: str
    time: Array
    values: Array
    std: Array | None = None
    gain: Setting = None
    offset: Setting = None
    shift: Setting = None
    unit: InitVar[str] = ""
    time_unit: InitVar[str] = "s"

    def __repr__(self) -> str:
        span = prefixed_range(float(self.time[0]), float(self.time[-1]), "s")
        low, high, unit = float(self.values.min()), float(self.values.max()), unit_of(self.channel)
        size = f"{low:.4g} to {high:.4g}" if unit == "1" else prefixed_range(low, high, unit)
        return f"<Signal {self.channel!r}: {len(self.time)} samples at {span}, {size}>"

    def __post_init__(self, unit: str, time_unit: str) -> None:
        if not isinstance(self.channel, str):
            text = f"the channel of a signal is a {type(self.channel).__name__}, not a name"
            raise CaseError(text, remedy="Write Signal('force:hammer|rod.left', times, values), for example.")
        own = factor_of(unit, unit_of(self.channel)) if unit else 1.0
        factors = {"time": factor_of(time_unit, "s"), "values": own, "std": own}
        for name, factor in factors.items():
            if (given := getattr(self, name)) is not None or name != "std":
                object.__setattr__(self, name, factor * _numbers(given, f"signal {self.channel}: {name}"))
        self._check()

    def _check(self) -> None:
        if self.time.ndim != 1 or self.time.shape != self.values.shape:
            raise CaseError(
                f"signal {self.channel}: {self.time.shape} times and {self.values.shape} samples",
                remedy="Give one time for each sample.",
            )
        if len(self.time) < MIN_SAMPLES:
            text = f"signal {self.channel}: {counted(len(self.time), 'sample')}. Allowed: {MIN_SAMPLES} or more"
            raise CaseError(text, remedy="Give the samples of the whole record.")
        for name, column in (("time", self.time), ("value", self.values)):
            wrong = np.flatnonzero(~np.isfinite(column))
            if len(wrong):
                raise CaseError(
                    f"signal {self.channel}: {name} {wrong[0] + 1} is not a finite number",
                    remedy="Leave that sample out.",
                )
        falls = np.flatnonzero(np.diff(self.time) <= 0.0)
        if len(falls):
            raise CaseError(
                f"signal {self.channel}: time {falls[0] + 2}, {self.time[falls[0] + 1]:.9g} s, is not later than "
                f"time {falls[0] + 1}, {self.time[falls[0]]:.9g} s",
                remedy="Sort the samples by time, and leave out all but one of each instant.",
            )
        if self.std is not None and self.std.shape != self.values.shape:
            raise CaseError(
                f"signal {self.channel}: {self.std.shape} standard deviations and {self.values.shape} samples",
                remedy="Give one above 0 for each sample.",
            )
        off = () if self.std is None else tuple(np.flatnonzero(~((self.std > 0) & (self.std < np.inf))))
        if self.std is not None and off:
            raise CaseError(
                f"signal {self.channel}: standard deviation {off[0] + 1} is {self.std[off[0]]:g}. Allowed: above 0",
                remedy="Give one above 0 for each sample, or leave out samples without one.",
            )

    @property
    def width(self) -> float:
        """The usual sampling interval [s]."""
        return float(np.median(np.diff(self.time)))

    @property
    def interval(self) -> float:
        """The sampling interval of samples at equal intervals [s].

        Raises
        ------
        CaseError
            If a time lies more than 0.4 intervals beside that of equal ones, as where samples are missing.
        """
        times = self.time
        mean = float(times[-1] - times[0]) / (len(times) - 1)
        off = np.abs(times - (times[0] + mean * np.arange(len(times))))
        if off.max() > MAX_OFF * mean:
            raise CaseError(
                f"signal {self.channel}: the intervals between samples are not equal, and the time "
                f"{times[int(np.argmax(off))]:g} s is the farthest from equal ones",
                remedy="Interpolate: signal.resampled(interval).",
            )
        return mean

    def resampled(self, interval: float | str | None = None) -> Signal:
        """Return the signal at equal intervals, on straight lines between its samples.

        It begins with the first sample, and ends at the last whole interval of the record. Nothing is filtered: an
        interval longer than that of the samples aliases noise and oscillations.

        Parameters
        ----------
        interval : float or str, optional
            s, or a string with a unit, ``"0.5 us"``; the usual interval of the samples if not given.

        Raises
        ------
        CaseError
            If the signal has less than three of these intervals.
        ImpactlabError
            If the interval is not a time above 0.
        """
        step = self.width if interval is None else above_zero("interval", interval, "s")
        count = int((self.time[-1] - self.time[0]) / step * (1.0 + ROUNDING)) + 1
        if count < MIN_SAMPLES:
            raise CaseError(
                f"signal {self.channel}: an interval of {step:g} s in a record of {self.time[-1] - self.time[0]:g} s",
                remedy="Give a shorter interval, in s or with its unit.",
            )
        times = self.time[0] + step * np.arange(count)
        std = None if self.std is None else np.interp(times, self.time, self.std)
        return replace(self, time=times, values=np.interp(times, self.time, self.values), std=std)

    @property
    def scale(self) -> float:
        """Standard deviation of the samples; 1 where they are all the same."""
        return float(np.std(self.values)) or 1.0

    @property
    def edges(self) -> Array:
        """Ends of the sampling intervals [s], (n + 1,): midway between the times."""
        middle = 0.5 * (self.time[1:] + self.time[:-1])
        first, last = 2.0 * self.time[0] - middle[0], 2.0 * self.time[-1] - middle[-1]
        return np.concatenate([[first], middle, [last]])
