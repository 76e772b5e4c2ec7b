"""Openings and closings within an accepted step, as roots of the solver's interpolant."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from impactlab.simulate.adaptive.system import System
from impactlab.types import Array

SAMPLES = 9  # of an interpolant, whose degree is at most seven
ROOT_TOL = 1e-14  # of a step, to which an event is located
NOISE = 1e-12  # of the travels and forces of the scene: a smaller change is rounding, faces at rest would chatter


class Change(NamedTuple):
    """A contact that opens or closes."""

    time: float  # s
    number: int


class ContactInStep:
    """One contact over one step: how near it is to changing, and its force."""

    def __init__(self, system: System, interpolant: Any, number: int) -> None:
        self.system, self.interpolant, self.number = system, interpolant, number
        self.contact = system.contacts[number]

    def closed_indicator(self, gap: float, rate: float) -> float:
        """Return a number that is positive exactly where faces overlap and the law pushes; continuous."""
        overlap = -gap / self.system.travel
        if gap >= 0.0:
            return overlap
        return min(overlap, self.force(gap, rate) / self.system.force)

    def force(self, gap: float, rate: float) -> float:
        """Return the law's signed force [N]."""
        return float(self.contact.evaluate(gap, rate).trial)

    def change_indicator(self, gap: float, rate: float) -> float:
        """Return `closed_indicator`, its sign such that positive means a change."""
        closed = self.closed_indicator(gap, rate)
        return -closed if self.contact.closed else closed

    def at(self, function: Callable[[float, float], float]) -> Callable[[float], float]:
        """Return a function of gap and rate as one of time."""

        def of_time(time: float) -> float:
            gaps, rates = self.system.gaps_of(self.interpolant(time))
            return function(float(gaps[self.number]), float(rates[self.number]))

        return of_time


def maximum(function: Callable[[float], float], times: Array, values: Array) -> tuple[float, float]:
    """Return time and value of a maximum, interpolated between samples."""
    from scipy.optimize import minimize_scalar

    i, last = int(np.argmax(values)), len(values) - 1
    slopes = np.gradient(values, edge_order=2)  # of equal steps
    if (i == last and slopes[i] >= 0.0) or (i == 0 and slopes[i] <= 0.0):
        return float(times[i]), float(values[i])
    low, high = float(times[max(i - 1, 0)]), float(times[min(i + 1, last)])
    # The value at a crest is exact to the square of this.
    found = minimize_scalar(
        lambda t: -function(t), bounds=(low, high), method="bounded", options={"xatol": 1e-6 * (high - low)}
    )
    return max((float(found.x), -float(found.fun)), (float(times[i]), float(values[i])), key=lambda both: both[1])


def hidden_change(indicator: Callable[[float], float], times: Array, values: Array) -> float | None:
    """Return a time [s] at which a contact changed between samples, or None."""
    bulge = float(np.max(np.abs(np.diff(values, 2))))
    # A phase begins with zero: a crest there is its own beginning.
    if float(np.max(values)) + bulge <= NOISE or (np.argmax(values) == 0 and abs(values[0]) <= NOISE):
        return None
    time, top = maximum(indicator, times, values)
    return time if top > NOISE and time > times[0] else None


def first_change(system: System, interpolant: Any, begin: float, end: float) -> Change | None:
    """Return the first opening or closing in a step, or None.

    Changes that come and go between two samples are found where the sampled curve has its crest.
    """
    from scipy.optimize import brentq, minimize_scalar

    times = np.linspace(begin, end, SAMPLES)
    gaps, rates = system.gaps_of(interpolant(times))
    changes = []
    for number in range(len(system.contacts)):
        watch = ContactInStep(system, interpolant, number)
        values = np.array(
            [watch.change_indicator(float(g), float(r)) for g, r in zip(gaps[number], rates[number], strict=True)]
        )
        indicator = watch.at(watch.change_indicator)
        beyond = 1 + np.flatnonzero(values[1:] > NOISE)
        high = float(times[beyond[0]]) if beyond.size else hidden_change(indicator, times, values)
        if high is None:
            continue
        before = int(np.searchsorted(times, high)) - 1
        low, below = float(times[before]), float(values[before])
        if before == 0 and abs(below) <= NOISE:  # both ends of a phase before the first sample: between them a dip
            dip = minimize_scalar(
                indicator, bounds=(low, high), method="bounded", options={"xatol": 1e-6 * (high - low)}
            )
            low, below = (float(dip.x), float(dip.fun)) if dip.fun < 0.0 else (low, below)
        if below >= 0.0:
            changes.append(Change(low, number))
        # One instant alone is read with other rounding than all at once. A force may jump where it begins; then the
        # bracket, not the value, gives its time.
        elif indicator(low) < 0.0 < indicator(high):
            time, _ = brentq(
                indicator,
                low,
                high,
                xtol=max(ROOT_TOL * (end - begin), 1e-300),
                maxiter=200,
                full_output=True,
                disp=False,
            )
            changes.append(Change(float(time), number))
    return min(changes, default=None)


def largest_force(system: System, interpolant: Any, number: int, begin: float, end: float, known: float) -> float:
    """Return the largest force [N] of a closed contact in a step and before."""
    watch = ContactInStep(system, interpolant, number)
    times = np.linspace(begin, end, SAMPLES)
    gaps, rates = system.gaps_of(interpolant(times))
    values = np.array([watch.force(float(g), float(r)) for g, r in zip(gaps[number], rates[number], strict=True)])
    if values.max() < 0.98 * known:
        return known
    return max(known, maximum(watch.at(watch.force), times, values)[1])
