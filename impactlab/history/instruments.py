"""Measured signals: the signal of a probe as its instrument would give it.

On its way the true signal is averaged over the gauge, low-passed, sampled, given noise, and converted.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from contextlib import suppress
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import CaseError
from impactlab.prefixes import prefixed_range
from impactlab.printing import at_most, counted
from impactlab.scene.instrument import Instrument
from impactlab.scene.problem import Probe, Scene
from impactlab.types import Array

MIN_POINTS = 32  # of the filter's weights in its standard deviation: a jump is placed within 0.7 % of its height
MAX_POINTS = 1024  # of them
ROUNDING = 1e-9  # of a rate, by which it may lie above that of the records; of a sample, by which one may end a run
REACH = 4.0  # standard deviations of a Gaussian weight, to each side


class Recorded(Protocol):
    """The parts of a history that an instrument reads."""

    scene: Scene
    duration: float  # s

    @property
    def record_rate(self) -> float:
        """Records per second."""

    def evaluate(self, t: ArrayLike, channel: str) -> Array:
        """Return a channel at times [s]."""


class Measuring(Protocol):
    """A history that gives the measured signals of its probes."""

    scene: Scene

    def measured(self, probe: Probe | str | int) -> Measured:
        """Return the signal of a probe as its instrument gives it."""


class Measured(NamedTuple):
    """A measured signal."""

    time: Array  # (n,) s
    values: Array  # (n,), in the unit of the quantity
    overloaded: int  # samples beyond the range of the converter, which stay at its end

    def __repr__(self) -> str:
        if not len(self.time):
            return "<Measured: no samples>"
        beyond = f", {self.overloaded} beyond the range of the converter" if self.overloaded else ""
        return (
            f"<Measured: {counted(len(self.time), 'sample')} at {prefixed_range(self.time[0], self.time[-1], 's')}, "
            f"{np.min(self.values):.4g} to {np.max(self.values):.4g}{beyond}>"
        )


def instrumented(scene: Scene) -> list[tuple[int, Probe]]:
    """Return the probes that are instruments, each with its number among all probes, from 0."""
    return [(number, probe) for number, probe in enumerate(scene.probes) if probe.instrument is not None]


def measured_file(number: int) -> str:
    """Return the name of the table with the measured signal of a probe, as measured_1.csv.

    Probes are numbered from 0.
    """
    return f"measured_{number + 1}.csv"


def check_rates(scene: Scene, recorded: float, only: Probe | None = None) -> None:
    """Raise `CaseError` where an instrument is faster than the records of its run.

    All instruments are checked, or that of the probe ``only``; ``recorded`` is the number of records per second.
    """
    for number, probe in instrumented(scene):
        if only not in (None, probe):
            continue
        instrument = probe.instrument or Instrument()
        for key, needed in (("rate", instrument.rate), ("bandwidth", 2.0 * (instrument.bandwidth or 0.0))):
            if needed is not None and needed > (1.0 + ROUNDING) * recorded:
                half, value = ("half of ", 0.5 * needed) if key == "bandwidth" else ("", needed)
                raise CaseError(
                    f"{value:.6g} Hz is above {half}the {recorded:.6g} records per second that this run keeps of "
                    f"{probe.channel}. Allowed: up to {at_most(recorded * value / needed)} Hz",
                    remedy="Give a smaller step, more solve.records, or a slower instrument.",
                    path=f"probes.{number}.{key}",
                )


def check_instruments(history: Recorded) -> None:
    """Raise `CaseError` where an instrument is faster than the records of its run."""
    if instrumented(history.scene):
        check_rates(history.scene, history.record_rate)


def probe_of(scene: Scene, probe: Probe | str | int) -> Probe:
    """Return a probe by itself, by its channel, or by its number from 0.

    Raises
    ------
    CaseError
        If the scene has no such probe, or two instruments at one place share the channel.
    """
    if isinstance(probe, Probe):
        return probe
    if isinstance(probe, int):
        found = list(scene.probes[probe : probe + 1]) if probe >= 0 else []
    else:
        found = [each for each in scene.probes if each.channel == probe]
        found = [each for each in found if each.instrument is not None] or found[:1]
    if len(found) == 1:
        return found[0]
    names = ", ".join(f"{number}: {each.channel}" for number, each in enumerate(scene.probes)) or "none"
    raise CaseError(
        f"{len(found)} probes of this run are {probe!r}; it has {names}",
        remedy="Name one by its number." if scene.probes else "Give the case a probe of body, place and quantity.",
        path="probes",
    )


def measure(history: Recorded, wanted: Probe | str | int) -> Measured:
    """Return the signal of a probe as its instrument gives it; see `AbstractHistory.measured`."""
    scene = history.scene
    probe = probe_of(scene, wanted)
    instrument = probe.instrument or Instrument()
    check_rates(scene, history.record_rate, probe)
    rate = instrument.rate or (
        history.record_rate if math.isfinite(history.record_rate) else scene.records / history.duration
    )
    times = np.arange(math.floor(history.duration * rate * (1.0 + ROUNDING)) + 1) / rate
    values = _filtered(history, probe, instrument, np.minimum(times, history.duration))
    if instrument.noise > 0.0:  # gauges of one seed each have noise of their own
        draw = np.random.default_rng([instrument.seed, zlib.crc32(probe.channel.encode())])
        values = values + instrument.noise * draw.standard_normal(values.size)
    if instrument.bits is None:
        return Measured(times, values, 0)
    steps, half = np.rint(values / instrument.resolution), 2.0 ** (instrument.bits - 1)
    kept = np.clip(steps, -half, half - 1.0)
    return Measured(times, instrument.resolution * kept, int(np.count_nonzero(kept != steps)))


def measured_signals(history: Measuring) -> dict[int, Measured]:
    """Return the measured signals that a history's records give, by number of the probe."""
    found = {}
    for number, probe in instrumented(history.scene):
        with suppress(CaseError):  # of a reference with other records
            found[number] = history.measured(probe)
    return found


