"""Waves at the faces of a specimen from one gauge on each bar, with warnings of doubtful signals."""

from __future__ import annotations

import math
import warnings

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import DoubtfulResult, ImpactlabError, UnusualValue
from impactlab.hopkinson.evaluation import Test
from impactlab.hopkinson.offsets import warn_of_offsets, zeroed
from impactlab.hopkinson.separation import GUARD, parted, same_length
from impactlab.hopkinson.windows import THRESHOLD, cut, samples_above
from impactlab.measurement.dispersion import Bar, expect_bar, shift
from impactlab.measurement.inputs import above_zero, pair, warn, warn_distance, warn_samples, warn_unusual
from impactlab.types import Array

HALF = 0.5  # of the largest transmitted strain: reached after its front, above noise and offsets
MIN_OPPOSITE = 0.02  # of the impulse of the incident wave: a transmitted one of the other sign is more than noise
SAME_SAMPLE = 1e-6  # of a sample: rounding of a time that falls on one


def measured(
    incident_gauge: ArrayLike,
    transmission_gauge: ArrayLike,
    dt: float,
    bar: Bar,
    distances: tuple[float | str, float | str],
    threshold: float = THRESHOLD,
    far_ends: tuple[float | str, float | str] | None = None,
    zero: tuple[float, float] | None = None,
    transmission_bar: Bar | None = None,
) -> Test:
    """Return the waves at the specimen from one gauge on each bar.

    They end before a wave that comes back from the far end of a bar reaches its gauge, 2 (distance to that end)/c
    after the first wave has passed the specimen; from then on all three are zero, and the strain stays constant.
    Where the record ends before that, they have fewer samples than the record: those at whose instants all three are
    known, up to the time distance/c before its end, the longer one of both gauges.

    Parameters
    ----------
    incident_gauge, transmission_gauge : array_like
        Strains, shape (n,) each, the first samples at one instant; or two signals that have these as ``values``.
    dt : float
        Time between samples [s].
    bar : Bar
        Both bars, or the incident one; with dispersion their pulses are moved by it.
    distances : (float or str, float or str)
        From each gauge to the specimen [m], or strings with their units.
    threshold : float
        As of `one_gauge`.
    far_ends : (float or str, float or str), optional
        From each gauge to the other end of its bar [m]: the struck end, and the end of the transmission bar. By
        default both as far as the gauge on the incident bar is from the specimen: right for gauges in the middle.
    zero : (float, float), optional
        Start and end, in seconds from the first sample, of an interval before the first pulse. The mean of each signal
        there is subtracted from it.
    transmission_bar : Bar, optional
        The transmission bar, if it is another one, as a thinner or softer bar under a soft specimen.

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
        If a strain is above 2 %, ``dt`` above 10 us, a distance above 100 m, or a signal differs from zero before the
        first pulse, without ``zero``, by more than noise and 0.2 % of its largest value. If the transmitted wave
        reaches its gauge before the incident one can, or has the other sign.

    References
    ----------
    Kolsky1949; Gray2000.
    """
    front, back = same_length(incident_gauge=incident_gauge, transmission_gauge=transmission_gauge)
    dt = above_zero("dt", dt, "s")
    bars = bar, bar if transmission_bar is None else transmission_bar
    for each in bars:
        expect_bar(each)
    ways = [above_zero("a distance to the specimen", each, "m") for each in pair("distances", distances)]
    for way in ways:
        warn_distance("the distance of a gauge from the specimen", way)
    far = [ways[0]] * 2
    if far_ends is not None:
        far = [above_zero("a distance to a far end", each, "m") for each in pair("far_ends", far_ends)]
    if zero is not None:
        front, back = zeroed(dt, zero, incident=front, transmission=back)
    warn_samples(dt, front, back)
    started = int(samples_above(front, threshold)[0])
    if zero is None:
        warn_of_offsets(dt, started, incident=front, transmission=back)
    start = started * dt
    near = [way / each.wave_speed for way, each in zip(ways, bars, strict=True)]  # s, from each gauge to the specimen
    beyond = min(way / each.wave_speed for way, each in zip(far, bars, strict=True))
    end = start + near[0] + 2.0 * (1.0 - GUARD) * beyond  # at the specimen
    waves = parted(front, dt, bar, ways[0], threshold, end + near[0])
    beyond_specimen = shift(cut(back, dt, 0.0, end + near[1]), dt, -ways[1], bars[1])
    rows = [cut(each, dt, 0.0, end) for each in (waves.to_right, waves.to_left, beyond_specimen)]
    reach = dt * (len(front) - 1) - max(near)  # at the specimen
    if reach <= start + near[0]:
        raise ImpactlabError(
            f"the record ends at {dt * (len(front) - 1):.6g} s, before the transmitted wave that reaches its gauge at "
            f"{start + sum(near):.6g} s",
            remedy="Record for longer, or check the distances of the gauges from the specimen.",
        )
    count = len(front) if reach >= end else math.floor(reach / dt + SAME_SAMPLE) + 1
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusualValue)  # of the signals it is issued already
        incident, reflected, transmitted = (each[:count] for each in rows)
        test = Test(dt, bar, incident, reflected, transmitted, transmission_bar)
    _warn_if_early(back, dt, start + sum(near), GUARD * sum(near))
    _warn_if_opposite(test)
    before = GUARD * beyond
    if reach >= end:
        _warn_if_loud(test, end, before, threshold)
    else:
        _warn_of_short_record(test, reach, end, before, threshold, rows[0])
    return test


