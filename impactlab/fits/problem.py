"""Residuals of cases against signals, over scaled unknowns, with their Jacobian."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from impactlab import api
from impactlab.casefile import Case
from impactlab.casefile.text.words import shown as words_of
from impactlab.derivatives.parameters import refuse_twice
from impactlab.errors import CaseError
from impactlab.fits.filters import LowPass, smooth
from impactlab.fits.loss import from_median
from impactlab.fits.model import AbstractMeans
from impactlab.fits.signals import SETTINGS, Signal
from impactlab.fits.trials import MarchedTrials, Trials, trials_of
from impactlab.fits.unknowns import COMMON, Unknown, settings, unknown
from impactlab.sweeps.sampled import Sampled, check_sampled
from impactlab.types import Array

STEP = 1.0e-6  # of a scaled unknown of the case: differences of runs
SETTING_STEP = 1.0e-3  # of gain, offset and shift: a shift moves a sample over a front
MIN_EFFECT = 1.0e-6  # of a signal: a logarithm that changes it by less does not move it; differences have this rounding
MAX_EFFECT = 0.1 / STEP  # of a signal: one that a step changes by more than a tenth of its size is rounding itself
MIN_NOISE = 0.01  # of the noise of the noisiest signal: a signal is not taken for cleaner
PENALTY = 1.0e3  # residual of a run that is not possible: the step before it is shortened


class Experiment(NamedTuple):
    """A case, and the signals that were measured on it."""

    case: Case
    signals: Sequence[Signal]


class Measured(NamedTuple):
    """A signal in a problem: filter, scale of its residuals, gain, offset and shift."""

    signal: Signal
    label: str
    edges: Array
    low_pass: LowPass | None
    scale: Array | float
    settings: tuple[float | int, ...]  # of `SETTINGS`: the number, or which unknown it is

    @property
    def kept(self) -> int:
        """Number of residuals."""
        return len(self.signal.time) if self.low_pass is None else self.low_pass.count


def whitened(errors: Array, correlated: float) -> Array:
    """Return errors without the part that follows from the one before; along the first axis."""
    if not correlated:
        return errors
    return np.concatenate([errors[:1] * math.sqrt(1.0 - correlated**2), errors[1:] - correlated * errors[:-1]])


class Problem:
    """Residuals of signals over their noise, as a function of the unknowns.

    Unknowns of the case come first, then those of the instruments.

    Parameters
    ----------
    experiments : sequence of Experiment
        Cases with their signals; unknowns are shared by path, and start at the values of the first case.
    parameters : mapping
        Dotted path of each number that is fitted to its bounds.
    given : mapping
        Gain, offset and shift of signals that have none of their own.
    noise : str
        ``std`` where each sample has a standard deviation.
    bandwidth : float
        Of a low-pass of data and model [Hz]; 0 for none.

    Raises
    ------
    CaseError
        If a path, bound, signal or channel is wrong.
    """

    def __init__(
        self,
        experiments: Sequence[Experiment],
        parameters: Mapping[str, Any],
        given: Mapping[str, Any] | None = None,
        noise: str = "white",
        bandwidth: float = 0.0,
    ) -> None:
        self.experiments = [Experiment(case, list(signals)) for case, signals in experiments]
        self.signals = [signal for each in self.experiments for signal in each.signals]
        if not self.signals or not all(each.signals for each in self.experiments):
            raise CaseError("no signal to fit", remedy="Give at least one for each case.")
        wrong = next((each for each in self.signals if not isinstance(each, Signal)), None)
        if wrong is not None:
            text = f"{words_of(wrong)} is given where a signal is needed"
            raise CaseError(text, remedy="Give il.Signal(channel, times, values), or those of il.read_signals(...).")
        if not parameters:
            raise CaseError("no parameter to fit", remedy="Name numbers of the case, with bounds.")
        for each in self.experiments:
            refuse_twice(each.case, list(parameters))
        self.parameters = [unknown(self.experiments[0].case, path, bounds) for path, bounds in parameters.items()]
        for each in self.experiments[1:]:
            for path, bounds in parameters.items():
                unknown(each.case.with_(path, self._start(path)), path, bounds)
        self.unknowns = list(self.parameters)
        self.measured = self._read(dict(given or {}), noise, bandwidth)
        self.size = len(self.unknowns)
        self.count = sum(each.kept for each in self.measured)
        if self.count <= self.size:
            raise CaseError(
                f"{self.count} samples are given for {self.size} unknowns. Allowed: more samples than unknowns",
                remedy="Give more samples, or fewer parameters.",
            )
        self.smoothed = 0.0  # width of the filter of a stage, of the residuals of a signal
        self.correlated = [0.0] * len(self.signals)  # of neighbouring residuals, taken out of them
        self.left_out: list[NDArray[np.bool_]] = []  # samples of each signal whose residuals count as 0
        self.trials = [self._trials(each) for each in self.experiments]
        self._check_moved()

    @property
    def is_quick(self) -> bool:
        """Whether a trial takes a fraction of a millisecond, as that of exact scenes."""
        return all(isinstance(each, MarchedTrials) for each in self.trials)

    @property
    def has_shifts(self) -> bool:
        """Whether the start of the run on the clock of a signal is fitted."""
        return any(self.place(number, "shift") is not None for number in range(len(self.signals)))

    def _start(self, path: str) -> float:
        return next(each.start for each in self.parameters if each.path == path)

    def _read(self, given: dict[str, Any], noise: str, bandwidth: float) -> list[Measured]:
        channels = [signal.channel for signal in self.signals]
        clocks = [number for number, each in enumerate(self.experiments) for _ in each.signals]
        shared: dict[int, int] = {}  # the common shift of each experiment
        found = []
        for number, signal in enumerate(self.signals):
            label = signal.channel
            if channels.count(label) > 1:
                label += f" ({channels[: number + 1].count(label)})"
            places: list[float | int] = []
            for name, each in settings(signal, given, label).items():
                is_common = name == "shift" and (given.get(name) if signal.shift is None else signal.shift) == COMMON
                if is_common and clocks[number] in shared:
                    places.append(shared[clocks[number]])
                    continue
                places.append(len(self.unknowns) if isinstance(each, Unknown) else float(each))
                if isinstance(each, Unknown):
                    if is_common:
                        shared[clocks[number]] = len(self.unknowns)
                        which = f" ({clocks[number] + 1})" if len(self.experiments) > 1 else ""
                        each = each._replace(path=f"shift of all signals{which}")
                    self.unknowns.append(each)
            if noise == "std" and signal.std is None:
                raise CaseError(
                    f"signal {signal.channel} has no standard deviations",
                    remedy="Give a column headed std and the heading of the signal, Signal(std=...), or another noise.",
                )
            low_pass = LowPass(signal, bandwidth) if bandwidth else None
            scale: Array | float = signal.scale
            if noise == "std" and signal.std is not None:
                scale = signal.std if low_pass is None else low_pass.deviations(signal.std)
            found.append(Measured(signal, label, signal.edges, low_pass, scale, tuple(places)))
        return found

    def _trials(self, experiment: Experiment) -> Trials:
        case = experiment.case.with_settings([(each.path, each.start) for each in self.parameters])
        for signal in experiment.signals:
            check_sampled(Sampled(signal.channel, (0.0,)), *case.simulation(), math.inf)
        with api.warnings_kept():
            history = api.run(case)
        return trials_of(case, self.parameters, [signal.channel for signal in experiment.signals], history)

    def _check_moved(self) -> None:
        """Raise `CaseError` for a signal that no parameter moves, and the error of a case that cannot be run."""
        start = self.start()
        if self.means(start) is None:
            for case in self.cases(start):
                with api.warnings_kept():
                    api.run(case)
        jacobian, at = self.jacobian(start, both_sides=not self.is_quick), 0
        for number, (each, mean) in enumerate(zip(self.measured, self.means(start) or [], strict=True)):
            rows = jacobian[at : at + each.kept, : len(self.parameters)]
            at += each.kept
            shown = self.filtered(number, mean.over(each.edges, self.setting(start, number)[2]))
            size = float(np.max(np.abs(shown)))
            largest = float(np.max(np.abs(rows)))
            is_rough = not largest < MAX_EFFECT * size
            if not MIN_EFFECT * size < largest or (is_rough and self.is_quick):  # exact runs have rounding alone
                raise CaseError(
                    f"no parameter moves the signal {each.label}",
                    remedy="Leave it out, measure longer, or fit a number on which it depends.",
                )
            if is_rough:
                path = self.parameters[int(np.argmax(np.max(np.abs(rows), axis=0)))].path
                raise CaseError(
                    f"a change of {path} by {STEP:g} of its value changes the signal {each.label} by more "
                    "than a tenth: the signal is not a smooth function of it, and no fit converges",
                    remedy="Give a method without chatter: solve.model: {kind: continuous}, or a softer law.",
                )

    def start(self) -> Array:
        """Return the scaled unknowns from which the fit starts, (n,)."""
        return np.array([each.scaled(each.start) for each in self.unknowns])

    def bounds(self) -> tuple[Array, Array]:
        """Return the bounds of the scaled unknowns, (n,) each."""
        ends = [(each.scaled(each.low), each.scaled(each.high)) for each in self.unknowns]
        return np.array([low for low, _ in ends]), np.array([high for _, high in ends])

    def values(self, scaled: Array) -> list[float]:
        """Return the values of all unknowns, in SI."""
        return [each.value(x) for each, x in zip(self.unknowns, scaled.tolist(), strict=True)]

    def cases(self, scaled: Array) -> tuple[Case, ...]:
        """Return the cases with values of the unknowns."""
        values = tuple(self.values(scaled)[: len(self.parameters)])
        return tuple(each.at(values) for each in self.trials)

    def means(self, scaled: Array) -> list[AbstractMeans] | None:
        """Return the signal of each channel from the runs; None without such a run."""
        values = tuple(self.values(scaled)[: len(self.parameters)])
        found = [each.means(values) for each in self.trials]
        return None if any(each is None for each in found) else [mean for each in found for mean in each or ()]

    def closings(self, scaled: Array) -> list[tuple[str, ...]] | None:
        """Return the contacts that close in each experiment, in order; None without such a run."""
        values = tuple(self.values(scaled)[: len(self.parameters)])
        found = [each.closings(values) for each in self.trials]
        whole = [each for each in found if each is not None]
        return whole if len(whole) == len(found) else None

    def setting(self, scaled: Array, number: int) -> tuple[float, float, float]:
        """Return gain, offset and shift [s] of a signal by number."""
        gain, offset, shift = (
            self.unknowns[each].value(float(scaled[each])) if isinstance(each, int) else each
            for each in self.measured[number].settings
        )
        return gain, offset, shift

    def place(self, number: int, name: str) -> int | None:
        """Return the number of the unknown gain, offset or shift of a signal; None if known."""
        found = self.measured[number].settings[SETTINGS.index(name)]
        return found if isinstance(found, int) else None

    def residuals(self, scaled: Array) -> Array:
        """Return the residuals of all signals, one after the other."""
        parts = self.parts(scaled)
        return np.full(self.count, PENALTY) if parts is None else np.concatenate(parts)

    def parts(self, scaled: Array) -> list[Array] | None:
        """Return the residuals of each signal; None where there is no such run."""
        means = self.means(scaled)
        if means is None:
            return None
        return [self.part(number, mean, self.setting(scaled, number)) for number, mean in enumerate(means)]

    def fitted(self, scaled: Array) -> list[Array]:
        """Return each unfiltered signal of the cases, (samples,) in SI units; NaN without a run."""
        means = self.means(scaled)
        if means is None:
            return [np.full(len(signal.time), math.nan) for signal in self.signals]
        found = []
        for number, mean in enumerate(means):
            gain, offset, shift = self.setting(scaled, number)
            found.append(gain * mean.over(self.measured[number].edges, shift) + offset)
        return found

    def weigh(self, scaled: Array) -> None:
        """Scale the residuals of each signal by its own noise.

        A noisy signal then does not hide a clean one.
        """
        sizes = np.array([from_median(part) for part in self.parts(scaled) or []])
        sizes = np.maximum(sizes, MIN_NOISE * np.max(sizes, initial=1e-300))
        whole = math.sqrt(float(np.mean(sizes**2)))
        for number, size in enumerate(sizes.tolist()):
            of = self.measured[number]
            self.measured[number] = of._replace(scale=of.scale * size / whole)

    def leave_out(self, scaled: Array, limit: float) -> None:
        """Leave samples out, from now on, whose residuals are larger than a limit."""
        self.left_out = [np.abs(part) > limit for part in self.parts(scaled) or []]

    def part(self, number: int, mean: AbstractMeans, chosen: tuple[float, float, float]) -> Array:
        """Return the residuals of a signal, for a gain, offset and shift."""
        of = self.measured[number]
        gain, offset, shift = chosen
        return self.filtered(number, gain * mean.over(of.edges, shift) + offset - of.signal.values)

    def filtered(self, number: int, difference: Array) -> Array:
        """Return the residuals of a signal from differences of model and samples."""
        of = self.measured[number]
        found = difference if of.low_pass is None else of.low_pass(difference)
        found = smooth(found, self.smoothed * len(found)) / of.scale
        found = whitened(np.asarray(found), self.correlated[number])
        if self.left_out:
            found[self.left_out[number]] = 0.0
        return found

    def jacobian(self, scaled: Array, *, both_sides: bool = False) -> Array:
        """Return the derivatives of the residuals, (residuals, unknowns), by differences.

        Samples of an exact scene are integrals, so that a difference over a millionth is right to six digits. Those of
        steps jump where an event passes into another step: with ``both_sides`` the smaller of two differences, to
        larger and to smaller values, is taken, which does not contain the jump beside a solution.
        """
        base = self.parts(scaled)
        found = np.zeros((self.count, self.size))
        means = self.means(scaled)
        if base is None or means is None:
            return found
        whole, (_, high) = np.concatenate(base), self.bounds()
        for number in range(len(self.parameters)):
            slopes = []
            for step in (-STEP, STEP) if scaled[number] + STEP > high[number] else (STEP, -STEP):
                moved = scaled.copy()
                moved[number] += step
                parts = self.parts(moved)
                if parts is not None:  # else there is no such run: the other side
                    slopes.append((np.concatenate(parts) - whole) / step)
                    if not both_sides:
                        break
            if slopes:
                found[:, number] = min(slopes, key=lambda slope: float(slope @ slope))
        at = 0
        for number, part in enumerate(base):
            for name in SETTINGS:
                place = self.place(number, name)
                if place is not None:
                    moved = scaled.copy()
                    moved[place] += SETTING_STEP if scaled[place] + SETTING_STEP <= high[place] else -SETTING_STEP
                    there = self.part(number, means[number], self.setting(moved, number))
                    found[at : at + len(part), place] = (there - part) / (moved[place] - scaled[place])
            at += len(part)
        return found