def _filtered(history: Recorded, probe: Probe, instrument: Instrument, times: Array) -> Array:
    """Return the mean over the gauge after the low-pass filter, at times [s].

    Before and after the run the signal counts as its ends.
    """
    signal = _over_gauge(history, probe)
    if instrument.bandwidth is None:
        return signal(times)
    width = deviation(instrument.bandwidth)
    finest = 2.0 * width * history.record_rate if math.isfinite(history.record_rate) else 0.0
    points = min(max(MIN_POINTS, math.ceil(finest)), MAX_POINTS)
    offsets = np.arange(-int(REACH * points), int(REACH * points) + 1) / points
    weights = np.exp(-0.5 * offsets**2)
    total = np.zeros(times.size)
    for offset, weight in zip(offsets.tolist(), (weights / weights.sum()).tolist(), strict=True):
        total += weight * signal(np.clip(times + offset * width, 0.0, history.duration))
    return total


def _over_gauge(history: Recorded, probe: Probe) -> Callable[[Array], Array]:
    """Return the channel of a probe as a function of time.

    For a gauge with a length it is the mean strain over it. That is the difference of the displacements of its ends
    over its length, exact in any description of the bar.
    """
    if not probe.gauge_ends:
        return lambda times: np.asarray(history.evaluate(times, probe.channel), float)
    left, right = probe.gauge_ends
    length = right.x - left.x
    return lambda times: (history.evaluate(times, left.channel) - history.evaluate(times, right.channel)) / length


def deviation(frequency: float) -> float:
    """Return the standard deviation of a Gaussian low-pass filter [s].

    Its gain at a frequency [Hz] is 1/sqrt(2). The gain at f is exp(-(2 pi f deviation)^2/2).
    """
    return math.sqrt(math.log(2.0)) / (2.0 * math.pi * frequency)