def _warn_if_early(back: Array, dt: float, expected: float, guard: float) -> None:
    """Issue an `UnusualValue` if a transmission gauge moves before a wave arrives.

    ``back`` is its signal, shape (n,), ``expected`` the arrival [s].
    """
    if not back.any():
        return
    begins = float(samples_above(back, HALF)[0]) * dt
    if begins < expected - guard:
        warn_unusual(
            f"the transmission gauge has half of its largest strain at {begins:.6g} s, and the wave from the incident "
            f"gauge reaches it at {expected:.6g} s at the earliest: check that both records begin at one instant, the "
            "order of the gauges, and their distances from the specimen."
        )


def _warn_if_opposite(test: Test) -> None:
    """Issue an `UnusualValue` if transmitted and incident wave have opposite signs."""
    incident, transmitted = float(test.incident.sum()), float(test.transmitted.sum())
    if transmitted * incident < 0.0 and abs(transmitted) > MIN_OPPOSITE * abs(incident):
        warn_unusual(
            "the transmitted wave and the incident wave have opposite signs, and a specimen "
            "transmits a force with its sign: give both signals with compression positive."
        )


def _loud(test: Test, end: float, before: float, threshold: float) -> list[str]:
    """Return in words the waves that have not ended at ``end`` [s].

    The mean of each over the time just before it is compared with its largest strain.
    """
    window = slice(max(0, round((end - before) / test.dt) - 1), round(end / test.dt))
    found = []
    for name, wave in (("reflected", test.reflected), ("transmitted", test.transmitted)):
        share = abs(float(wave[window].mean())) / float(np.abs(wave).max() or 1.0)
        if share > threshold:
            found.append(f"the {name} wave still has {100.0 * share:.3g} % of its largest strain")
    return found


def _warn_if_loud(test: Test, end: float, before: float, threshold: float) -> None:
    """Issue a `DoubtfulResult` if a wave has not ended at the cut at ``end`` [s]."""
    found = _loud(test, end, before, threshold)
    if found:
        warn(
            f"the waves at the specimen are cut off at {end:.6g} s, before a wave from the far end of "
            f"a bar reaches a gauge, and {' and '.join(found)}: the curve is valid up to that time. "
            "Give far_ends, the distances from the gauges to the far ends of their bars, if they are "
            "longer.",
            DoubtfulResult,
        )


def _warn_of_short_record(
    test: Test, reach: float, end: float, before: float, threshold: float, incident: Array
) -> None:
    """Issue a `DoubtfulResult` if a wave has not ended with the record.

    At the specimen the record ends at ``reach`` [s]. The incident wave, shape (n,), is known beyond: the gauge on its
    bar has seen it before.
    """
    found = _loud(test, reach, before, threshold)
    to_come = abs(float(incident[len(test.incident) :].sum())) / float(np.abs(incident).sum() or 1.0)
    if to_come > threshold:
        found.append(f"{100.0 * to_come:.3g} % of the incident wave is still to come")
    if found:
        warn(
            "the record ends before the waves have passed the gauges: the waves at the specimen, and "
            f"the curve, end at {reach:.6g} s. At that time {', and '.join(found)}. Record "
            f"{end - reach:.3g} s longer to have them up to {end:.6g} s, when a wave from the far end "
            "of a bar arrives.",
            DoubtfulResult,
        )
