"""Offsets of gauges: means before the first pulse, subtracted or named in a warning."""

from __future__ import annotations

import math

import numpy as np

from impactlab.errors import ImpactlabError
from impactlab.measurement.inputs import finite, pair, warn_unusual
from impactlab.types import Array

MAX_QUIET = 0.1  # of its range: that of the first signal, by noise, in an interval before the first pulse
MIN_OFFSET = 2e-3  # of the largest strain: of a smaller offset the strain of a specimen changes by some 1 %
MIN_BEFORE = 10  # samples before the first pulse, to tell an offset from noise
MAX_DRIFT = 0.02  # of the largest strain, over a record: by an offset between two gauges on one bar


def zeroed(dt: float, interval: tuple[float, float], **signals: Array) -> list[Array]:
    """Return gauge signals (n,) less their means in an interval [s].

    ``signals`` are by name, and the interval lies before the first pulse.

    Raises
    ------
    ImpactlabError
        If the interval holds no sample, or the first signal moves in it.
    """
    start, end = (
        finite("a limit of the interval for zero", each, "s") for each in pair("zero", interval, "(0, 50e-6)")
    )
    name, front = next(iter(signals.items()))
    time = dt * np.arange(len(front))
    inside = (time >= start) & (time <= end)
    if not inside.any():
        raise ImpactlabError(
            f"the interval for zero, {start:.6g} to {end:.6g} s, holds no sample of the record, 0 to {time[-1]:.6g} s",
            remedy="Give its start and its end in seconds from the first sample.",
        )
    moved, size = float(np.ptp(front[inside])), float(np.ptp(front))
    if moved > MAX_QUIET * size:
        raise ImpactlabError(
            f"the {name} gauge moves by {1e6 * moved:.4g} um/m inside the interval for zero, {start:.6g} to "
            f"{end:.6g} s, and by {1e6 * size:.4g} um/m in the whole record",
            remedy="End the interval before the first pulse.",
        )
    return [np.asarray(row - row[inside].mean()) for row in signals.values()]


def warn_of_offsets(dt: float, started: int, **signals: Array) -> None:
    """Issue an `UnusualValue` of a signal with an offset before the first pulse.

    Its mean there differs from zero by more than noise. ``started`` is the sample at which the first pulse begins.
    """
    count = started // 2
    if count < MIN_BEFORE:
        return
    for name, signal in signals.items():
        quiet, size = signal[:count], float(np.abs(signal).max())
        mean = float(quiet.mean())
        if abs(mean) > max(MIN_OFFSET * size, 5.0 * float(quiet.std()) / math.sqrt(count)):
            warn_unusual(
                f"the {name} gauge has a mean of {1e6 * mean:.3g} um/m before the first pulse, "
                f"{100.0 * abs(mean) / size:.2g} % of its largest strain. If that is an offset, give "
                f"zero=(0, {dt * count:.3g}): strains of the specimen are integrals of it."
            )


def warn_of_drift(one: Array, two: Array, dt: float, started: int, between: float) -> None:
    """Issue an `UnusualValue` where an offset between two gauges grows in their waves.

    Both gauges are on one bar. In every 2 T the wave to the right grows by the difference of the offsets, with T =
    ``between`` [s] the time of a wave from gauge to gauge. ``started`` is the sample at which the first pulse begins:
    at 0 the bar is not at rest.
    """
    if started == 0:
        warn_unusual(
            "the record begins within a pulse, and the separation of waves needs a bar at rest at "
            "the first sample: begin the record before the first pulse."
        )
    count = started // 2
    if count < MIN_BEFORE:
        return
    apart = one[:count] - two[:count]
    mean, size = float(apart.mean()), float(max(np.abs(one).max(), np.abs(two).max()))
    drift = abs(mean) * len(one) * dt / (2.0 * between)
    if drift > MAX_DRIFT * size and abs(mean) > 5.0 * float(apart.std()) / math.sqrt(count):
        warn_unusual(
            f"the gauges differ by {1e6 * mean:.3g} um/m before the first pulse: by that offset the waves drift by "
            f"{1e6 * drift:.3g} um/m to the end of the record. Give zero=(0, {dt * count:.3g})."
        )
