"""Signs of force and velocity at the head of a pile: a pile in soil takes energy, and is pressed first."""

from __future__ import annotations

import numpy as np
from scipy.integrate import cumulative_trapezoid

from impactlab.errors import ImpactlabError
from impactlab.prefixes import prefixed
from impactlab.types import Array

REMEDY = "Give compression and the velocity into the soil as positive numbers."
PEAK_SHARE = 0.5  # of the largest magnitude: the first force of a blow is at least as large


def check_work(time: Array, force: Array, velocity: Array) -> None:
    """Raise `ImpactlabError` where signals at a head give less energy to the pile than they take from it.

    A pile at rest in soil has no energy to give, so the work of the force is positive at all times.
    """
    work = cumulative_trapezoid(force * velocity, time, initial=0.0)
    given, taken = float(work.max()), -float(work.min())
    if given <= taken:
        text = "the force does no work on the pile: force or velocity is zero"
        if taken > 0.0:
            text = (
                f"the force gives the pile {prefixed(given, 'J')} and takes {prefixed(taken, 'J')} from it, and a pile "
                "at rest has no energy to give: force or velocity has the other sign"
            )
        raise ImpactlabError(text, remedy=REMEDY)


def check_pressed(force: Array) -> None:
    """Raise `ImpactlabError` where a blow begins with tension."""
    first = int(np.argmax(np.abs(force) >= PEAK_SHARE * np.abs(force).max()))
    if force[first] < 0.0:
        raise ImpactlabError(
            f"the force is {prefixed(force[first], 'N')} at sample {first}, and a blow begins with compression: force "
            "and velocity have the other sign",
            remedy=REMEDY,
        )
