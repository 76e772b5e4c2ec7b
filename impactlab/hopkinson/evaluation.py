"""Stress, strain and rate of a specimen from the waves at its faces, by one, two and three waves, nominal and true.

    force at the front  F1 = E A (i + r)     velocity  v1 = c0 (i - r)
    force at the back   F2 = E A t           velocity  v2 = c0 t
    waves = 1           stress F2/As                   rate -2 c0 r/Ls
    waves = 2           stress F1/As                   rate 2 c0 (i - t)/Ls
    waves = 3           stress (F1 + F2)/(2 As)        rate (v1 - v2)/Ls

with the strains i of the incident, r of the reflected and t of the transmitted wave at the specimen, its section As and
length Ls. With equal forces on both faces, i + r = t, the three are one.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy import float64
from numpy.typing import ArrayLike, NDArray

from impactlab.errors import DoubtfulResult, ImpactlabError, UnusualValue
from impactlab.hopkinson.alignment import warn_if_apart
from impactlab.hopkinson.offsets import warn_of_offsets, zeroed
from impactlab.hopkinson.separation import GUARD, parted, same_length
from impactlab.hopkinson.windows import THRESHOLD, above, cut
from impactlab.measurement.dispersion import Bar, expect_bar, shift
from impactlab.measurement.inputs import above_zero, expect, finite, pair, warn, warn_samples, warn_size, warn_unusual
from impactlab.prefixes import prefixed, prefixed_range

Array = NDArray[float64]

HALF = 0.5  # of the largest transmitted strain: reached after its front, above noise and offsets
MIN_OPPOSITE = 0.02  # of the impulse of the incident wave: a transmitted one of the other sign is more than noise
SAME_SAMPLE = 1e-6  # of a sample: rounding of a time that falls on one
WIDER = 1e-6  # relative, of two diameters that are one

__all__ = ["Curve", "Specimen", "Test", "equilibrium", "evaluate", "measured"]


@dataclass(frozen=True, init=False, repr=False)
class Specimen:
    """A cylinder between two bars.

    Parameters
    ----------
    length : float or str
        Before the test [m], or a string with its unit such as ``"6 mm"``. An `UnusualValue` is issued above 0.5 m.
    diameter : float or str
        Before the test [m], likewise.

    Raises
    ------
    ImpactlabError
        If one of them is not above 0.
    """

    length: float
    diameter: float

    def __init__(self, length: float | str, diameter: float | str) -> None:
        for name, value in (("length", length), ("diameter", diameter)):
            object.__setattr__(self, name, above_zero(f"{name} of the specimen", value, "m"))
            warn_size(f"{name} of the specimen", getattr(self, name))

    def __repr__(self) -> str:
        return f"<Specimen, length {prefixed(self.length, 'm')}, diameter {prefixed(self.diameter, 'm')}>"

    @property
    def area(self) -> float:
        """Section [m2]."""
        return 0.25 * math.pi * self.diameter**2


@dataclass(frozen=True, repr=False)
class Test:
    """The waves at the faces of a specimen between two bars alike: strains, positive in compression.

    An `UnusualValue` is issued where a strain is above 2 %, or the time between samples above 10 us.

    Parameters
    ----------
    dt : float
        Time between samples [s].
    bar : Bar
    incident, reflected, transmitted : Array
        Shape (n,) each, at one time base.

    Raises
    ------
    ImpactlabError
        If they differ in length.
    """

    __test__ = False  # no class of tests for pytest

    dt: float
    bar: Bar
    incident: Array
    reflected: Array
    transmitted: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "dt", above_zero("dt", self.dt, "s"))
        expect_bar(self.bar)
        rows = same_length(incident=self.incident, reflected=self.reflected, transmitted=self.transmitted)
        for name, row in zip(("incident", "reflected", "transmitted"), rows, strict=True):
            object.__setattr__(self, name, row)
        warn_samples(self.dt, *rows)

    def __repr__(self) -> str:
        peaks = ", ".join(
            f"{name} {1e6 * row[np.argmax(np.abs(row))]:.4g}"
            for name, row in (
                ("incident", self.incident), ("reflected", self.reflected), ("transmitted", self.transmitted)
            )
        )  # fmt: skip
        count = len(self.incident)
        length = prefixed_range(0.0, self.dt * (count - 1), "s")
        return f"<Test of {count} samples, {length}, largest strains: {peaks} µm/m>"

    @property
    def time(self) -> Array:
        """Times of the samples [s], shape (n,)."""
        return np.asarray(self.dt * np.arange(len(self.incident)))

    @property
    def forces(self) -> tuple[Array, Array]:
        """Forces on the front and on the back of the specimen [N], shape (n,) each."""
        stiffness = self.bar.young * self.bar.area
        return stiffness * (self.incident + self.reflected), stiffness * self.transmitted


@dataclass(frozen=True, repr=False)
class Curve:
    """Stress, strain and rate of a specimen over time, positive in compression."""

    time: Array  # (n,) s
    strain: Array  # (n,)
    stress: Array  # (n,) Pa
    rate: Array  # (n,) 1/s

    def __repr__(self) -> str:
        if not len(self.time):
            return "<Curve without samples>"
        ranges = [(float(row.min()), float(row.max())) for row in (self.strain, self.stress, self.rate)]
        return (
            f"<Curve of {len(self.time)} samples, {prefixed_range(self.time[0], self.time[-1], 's')}: strain "
            f"{100.0 * ranges[0][0]:.3g} to {100.0 * ranges[0][1]:.4g} %, stress {prefixed_range(*ranges[1], 'Pa')}, "
            f"rate {ranges[2][0]:.4g} to {ranges[2][1]:.4g} 1/s>"
        )

    @cached_property
    def true(self) -> Curve:
        """The true ones of nominal ones e, s: -ln(1 - e) and s (1 - e), at constant volume.

        Raises
        ------
        ImpactlabError
            If a nominal strain reaches 1: nothing of the specimen would be left.
        """
        if np.any(self.strain >= 1.0):
            when = float(self.time[np.argmax(self.strain >= 1.0)])
            raise ImpactlabError(
                f"the nominal strain reaches 1 at {when:.6g} s: nothing of the specimen would be left",
                remedy="Cut the curve before it, and check the length of the specimen and the signals.",
            )
        left = 1.0 - self.strain
        return Curve(self.time, -np.log(left), self.stress * left, self.rate / left)

    def between(self, start: float, end: float) -> Curve:
        """Return the part from ``start`` to ``end`` [s], both included."""
        start, end = finite("start", start, "s"), finite("end", end, "s")
        part = (self.time >= start) & (self.time <= end)
        return Curve(self.time[part], self.strain[part], self.stress[part], self.rate[part])


def measured(
    incident_gauge: ArrayLike,
    transmission_gauge: ArrayLike,
    dt: float,
    bar: Bar,
    distances: tuple[float | str, float | str],
    threshold: float = THRESHOLD,
    far_ends: tuple[float | str, float | str] | None = None,
    zero: tuple[float, float] | None = None,
) -> Test:
    """Return the waves at the specimen from one gauge on each bar.

    They end before a wave that comes back from the far end of a bar reaches its gauge, 2 (distance to that end)/c0
    after the first wave has passed the specimen; from then on all three are zero, and the strain stays constant.
    Where the record ends before that, they have fewer samples than the record: those at whose instants all three are
    known, up to the time distance/c0 before its end, by the larger distance.

    Parameters
    ----------
    incident_gauge, transmission_gauge : array_like
        Strains, shape (n,) each, the first samples at one instant.
    dt : float
        Time between samples [s].
    bar : Bar
        Both bars; with dispersion their pulses are moved by it.
    distances : (float or str, float or str)
        From each gauge to the specimen [m], or strings with their units.
    threshold : float
        As of `one_gauge`.
    far_ends : (float or str, float or str), optional
        From each gauge to the other end of its bar [m]: the struck end, and the end of the transmission bar. By
        default both as far as the gauge on the incident bar is from the specimen: right for gauges in the middle.
    zero : (float, float), optional
        Start and end [s] of an interval before the first pulse. The mean of each signal there is subtracted from it.

    Raises
    ------
    ImpactlabError
        If the signals differ in length, the pulses on the incident bar overlap, the record ends before the reflected
        or the transmitted one, or the interval for zero holds no sample or the front of a pulse.

    Warns
    -----
    DoubtfulResult
        If a wave at the specimen has not ended when the waves are cut, or where the record ends.
    UnusualValue
        If a strain is above 2 %, ``dt`` above 10 us, or a signal differs from zero before the first pulse, without
        ``zero``, by more than noise and 0.2 % of its largest value. If the transmitted wave reaches its gauge before
        the incident one can, or has the other sign.

    References
    ----------
    Kolsky1949; Gray2000.
    """
    front, back = same_length(incident_gauge=incident_gauge, transmission_gauge=transmission_gauge)
    dt = above_zero("dt", dt, "s")
    expect_bar(bar)
    ways = [above_zero("a distance to the specimen", each, "m") for each in pair("distances", distances)]
    far = [ways[0]] * 2
    if far_ends is not None:
        far = [above_zero("a distance to a far end", each, "m") for each in pair("far_ends", far_ends)]
    if zero is not None:
        front, back = zeroed(dt, zero, incident=front, transmission=back)
    warn_samples(dt, front, back)
    started = int(above(front, threshold)[0])
    if zero is None:
        warn_of_offsets(dt, started, incident=front, transmission=back)
    start = started * dt
    end = start + (ways[0] + 2.0 * (1.0 - GUARD) * min(far)) / bar.wave_speed  # at the specimen
    waves = parted(front, dt, bar, ways[0], threshold, end + ways[0] / bar.wave_speed)
    transmitted = shift(cut(back, dt, 0.0, end + ways[1] / bar.wave_speed), dt, -ways[1], bar)
    rows = [cut(each, dt, 0.0, end) for each in (waves.to_right, waves.to_left, transmitted)]
    reach = dt * (len(front) - 1) - max(ways) / bar.wave_speed  # at the specimen
    if reach <= start + ways[0] / bar.wave_speed:
        raise ImpactlabError(
            f"the record ends at {dt * (len(front) - 1):.6g} s, before the transmitted wave that reaches its gauge at "
            f"{start + sum(ways) / bar.wave_speed:.6g} s",
            remedy="Record for longer, or check the distances of the gauges from the specimen.",
        )
    count = len(front) if reach >= end else math.floor(reach / dt + SAME_SAMPLE) + 1
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusualValue)  # of the signals it is issued already
        test = Test(dt, bar, *(each[:count] for each in rows))
    _warn_if_early(back, dt, start + sum(ways) / bar.wave_speed, GUARD * sum(ways) / bar.wave_speed)
    _warn_if_opposite(test)
    before = GUARD * min(far) / bar.wave_speed
    if reach >= end:
        _warn_if_loud(test, end, before, threshold)
    else:
        _warn_of_short_record(test, reach, end, before, threshold, rows[0])
    return test


def _warn_if_early(back: Array, dt: float, expected: float, guard: float) -> None:
    """Issue an `UnusualValue` of a transmission gauge, shape (n,), that moves before a wave can reach it [s]."""
    if not back.any():
        return
    begins = float(above(back, HALF)[0]) * dt
    if begins < expected - guard:
        warn_unusual(
            f"the transmission gauge has half of its largest strain at {begins:.6g} s, and the wave from the incident "
            f"gauge reaches it at {expected:.6g} s at the earliest: check that both records begin at one instant, the "
            "order of the gauges, and their distances from the specimen."
        )


def _warn_if_opposite(test: Test) -> None:
    """Issue an `UnusualValue` of a transmitted wave whose sign is not that of the incident one."""
    incident, transmitted = float(test.incident.sum()), float(test.transmitted.sum())
    if transmitted * incident < 0.0 and abs(transmitted) > MIN_OPPOSITE * abs(incident):
        warn_unusual(
            "the transmitted wave has the other sign than the incident one, and a specimen passes a force on with its "
            "sign: give both signals with compression positive."
        )


def _loud(test: Test, end: float, before: float, threshold: float) -> list[str]:
    """Return in words which waves, as the mean of the time just before an end [s], have not ended there."""
    window = slice(max(0, round((end - before) / test.dt) - 1), round(end / test.dt))
    found = []
    for name, wave in (("reflected", test.reflected), ("transmitted", test.transmitted)):
        share = abs(float(wave[window].mean())) / float(np.abs(wave).max() or 1.0)
        if share > threshold:
            found.append(f"the {name} one still has {100.0 * share:.3g} % of its largest strain")
    return found


def _warn_if_loud(test: Test, end: float, before: float, threshold: float) -> None:
    """Issue a `DoubtfulResult` if a wave has not ended where the waves are cut, at ``end`` [s]."""
    found = _loud(test, end, before, threshold)
    if found:
        warn(
            f"the waves at the specimen are cut at {end:.6g} s, before one from the far end of a bar reaches a gauge, "
            f"and {' and '.join(found)}: the curve is right up to there. Give far_ends, the distances from the gauges "
            "to the far ends of their bars, if they are longer.",
            DoubtfulResult,
        )


def _warn_of_short_record(
    test: Test, reach: float, end: float, before: float, threshold: float, incident: Array
) -> None:
    """Issue a `DoubtfulResult` if a wave has not ended at the specimen at ``reach`` [s], where the record ends.

    The incident wave, shape (n,), is known beyond: the gauge on its bar has seen it before.
    """
    found = _loud(test, reach, before, threshold)
    to_come = abs(float(incident[len(test.incident) :].sum())) / float(np.abs(incident).sum() or 1.0)
    if to_come > threshold:
        found.append(f"{100.0 * to_come:.3g} % of the incident one is still to come")
    if found:
        warn(
            f"the record ends before the waves have passed the gauges: the waves at the specimen, and the curve, end "
            f"at {reach:.6g} s. There {', and '.join(found)}. Record {end - reach:.3g} s longer "
            f"to have them up to {end:.6g} s, when one from the far end of a bar comes in.",
            DoubtfulResult,
        )


def evaluate(test: Test, specimen: Specimen, waves: Literal[1, 2, 3] = 3) -> Curve:
    """Return the nominal stress, strain and rate of a specimen; ``.true`` gives the true ones.

    Parameters
    ----------
    test : Test
    specimen : Specimen
    waves : 1, 2 or 3
        1: stress from the transmitted wave, rate from the reflected one. 2: stress from incident and reflected, rate
        from incident and transmitted. 3: the mean of both forces, the difference of both velocities.

    Raises
    ------
    ImpactlabError
        If ``waves`` is none of them.

    Warns
    -----
    UnusualValue
        If the specimen is wider than the bar, or the forces on its two faces differ at the first rise by more than its
        momentum: records that do not begin at one instant, or wrong distances of the gauges.

    References
    ----------
    Gray2000.
    """
    _expect_test(test)
    expect(specimen, Specimen, "Give hopkinson.Specimen(length=..., diameter=...).")
    if not isinstance(waves, int) or waves not in (1, 2, 3):
        raise ImpactlabError(f"no evaluation by {waves!r} waves", remedy="Give 1, 2 or 3.")
    if specimen.diameter > test.bar.diameter * (1.0 + WIDER):
        warn_unusual(
            f"the specimen is wider than the bar, {prefixed(specimen.diameter, 'm')} and "
            f"{prefixed(test.bar.diameter, 'm')}: its edge touches no bar. Check the units of both diameters."
        )
    warn_if_apart(test.dt, test.bar, test.incident, test.forces, specimen.area * specimen.length)
    front, back = test.forces
    incident, reflected, transmitted = test.incident, test.reflected, test.transmitted
    speed = test.bar.wave_speed / specimen.length
    if waves == 1:
        force, rate = back, -2.0 * speed * reflected
    elif waves == 2:
        force, rate = front, 2.0 * speed * (incident - transmitted)
    else:
        force, rate = 0.5 * (front + back), speed * (incident - reflected - transmitted)
    strain = np.concatenate([[0.0], np.cumsum(0.5 * test.dt * (rate[1:] + rate[:-1]))])
    return Curve(test.time, strain, force / specimen.area, rate)


def _expect_test(given: object) -> None:
    """Raise `ImpactlabError` where a function was given something else than the waves of a test."""
    expect(given, Test, "Give the result of hopkinson.measured, of_history, or Test(dt, bar, ...).")


def equilibrium(test: Test, floor: float = THRESHOLD) -> Array:
    """Return the equilibrium ratio 2 (F1 - F2)/(F1 + F2) of the forces on both faces, shape (n,).

    0 is equilibrium, 2 a specimen that passes nothing on; NaN where the mean force is below ``floor`` of its largest.
    """
    _expect_test(test)
    floor = finite("floor", floor, "1")
    front, back = test.forces
    mean = 0.5 * (front + back)
    loaded = np.abs(mean) > floor * np.abs(mean).max()
    return np.divide(front - back, mean, out=np.full_like(mean, np.nan), where=loaded)
