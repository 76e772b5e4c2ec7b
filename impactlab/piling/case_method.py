"""Case method: resistance of a pile by the two waves from force and velocity at its head."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import cumulative_trapezoid

from impactlab.errors import ImpactlabError
from impactlab.measurement.inputs import above_zero, finite, row_of_numbers
from impactlab.piling.signs import check_pressed, check_work, warn_of_offsets, warn_of_proportion, warn_of_times
from impactlab.prefixes import prefixed
from impactlab.types import Array

PEAK_SHARE = 0.5  # of the largest value: the first peak of the wave down is at least as high
PEAK_FALL = 0.1  # of the largest value: the wave falls by more after a peak, by less under noise of 2 %


@dataclass(frozen=True, repr=False)
class CaseMethod:
    """Resistances by the Case method, waves at the head, and energy that passed it."""

    total: float  # RTL [N], static and dynamic resistance from the first peak
    static: float  # RSP [N], less the damping at the toe, from the first peak
    largest_static: float  # RMX [N], the largest of all start times
    peak_time: float  # s, of the first peak
    largest_time: float  # s, the start time of RMX
    transferred_energy: float  # J, the largest work of the head force up to any time (EMX)
    proportionality: float  # F/(Z v) at the first peak: 1 where no wave has come back yet
    down: Array = field(repr=False)  # N, (n,) wave that runs towards the toe
    up: Array = field(repr=False)  # N, (n,) wave that comes back

    def __repr__(self) -> str:
        found = {"RTL": self.total, "RSP": self.static, "RMX": self.largest_static}
        forces = ", ".join(f"{name} {prefixed(value, 'N')}" for name, value in found.items())
        return (
            f"<CaseMethod: {forces}, first peak at {prefixed(self.peak_time, 's')} with a proportionality of "
            f"{self.proportionality:.3g}, transferred {prefixed(self.transferred_energy, 'J')}>"
        )


def case_method(
    time: ArrayLike,
    force: ArrayLike,
    velocity: ArrayLike,
    impedance: float | str,
    length: float | str,
    wave_speed: float | str,
    damping: float,
) -> CaseMethod:
    """Return the resistances of a pile from force and velocity at its head.

    With W = (F + Z v)/2 down, U = (F - Z v)/2 up and t2 = t1 + 2 L/c: RTL = W(t1) + U(t2) is the total resistance, and
    RSP = RTL - J (2 W(t1) - RTL) the static one with the Case damping factor J. t1 is the first peak of the wave down;
    RMX is the largest RSP over all t1. The first peak is at least half as high as the largest one, and after it the
    wave falls by a tenth of that height: peaks of noise are smaller.

    Parameters
    ----------
    time : array
        Rising times [s], shape (n,).
    force, velocity : array
        At the gauges, shape (n,): compression positive [N], velocity towards the toe [m/s].
    impedance : float or str
        Z = E A/c of the pile [N s/m], or a string with its unit.
    length : float or str
        From the gauges to the toe [m], likewise.
    wave_speed : float or str
        c [m/s], likewise.
    damping : float
        Case damping factor J [-].

    Raises
    ------
    ImpactlabError
        If the signals differ in length, times do not rise, a value is no number, has another unit, is not finite or not
        positive, force or velocity has the other sign, or the signals end within 2 L/c of their first peak.

    Warns
    -----
    UnusualValue
        If a sampling interval is above a tenth of 2 L/c or the record above 1000 times 2 L/c, if force and Z v differ
        by a factor above 5 at the first peak, or if a signal does not begin at zero: units or offsets may be wrong.

    References
    ----------
    RauscheGobleLikins1985; GEC12.
    """
    given = (("time", time), ("force", force), ("velocity", velocity))
    t, f, v = (row_of_numbers(name, each) for name, each in given)
    _check(t, f, v)
    impedance = above_zero("impedance", impedance, "N s/m")
    length, wave_speed = above_zero("length", length, "m"), above_zero("wave_speed", wave_speed, "m/s")
    damping = finite("damping", damping, "1")
    if damping < 0.0:
        raise ImpactlabError(
            f"damping is {damping:g}. Allowed: at least 0", remedy="Usual factors: 0.1 in sand to 1.1 in clay."
        )
    check_work(t, f, v)
    check_pressed(f)
    down, up = 0.5 * (f + impedance * v), 0.5 * (f - impedance * v)
    first, trip = first_peak(down), 2.0 * length / wave_speed
    warn_of_times(t, trip)
    warn_of_offsets(f, v)
    warn_of_proportion(float(t[first]), float(f[first]), float(impedance * v[first]))
    last = int(np.searchsorted(t, t[-1] - trip, side="right"))  # start times whose echo was measured
    if first >= last:
        text = f"the signals end {t[-1] - t[first]:.6g} s after the first peak, before its echo from the toe returns"
        raise ImpactlabError(
            f"{text} ({trip:.6g} s)",
            remedy="Measure for at least two round trips 2 L/c, or check time (s), length (m) and wave speed (m/s).",
        )
    total = down[:last] + np.interp(t[:last] + trip, t, up)
    static = total - damping * (2.0 * down[:last] - total)
    largest = int(np.argmax(static))
    work = cumulative_trapezoid(f * v, t, initial=0.0)
    return CaseMethod(
        total=float(total[first]),
        static=float(static[first]),
        largest_static=float(static[largest]),
        peak_time=float(t[first]),
        largest_time=float(t[largest]),
        transferred_energy=float(work.max()),
        proportionality=float(np.divide(f[first], impedance * v[first])) if v[first] else math.inf,
        down=down,
        up=up,
    )


def first_peak(down: Array) -> int:
    """Return the index of the first peak, of at least half of the maximum.

    After it the wave falls.
    """
    highest = np.maximum.accumulate(down)
    fallen = np.flatnonzero((highest >= PEAK_SHARE * down.max()) & (highest - down > PEAK_FALL * down.max()))
    return int(np.argmax(down[: fallen[0] + 1] if fallen.size else down))


def _check(t: Array, f: Array, v: Array) -> None:
    if not (t.shape == f.shape == v.shape and t.ndim == 1 and t.size > 2):
        raise ImpactlabError(
            f"time, force and velocity have the shapes {t.shape}, {f.shape} and {v.shape}. Allowed: one length, "
            "3 samples or more",
            remedy="Give the three signals at the same instants.",
        )
    for name, values in (("time", t), ("force", f), ("velocity", v)):
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise ImpactlabError(
                f"{name} is not finite at sample {bad[0]}", remedy="Leave such samples out of all three."
            )
    falls = np.flatnonzero(np.diff(t) <= 0.0)
    if falls.size:
        raise ImpactlabError(
            f"time does not rise from sample {falls[0]} to the next", remedy="Sort the samples by time."
        )
