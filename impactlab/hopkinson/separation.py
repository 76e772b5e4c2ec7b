"""Wave separation in a bar by one gauge, two gauges, or force and velocity."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impactlab.errors import DoubtfulResult, ImpactlabError
from impactlab.hopkinson.offsets import warn_of_drift, zeroed
from impactlab.hopkinson.windows import THRESHOLD, cut, samples_above
from impactlab.measurement.dispersion import Bar, band_limit, checked_signal, expect_bar, padded, shift, wave_number
from impactlab.measurement.inputs import above_zero, finite, pair, warn, warn_samples
from impactlab.types import Array

DECAY = 11.5
"""Exponent of the decay over a record that divides two gauges: a padded record repeats less than e^-23 = 1e-10."""
GUARD = 0.02
"""Share of the time from gauge to end and back: a reflection may seem early by so much, and is quiet before as long."""
SLOPE_STEP = 1e-4  # relative to the band, of the differences of the wave number: exact to 1e-8 of its curvature

__all__ = ["TwoWaves", "force_and_velocity", "one_gauge", "two_gauges"]


class TwoWaves(NamedTuple):
    """Strains of the two waves at one place, positive in compression.

    x runs to the right.
    """

    to_right: Array  # (n,)
    to_left: Array  # (n,)

    def __repr__(self) -> str:
        peaks = [1e6 * float(np.abs(wave).max()) for wave in self]
        return (
            f"<TwoWaves of {len(self.to_right)} samples, largest strains {peaks[0]:.4g} µm/m to the right, "
            f"{peaks[1]:.4g} µm/m to the left>"
        )

    def force(self, bar: Bar) -> Array:
        """Return the force through the section [N], shape (n,)."""
        return np.asarray(bar.young * bar.area * (self.to_right + self.to_left))

    def velocity(self, bar: Bar) -> Array:
        """Return the velocity of the section [m/s], to the right, shape (n,)."""
        return np.asarray(bar.wave_speed * (self.to_right - self.to_left))


def one_gauge(
    strain: ArrayLike,
    dt: float,
    bar: Bar,
    distance: float | str,
    threshold: float = THRESHOLD,
    end: float | None = None,
) -> TwoWaves:
    """Return the waves at the right end of a bar from one gauge.

    The pulses pass the gauge one after the other. The first pulse is the wave to the right. No reflection from the end
    reaches the gauge before 2 distance/c0 after its start; the record is divided halfway between the end of the first
    pulse and that time. The wave to the left is known up to distance/c0 before the end of the record, and zero from
    there on.

    Parameters
    ----------
    strain : array_like
        Shape (n,), the first sample at t = 0.
    dt : float
        Time between samples [s].
    bar : Bar
    distance : float or str
        From the gauge to the end [m], or a string with its unit.
    threshold : float
        Share of the largest value below which the gauge is quiet.
    end : float, optional
        Time [s] from which on the record is left out; by default a second 2 distance/c0 later. Until then no reflection
        of the other end reaches a gauge in the middle of the bar.

    Raises
    ------
    ImpactlabError
        If the pulses overlap, or the record ends before the second one.

    Warns
    -----
    DoubtfulResult
        If the record ends inside the second pulse.

    References
    ----------
    Kolsky1949; Gray2000.
    """
    values, dt = checked_signal("the strain", strain), above_zero("dt", dt, "s")
    warn_samples(dt, values)
    expect_bar(bar)
    way, end = above_zero("the distance", distance, "m"), None if end is None else finite("end", end, "s")
    waves = parted(values, dt, bar, way, threshold, end)
    _warn_of_short_record(values, dt, way / bar.wave_speed, threshold, end)
    return waves


def _warn_of_short_record(values: Array, dt: float, lag: float, threshold: float, end: float | None) -> None:
    """Issue a `DoubtfulResult` if a signal has not ended where its record does.

    The mean of its last samples is compared with its largest value. ``lag`` is the time from the gauge to the end of
    the bar [s].
    """
    ends = (len(values) - 1) * dt
    wanted = float(samples_above(values, threshold)[0]) * dt + 4.0 * lag if end is None else end
    if ends >= wanted - dt:
        return
    share = abs(float(values[-max(1, round(2.0 * GUARD * lag / dt)) :].mean())) / float(np.abs(values).max())
    if share > threshold:
        warn(
            f"the record ends at {ends:.6g} s, within the reflected pulse, at {100.0 * share:.3g} % "
            f"of its largest strain: the wave to the left is valid up to {ends - lag:.6g} s, and zero "
            f"after that. Record {wanted - ends:.3g} s longer, or cut the waves off there.",
            DoubtfulResult,
        )


def parted(values: Array, dt: float, bar: Bar, way: float, threshold: float, end: float | None) -> TwoWaves:
    """Return the waves as `one_gauge` does, from a checked signal and a distance in metres."""
    loud = samples_above(values, threshold)
    start = float(loud[0]) * dt
    trip = 2.0 * way / bar.wave_speed
    back = start + trip
    if back >= (len(values) - 1) * dt:
        raise ImpactlabError(
            f"the record ends at {(len(values) - 1) * dt:.6g} s, before the reflection that begins at {back:.6g} s",
            remedy="Record for longer, or check the distance of the gauge from the end, the wave speed, and whether "
            "the signal is that of this gauge.",
        )
    guard = GUARD * trip
    passed = float(loud[loud * dt < back - guard][-1]) * dt
    if passed > back - 2.0 * guard:
        raise ImpactlabError(
            f"the pulses overlap from {back:.6g} s on: the first one began at {start:.6g} s and has not ended when its "
            f"reflection comes back over {way:.6g} m",
            remedy="Use a shorter striker, a gauge further from the end, or two gauges (hopkinson.two_gauges). If the "
            f"start is noise, give a threshold above {threshold:g} of the largest value.",
        )
    middle = 0.5 * (passed + back - guard)
    forward = shift(cut(values, dt, 0.0, middle), dt, way, bar)
    backward = shift(cut(values, dt, middle, back + trip if end is None else end), dt, -way, bar)
    return TwoWaves(forward, backward)


def two_gauges(
    first: ArrayLike,
    second: ArrayLike,
    dt: float,
    bar: Bar,
    places: tuple[float | str, float | str],
    at: float | str,
    zero: tuple[float, float] | None = None,
) -> TwoWaves:
    """Return the waves at a place from two gauges, however long the pulses are.

    The wave R to the right at the first gauge obeys R(t) = e1(t) - e2(t - T) + R(t - 2 T) without dispersion, T the
    time between the gauges. With it, the same is divided in the frequency domain, of signals weighted by exp(-s t):
    there nothing is divided by zero, and the result stays causal. The bar is at rest at t = 0. Smooth signals come
    back to 1e-6 of their largest value, with dispersion to 1e-4.

    Parameters
    ----------
    first, second : array_like
        Strains, shape (n,) each.
    dt : float
        Time between samples [s].
    bar : Bar
    places : (float or str, float or str)
        x of the two gauges [m], or strings with their units.
    at : float or str
        x of the place [m]. Outside the two gauges the record loses the waves that pass there before its start or after
        its end.
    zero : (float, float), optional
        Start and end, in seconds from the first sample, of an interval before the first pulse. The mean of each signal
        there is subtracted from it: the difference of their offsets is added to the waves every 2 T again.

    Raises
    ------
    ImpactlabError
        If both gauges are at one place, the signals differ in length, or the interval for zero holds no sample or the
        front of a pulse.

    Warns
    -----
    UnusualValue
        If a pulse is in the gauges at the first sample, or, without ``zero``, an offset between them grows above noise
        and 2 % of the largest strain.

    References
    ----------
    LundbergHenchoz1977; Bacon1998.
    """
    one, two = same_length(first_gauge=first, second_gauge=second)
    dt = above_zero("dt", dt, "s")
    expect_bar(bar)
    near, far = (finite("a place of the gauges", place, "m") for place in pair("places", places))
    x = finite("the place", at, "m")
    if far == near:
        raise ImpactlabError(
            f"both gauges are at {near:.6g} m", remedy="Two waves need gauges at two places of the bar."
        )
    if far < near:
        one, two, near, far = two, one, far, near
    warn_samples(dt, one, two)
    apart = far - near
    if zero is not None:
        one, two = zeroed(dt, zero, first=one, second=two)
    elif one.any() or two.any():
        started = int(samples_above(np.maximum(np.abs(one), np.abs(two)), THRESHOLD)[0])
        warn_of_drift(one, two, dt, started, apart / bar.wave_speed)
    n = len(one)
    count = padded(n, dt, max(apart, abs(x - near)), bar)
    rate = DECAY / (n * dt)
    weight = np.exp(-rate * dt * np.arange(n))
    number = _damped_number(bar, np.asarray(np.fft.rfftfreq(count, dt)), rate)
    e1, e2 = (np.fft.rfft(weight * each, count) for each in (one, two))
    step = np.exp(-1j * number * apart)
    right = (e1 - step * e2) / (1.0 - step**2)

    def moved(wave: NDArray[np.complex128], distance: float) -> Array:
        there = np.fft.irfft(wave * np.exp(-1j * number * distance), count)[:n] / weight
        return shift(there, dt, 0.0, bar)

    return TwoWaves(moved(right, x - near), moved(e1 - right, near - x))


def force_and_velocity(force: ArrayLike, velocity: ArrayLike, bar: Bar) -> TwoWaves:
    """Return the waves at a place from force [N] and velocity [m/s] there.

    All are of shape (n,).
    """
    expect_bar(bar)
    forces, velocities = same_length(force=force, velocity=velocity)
    strain, speed = forces / (bar.young * bar.area), velocities / bar.wave_speed
    return TwoWaves(0.5 * (strain + speed), 0.5 * (strain - speed))


def same_length(**signals: ArrayLike) -> list[Array]:
    """Return signals as arrays of one length.

    Raises
    ------
    ImpactlabError
        If they differ in length.
    """
    rows = [checked_signal(f"the {name.replace('_', ' ')}", signal) for name, signal in signals.items()]
    if len({len(row) for row in rows}) > 1:
        lengths = ", ".join(f"{name.replace('_', ' ')} {len(row)}" for name, row in zip(signals, rows, strict=True))
        raise ImpactlabError(
            f"the signals have different lengths: {lengths} samples",
            remedy="Of one recorder, cut them to one length; all begin at one instant. Sampled at different intervals, "
            "interpolate them to common instants first, by np.interp.",
        )
    return rows


def _damped_number(bar: Bar, frequency: Array, rate: float) -> NDArray[np.complex128]:
    """Return the wave number at complex frequencies w - i rate [rad/m].

    It is of second order in the rate. Above the band it goes on along its tangent: a front there would ring if the
    spectrum was cut before the division.
    """
    if bar.dispersion == "none":
        return np.asarray((2.0 * np.pi * frequency - 1j * rate) / bar.wave_speed)
    limit = band_limit(bar)
    step = SLOPE_STEP * limit
    inner = np.clip(frequency, step, limit - step)
    beyond = 2.0 * np.pi * (frequency - inner)
    below, here, above = (wave_number(bar, inner + offset) for offset in (-step, 0.0, step))
    width = 2.0 * np.pi * step
    slope, curvature = (above - below) / (2.0 * width), (above - 2.0 * here + below) / width**2
    curvature = np.where(beyond == 0.0, curvature, 0.0)
    return np.asarray(here + slope * (beyond - 1j * rate) - 0.5 * rate**2 * curvature)
