"""Evaluation of Hopkinson bars on the history of a run, whose probes of strain are the gauges."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from impactlab.errors import ImpactlabError, UnusualValue
from impactlab.history.base import AbstractHistory
from impactlab.hopkinson.evaluation import Test
from impactlab.hopkinson.gauges import measured
from impactlab.hopkinson.windows import THRESHOLD, samples_above
from impactlab.measurement.dispersion import Bar, Theory
from impactlab.measurement.inputs import above_zero, expect, warn
from impactlab.scene.problem import Probe
from impactlab.types import Array

OVERSAMPLING = 32  # times the rate of a gauge: fronts are placed to 1/64 of a sample
WIDTH = 4.0  # standard deviations of the smoothing on each side: beyond are 6e-5 of it
MAX_SMOOTH = 100.0  # samples
RUN_FIRST = "Give the history of a run: il.run(case)."
BAR_TOL = 1e-9  # relative, of wave speeds, densities and sections of two bars


def bar_of(history: AbstractHistory, name: str, poisson: float = 0.3, dispersion: Theory = "none") -> Bar:
    """Return a rod of a history as a bar of circular section.

    A run is without dispersion unless a model brings it: ``love`` belongs to the model ``love_rod``.

    Raises
    ------
    ImpactlabError
        If the body is not a rod, or has more than one segment.
    """
    expect(history, AbstractHistory, RUN_FIRST)
    bodies = history.scene.bodies
    waves = bodies[name].waves if isinstance(name, str) and name in bodies else None
    if waves is None or "strain" not in bodies[name].quantities or len(waves.segments) != 1:
        rods = [each for each, body in bodies.items() if body.waves is not None and "strain" in body.quantities]
        there = name in bodies if isinstance(name, str) else True
        raise ImpactlabError(
            f"'{name}' is not a rod with one segment" if there else f"there is no body '{name}' in this run",
            remedy=f"Name one of the rods: {', '.join(rods) or 'there are none'}.",
        )
    segment = waves.segments[0]
    diameter = math.sqrt(4.0 * segment.area / math.pi)
    return Bar(diameter, segment.wave_speed, segment.density, poisson, dispersion)


def sampled(history: AbstractHistory, channel: str, rate: float | str) -> tuple[float, Array]:
    """Return the time between samples [s] and a channel sampled, (n,).

    ``rate`` is in Hz, or a string with a unit; the first sample is at t = 0.
    """
    expect(history, AbstractHistory, RUN_FIRST)
    rate = above_zero("the rate", rate, "Hz")
    dt = 1.0 / rate
    count = math.floor(history.duration * rate * (1.0 + 1e-12)) + 1
    return dt, history.evaluate(dt * np.arange(count), channel)


def amplified(history: AbstractHistory, channel: str, rate: float, smooth: float) -> tuple[float, Array]:
    """Return the time between samples [s] and a channel after an amplifier, (n,).

    A front of a run is a jump. Sampled as it is, it is moved along a bar with an error of up to a sample, and sums of
    two waves have spikes there. Of a Gaussian with a standard deviation of ``smooth`` = 1 sample less than 1 % lies
    above half of the rate.
    """
    dt, raw = sampled(history, channel, rate)
    if smooth == 0.0:
        return dt, raw
    if not 0.0 < smooth <= MAX_SMOOTH:
        text = f"smooth is {smooth:.6g} samples. Allowed: 0 to {MAX_SMOOTH:g}"
        raise ImpactlabError(text, remedy="Give 1 where the signal has fronts.")
    side = math.ceil(WIDTH * smooth * OVERSAMPLING)
    fine = dt / OVERSAMPLING * np.arange(-side, (len(raw) - 1) * OVERSAMPLING + side + 1)
    values = history.evaluate(np.clip(fine, 0.0, history.duration), channel)
    weight = np.exp(-0.5 * (np.arange(-side, side + 1) / (smooth * OVERSAMPLING)) ** 2)
    return dt, np.convolve(values, weight / weight.sum(), "valid")[::OVERSAMPLING]


def of_history(
    history: AbstractHistory,
    incident: str = "incident",
    transmission: str = "transmission",
    rate: float = 10e6,
    poisson: float = 0.3,
    dispersion: Theory = "none",
    threshold: float = THRESHOLD,
    smooth: float = 1.0,
) -> Test:
    """Return the waves at the specimen of a run from its strain probes.

    There is one probe on each of the bars. They end before a wave from the far end of a bar is back at its gauge, as
    those of `measured`. The true strains are read: signals of instruments, `history.measured`, are evaluated as arrays.

    Parameters
    ----------
    history : AbstractHistory
        Its case has one strain probe on each of the two bars.
    incident, transmission : str
        Names of the bars, the struck one first. The specimen is at the right end of the first and at the left end of
        the second or, in an arrangement with the striker on the right, at the other two.
    rate : float
        Samples per second [Hz].
    poisson, dispersion
        As of `bar_of`.
    threshold : float
        As of `one_gauge`.
    smooth : float
        Standard deviation, in samples, of the Gaussian by which the gauges are smoothed, as by an amplifier; 0 takes
        the values of the run as they are. Below 1 the sums of two waves have spikes at jumps.

    Raises
    ------
    ImpactlabError
        If a bar has no strain probe or several, if no contacts lead from one to the other, if the
        second is struck, or if the pulses overlap.

    Warns
    -----
    DoubtfulResult
        As `measured`.
    UnusualValue
        If a gauge is an instrument, whose signal is not read.
    """
    bars = [bar_of(history, name, poisson, dispersion) for name in (incident, transmission)]
    alike = all(
        math.isclose(getattr(bars[0], name), getattr(bars[1], name), rel_tol=BAR_TOL)
        for name in ("diameter", "wave_speed", "density")
    )
    gauges = [_gauge(history, name) for name in (incident, transmission)]
    places = [gauge.x for gauge in gauges]
    if any(gauge.instrument is not None for gauge in gauges):
        text = "of_history reads the true strains of the bars, and not the signals of the instruments in the case. "
        warn(f"{text}Evaluate history.measured(probe).values of both gauges with hopkinson.measured.", UnusualValue)
    signals = [
        amplified(history, f"strain:{name}@{x:.6g}", rate, smooth)
        for name, x in zip((incident, transmission), places, strict=True)
    ]
    dt = signals[0][0]
    near, far = [], []
    for name, other, x in zip((incident, transmission), (transmission, incident), places, strict=True):
        length = float(history.scene.bodies[name].length)
        at_left = _end_towards(history, name, other) == 0.0
        near.append(x if at_left else length - x)
        far.append(length - x if at_left else x)
    lags = [way / bar.wave_speed for way, bar in zip(near, bars, strict=True)]
    _check_order(signals, lags, threshold, incident, transmission)
    given, ways = (signals[0][1], signals[1][1], dt, bars[0]), ((near[0], near[1]), threshold, (far[0], far[1]))
    return measured(*given, *ways, transmission_bar=None if alike else bars[1])


def _end_towards(history: AbstractHistory, bar: str, other: str) -> float:
    """Return the end x [m] of a bar from which contacts lead to another."""
    bodies, contacts = history.scene.bodies, history.scene.contacts
    pairs = [pair for each in contacts for pair in (each.faces, (each.right, each.left))]
    found = []
    for end in (0.0, float(bodies[bar].length)):
        reached = {beyond.body for here, beyond in pairs if here.body == bar and here.x == end}
        waiting = [*reached]
        while waiting:
            body = waiting.pop()
            new = {beyond.body for here, beyond in pairs if here.body == body and bodies[body].moves} - reached - {bar}
            reached |= new
            waiting += new
        if other in reached:
            found.append(end)
    if len(found) != 1:
        ends = "both of its ends" if found else "no end"
        raise ImpactlabError(
            f"contacts lead from {ends} of '{bar}' to '{other}', so the place of the specimen is not known",
            remedy="Let one end of each bar meet the specimen, or give the gauges as arrays to hopkinson.measured.",
            path="contacts",
        )
    return found[0]


def _check_order(
    signals: list[tuple[float, Array]], lags: Sequence[float], threshold: float, incident: str, transmission: str
) -> None:
    """Raise `ImpactlabError` where the first wave at the specimen comes from the transmission bar.

    ``lags`` are the times of a wave from the specimen to both gauges [s].
    """
    dt, first = signals[0]
    second = signals[1][1]
    if not first.any() or not second.any():
        return
    begins = [float(samples_above(each, threshold)[0]) * dt for each in (first, second)]
    if begins[1] + lags[1] < begins[0] - lags[0] + dt:
        raise ImpactlabError(
            f"the wave is at the gauge of '{transmission}' at {begins[1]:.6g} s and at that of '{incident}' at "
            f"{begins[0]:.6g} s: it comes from '{transmission}'",
            remedy=f"Name the struck bar first, as in of_history(history, '{transmission}', '{incident}').",
        )


def _gauge(history: AbstractHistory, body: str) -> Probe:
    found = [probe for probe in history.scene.probes if probe.body == body and probe.quantity == "strain"]
    if len(found) != 1:
        raise ImpactlabError(
            f"'{body}' has {len(found)} strain probes, and the evaluation reads one",
            remedy="Give the case one; several gauges are evaluated as arrays, by hopkinson.two_gauges.",
            path="probes",
        )
    return found[0]
