"""End forces over time: samples joined by straight lines, or a function."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import final

import numpy as np
from numpy import float64

from impactlab.startup.cached import cached_property
from impactlab.types import Array

PARTS = 200  # of a run, in each of which a function may change its slope
LINES = 20_000  # that stand for a function beside its run: in checks, scales and impulses
MAX_SAMPLES = 1_000_000  # straight lines that stand for a function; a run of fewer steps has one to a step
ZERO = 1e-12  # of the largest force: a sample at the start or the end that is no larger is rounding
SAME_TIME = 1e-9  # of the duration: samples may end this much before the run


class AbstractLoad(ABC):
    """A force on an end over time [N], positive along +x, on a beam along +u."""

    @abstractmethod
    def at(self, t: Array) -> Array:
        """Return the force [N] at times t [s], shape of t."""

    @abstractmethod
    def scaled(self, force: float, time: float = 1.0) -> AbstractLoad:
        """Return the load with other units of force and time: each value times a factor."""

    @abstractmethod
    def table(self, duration: float, steps: int) -> tuple[Array, Array]:
        """Return times [s] and forces [N], (n,), with straight lines between them, over [0, duration].

        A load without samples of its own has a line for each of the ``steps``.
        """

    @abstractmethod
    def sampled(self, duration: float) -> SampledLoad:
        """Return the load over [0, duration] as straight lines.

        There are `LINES` of them if it has no samples of its own.
        """

    @abstractmethod
    def spacing(self, duration: float) -> float:
        """Return the shortest time in which its slope changes [s], for the steps of a run."""

    @abstractmethod
    def lines(self, duration: float) -> int | None:
        """Return the number of straight lines over a run; None for a force of another kind."""

    def largest(self, duration: float) -> float:
        """Return its largest size [N] over [0, duration]."""
        own = self.sampled(duration)
        inside = own.forces[(own.times > 0.0) & (own.times < duration)]
        return float(np.abs([*inside, *self.at(np.array([0.0, duration]))]).max())


@final
@dataclass(frozen=True)
class SampledLoad(AbstractLoad):
    """Forces f [N] at rising times t [s], straight lines between them.

    Before the first sample and after the last the force is that of the sample. `reaches` returns whether this is more
    than a force of zero that stays zero.
    """

    t: tuple[float, ...]
    f: tuple[float, ...]

    @cached_property
    def times(self) -> Array:
        """Times [s], shape (n,)."""
        return np.array(self.t)

    @cached_property
    def forces(self) -> Array:
        """Forces [N], shape (n,)."""
        return np.array(self.f)

    def at(self, t: Array) -> Array:
        return np.asarray(np.interp(t, self.times, self.forces), dtype=float)

    def scaled(self, force: float, time: float = 1.0) -> SampledLoad:
        return SampledLoad(tuple((time * self.times).tolist()), tuple((force * self.forces).tolist()))

    def table(self, duration: float, steps: int) -> tuple[Array, Array]:
        return self.times, self.forces

    def sampled(self, duration: float) -> SampledLoad:
        return self

    def spacing(self, duration: float) -> float:
        return float(np.diff(self.times).min())

    def lines(self, duration: float) -> int:
        return 1 + int(np.count_nonzero((self.times > 0.0) & (self.times < duration)))

    def reaches(self, duration: float) -> tuple[bool, bool]:
        """Return whether the force is given at the start and end of a run.

        It is given by samples, or by zeros outside them. A sample of a zero by rounding, as sin(pi) at the end of half
        a sine, counts as zero.
        """
        zero = ZERO * float(np.abs(self.forces).max())
        start = self.t[0] <= 0.0 or abs(self.f[0]) <= zero
        return start, self.t[-1] >= duration * (1.0 - SAME_TIME) or abs(self.f[-1]) <= zero

    def impulse(self, t: Array) -> Array:
        """Return the impulse of the force from 0 to t >= 0 [s], of its shape [N s]."""
        times, forces, slopes, impulse = self._knots
        at = np.clip(np.searchsorted(times, t, side="right") - 1, 0, None)
        after = np.asarray(t) - times[at]
        return np.asarray(impulse[at] + after * (forces[at] + 0.5 * slopes[at] * after))

    @cached_property
    def _knots(self) -> tuple[Array, Array, Array, Array]:
        """Times from 0 on, force, its slope after each, and impulse at each, (n,)."""
        times = np.concatenate(([0.0], self.times[self.times > 0.0]))
        forces, lengths = self.at(times), np.diff(times)
        slopes = np.append(np.diff(forces) / lengths, 0.0)
        impulse = np.concatenate(([0.0], np.cumsum(0.5 * (forces[1:] + forces[:-1]) * lengths)))
        return times, forces, slopes, impulse


@final
@dataclass(frozen=True)
class FunctionLoad(AbstractLoad):
    """A force as a function of time, times factors of force and time."""

    function: Callable[[Array], Array]  # t [s] (n,) to N (n,)
    force: float = 1.0
    time: float = 1.0

    def at(self, t: Array) -> Array:
        return np.asarray(self.force * self.function(np.asarray(t, dtype=float) / self.time), dtype=float)

    def scaled(self, force: float, time: float = 1.0) -> FunctionLoad:
        return replace(self, force=force * self.force, time=time * self.time)

    def table(self, duration: float, steps: int) -> tuple[Array, Array]:
        count = max(1, min(steps, MAX_SAMPLES))
        times = np.asarray(np.arange(count + 1) * (duration / count), dtype=float64)
        return times, self.at(times)

    def sampled(self, duration: float) -> SampledLoad:
        return _in_lines(self, duration)

    def spacing(self, duration: float) -> float:
        return duration / PARTS

    def lines(self, duration: float) -> None:
        return None


@lru_cache(maxsize=16)
def _in_lines(load: FunctionLoad, duration: float) -> SampledLoad:
    times, forces = load.table(duration, LINES)
    return SampledLoad(tuple(times.tolist()), tuple(forces.tolist()))
