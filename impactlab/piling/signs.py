"""Checks of signs and sizes of force and velocity at a pile's head.

A pile takes energy, is pressed first, and begins at rest.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import cumulative_trapezoid

from impactlab.errors import CaseError, ImpactlabError
from impactlab.measurement.inputs import warn_unusual
from impactlab.prefixes import prefixed
from impactlab.types import Array

REMEDY = "Give compression and the velocity into the soil as positive numbers."
PEAK_SHARE = 0.5  # of the largest magnitude: the first force of a blow is at least as large
MAX_INTERVAL = 0.1  # of 2 L/c, between samples: head signals have some tens of samples in that time
MAX_TRIPS = 1000.0  # 2 L/c in a record: a record of 0.2 s on a pile of 5 m has 100
MAX_PROPORTION = 5.0  # F over Z v at the first peak, or the inverse: a wave up of two thirds of that down gives 5
MAX_START = 0.05  # of the largest magnitude: signals of a pile at rest begin with less
START_SAMPLES = 3  # whose median is the start of a signal: one alone may be noise


def check_work(time: Array, force: Array, velocity: Array) -> None:
    """Raise `ImpactlabError` where head signals give less energy than they take.

    Both are exchanged with the pile. A pile at rest in soil has no energy to give, so the work of the force is positive
    at all times.
    """
    work = cumulative_trapezoid(force * velocity, time, initial=0.0)
    given, taken = float(work.max()), -float(work.min())
    if given <= taken:
        text = "the force does no work on the pile: force or velocity is zero"
        if taken > 0.0:
            text = (
                f"the force gives the pile {prefixed(given, 'J')} and takes {prefixed(taken, 'J')} from "
                "it, and a pile at rest cannot give energy: force or velocity has the wrong sign"
            )
        raise ImpactlabError(text, remedy=REMEDY)


def check_pressed(force: Array) -> None:
    """Raise `ImpactlabError` where a blow begins with tension."""
    first = int(np.argmax(np.abs(force) >= PEAK_SHARE * np.abs(force).max()))
    if force[first] < 0.0:
        raise ImpactlabError(
            f"the force is {prefixed(force[first], 'N')} at sample {first}, and a blow begins with "
            "compression: force and velocity have the wrong sign",
            remedy=REMEDY,
        )


def warn_of_times(time: Array, trip: float) -> None:
    """Issue an `UnusualValue` of times that do not fit 2 L/c of the pile, ``trip`` [s]."""
    interval, length = float(np.median(np.diff(time))), float(time[-1] - time[0])
    if interval > MAX_INTERVAL * trip or length > MAX_TRIPS * trip:
        warn_unusual(
            f"the samples are {interval:.3g} s apart over {length:.3g} s, and 2 L/c of the pile is {trip:.3g} s. Times "
            "are in seconds: multiply those in ms by 1e-3."
        )


def check_length(time: Array, trip: float) -> None:
    """Raise `CaseError` where times [s] far exceed a blow; ``trip`` is 2 L/c [s]."""
    length = float(time[-1] - time[0])
    if length > MAX_TRIPS * trip:
        raise CaseError(
            f"the signals last {length:.3g} s, {length / trip:.3g} round trips 2 L/c of the pile, {trip:.3g} s each. "
            f"Allowed: up to {MAX_TRIPS:g}",
            remedy="Give times in seconds: multiply those in ms by 1e-3. Cut a longer record after the blow.",
            path="time",
        )


def warn_of_proportion(time: float, force: float, impedance_velocity: float) -> None:
    """Issue an `UnusualValue` where force and Z v at the first peak disagree.

    They differ by more than waves up explain, both in N.
    """
    if not impedance_velocity / MAX_PROPORTION <= force <= MAX_PROPORTION * impedance_velocity:
        warn_unusual(
            f"at the first peak, {time:.4g} s, the force is {prefixed(force, 'N')} and impedance "
            f"times velocity {prefixed(impedance_velocity, 'N')}. They are equal until waves return "
            "from the soil: check the units of force (N), velocity (m/s) and impedance (N s/m)."
        )


def warn_of_offsets(force: Array, velocity: Array) -> None:
    """Issue an `UnusualValue` where head signals of a pile do not begin at zero."""
    for name, unit, values in (("force", "N", force), ("velocity", "m/s", velocity)):
        start, largest = float(np.median(values[:START_SAMPLES])), float(np.abs(values).max())
        if abs(start) > MAX_START * largest:
            warn_unusual(
                f"the {name} begins with {prefixed(start, unit)}, {100.0 * abs(start) / largest:.2g} % of its largest "
                "value, and the pile is at rest at the first sample. Subtract the offset of the signal, or begin the "
                "record before the blow."
            )
