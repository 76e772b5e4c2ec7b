"""Residuals of a case against signals, over scaled unknowns, with their Jacobian."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from impactlab import api
from impactlab.casefile import Case
from impactlab.casefile.document import parse_value
from impactlab.casefile.words import shown
from impactlab.errors import CaseError, ImpactlabError
from impactlab.fits.model import Means, smooth
from impactlab.fits.signals import Signal
from impactlab.types import Array

STEP = 1.0e-6  # of a scaled unknown: differences of runs
WORSE = 1.0e3  # residual of a run that is not possible: the step before it is shortened


class Unknown(NamedTuple):
    """A number of the case that is fitted, by its logarithm where it is positive."""

    path: str
    start: float  # in SI
    low: float
    high: float
    unit: str

    @property
    def is_positive(self) -> bool:
        """Whether the logarithm is fitted."""
        return self.low > 0.0

    def scaled(self, value: float) -> float:
        """Return the scaled unknown of a value."""
        return math.log(value) if self.is_positive else (value - self.low) / (self.high - self.low)

    def value(self, scaled: float) -> float:
        """Return the value of a scaled unknown."""
        found = math.exp(scaled) if self.is_positive else self.low + scaled * (self.high - self.low)
        return min(max(found, self.low), self.high)


def read_bounds(text: str) -> tuple[str, tuple[Any, Any]]:
    """Return path and bounds of a text such as ``bodies.hammer.mass=1 kg:4 kg``."""
    path, equals, ends = (part.strip() for part in text.partition("="))
    low, colon, high = (part.strip() for part in ends.partition(":"))
    if not equals or not colon or not path or not low or not high:
        raise CaseError(
            f"--parameters {shown(text)} is not PATH=LOW:HIGH", remedy="Write bodies.hammer.mass=1:4 or so."
        )
    return path, (parse_value(low), parse_value(high))


class Problem:
    """Residuals of signals, over their noise: first the unknowns of the case, then a shift of each signal that is free.

    Shifts are in sampling intervals.
    """

    def __init__(self, case: Case, signals: Sequence[Signal], unknowns: Sequence[Unknown], free: bool) -> None:
        self.case, self.signals, self.unknowns, self.free = case, list(signals), list(unknowns), free
        self.widths = [float(np.median(np.diff(signal.times))) for signal in self.signals]
        self.scales = [float(np.std(signal.values)) or 1.0 for signal in self.signals]
        self.smoothed = 0.0  # samples, width of the filter of data and model
        self.correlated = 0.0  # of neighbouring residuals, taken out of them
        self.size = len(self.unknowns) + (len(self.signals) if free else 0)
        self._kept: dict[tuple[float, ...], list[Means] | None] = {}

    def bounds(self) -> tuple[Array, Array]:
        """Return the bounds of the scaled unknowns, (n,) each."""
        low = [each.scaled(each.low) for each in self.unknowns]
        high = [each.scaled(each.high) for each in self.unknowns]
        shifts = [len(signal.times) for signal in self.signals] if self.free else []
        return np.array(low + [-float(n) for n in shifts]), np.array(high + [float(n) for n in shifts])

    def at(self, scaled: Array) -> Case:
        """Return the case with values of the unknowns."""
        values = [each.value(x) for each, x in zip(self.unknowns, scaled.tolist(), strict=False)]
        return self.case.with_settings(
            list(zip([each.path for each in self.unknowns], values, strict=True)), by="the fit"
        )

    def means(self, scaled: Array) -> list[Means] | None:
        """Return what a run shows of each channel; None where there is no such run."""
        key = tuple(scaled[: len(self.unknowns)].tolist())
        if key not in self._kept:
            if len(self._kept) > 4 * self.size + 8:
                self._kept.clear()
            try:
                with api.warnings_kept():
                    history = api.run(self.at(scaled))
                self._kept[key] = [Means(history, signal.channel) for signal in self.signals]
            except ImpactlabError:
                self._kept[key] = None
        return self._kept[key]

    def shifts(self, scaled: Array) -> list[float]:
        """Return the shift of each signal [s]."""
        given = scaled[len(self.unknowns) :].tolist() if self.free else [0.0] * len(self.signals)
        return [each * width for each, width in zip(given, self.widths, strict=True)]

    def residuals(self, scaled: Array) -> Array:
        """Return the residuals of all signals, one after the other."""
        means = self.means(scaled)
        if means is None:
            return np.full(sum(len(signal.times) for signal in self.signals), WORSE)
        return np.concatenate(self.parts(means, self.shifts(scaled)))

    def parts(self, means: Sequence[Means], shifts: Sequence[float]) -> list[Array]:
        """Return the residuals of each signal."""
        found = []
        for signal, mean, shift, scale in zip(self.signals, means, shifts, self.scales, strict=True):
            difference = mean.over(signal.edges, shift) - signal.values
            difference = smooth(difference, self.smoothed) / scale
            if self.correlated:
                difference[1:] = difference[1:] - self.correlated * difference[:-1]
                difference[0] *= math.sqrt(1.0 - self.correlated**2)
            found.append(difference)
        return found

    def jacobian(self, scaled: Array) -> Array:
        """Return the derivatives of the residuals by differences of runs, (residuals, unknowns)."""
        base = self.residuals(scaled)
        columns = []
        _, high = self.bounds()
        for number in range(self.size):
            # a shift moves a sample over a front: it is differenced over a part of a sample
            step = STEP if number < len(self.unknowns) else 1.0e-3
            if scaled[number] + step > high[number]:
                step = -step
            if self.means(self._moved(scaled, number, step)) is None:  # no such run: the other side
                step = -step
            columns.append((self.residuals(self._moved(scaled, number, step)) - base) / step)
        return np.stack(columns, axis=-1)

    @staticmethod
    def _moved(scaled: Array, number: int, step: float) -> Array:
        moved = scaled.copy()
        moved[number] += step
        return moved
