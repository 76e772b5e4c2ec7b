"""Times and places as they are given to a history, checked, and by rounding moved into it."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import ArrayLike

from impactlab.errors import ImpactlabError
from impactlab.scene.bodies import Body
from impactlab.types import Array

END_ROUNDING = 1e-9  # of duration or length: a time outside a run, a place outside a body by less is moved into it

SEVERAL_TIMES = "fields_at(body, times, quantity) returns the fields at several times."


def within_run(t: ArrayLike, duration: float) -> Array:
    """Return times as an array [s], those outside the run by rounding moved into it.

    Raises
    ------
    ImpactlabError
        If a time lies further outside, or is not a number.
    """
    try:
        times = np.asarray(t, float)
    except (TypeError, ValueError):
        raise ImpactlabError(
            f"{str(t)[:60]!r} is not a time or an array of times in seconds",
            remedy="Give numbers in s, such as 1e-5, in this order: evaluate(t, channel), field(body, t, quantity).",
        ) from None
    slack = END_ROUNDING * duration
    outside = times[~((times >= -slack) & (times <= duration + slack))]
    if outside.size:
        time = float(outside.flat[0])
        digits = 6 if f"{time:.6g}" != f"{duration:.6g}" else 16  # that show the difference
        raise ImpactlabError(
            f"the time t = {time:.{digits}g} s lies outside the run, 0 to {duration:.{digits}g} s",
            remedy="Give times of the run, or run the case with a longer duration.",
        )
    return np.asarray(np.clip(times, 0.0, duration))


def check_one(channel: object) -> None:
    """Raise `ImpactlabError` for a list of channels."""
    if isinstance(channel, Collection) and not isinstance(channel, str):
        raise ImpactlabError(
            f"{str(channel)[:60]!r} is not the name of one channel",
            remedy="Give one name, such as those of history.channels(); evaluate_each(t, channels) takes several.",
        )


def check_several(channels: object) -> None:
    """Raise `ImpactlabError` for one name where a list of channels is needed."""
    if isinstance(channels, str):
        raise ImpactlabError(
            f"{channels[:60]!r} is one channel, and evaluate_each takes a list of them",
            remedy="Write evaluate_each(t, ['A', 'B']), or evaluate(t, 'A') of one.",
        )


def one_time(t: ArrayLike, duration: float) -> float:
    """Return one time of the run [s], as `within_run`; raise `ImpactlabError` for several."""
    times = within_run(t, duration)
    if times.size != 1:
        raise ImpactlabError(f"{times.size} times are given, and a field has one", remedy=SEVERAL_TIMES)
    return float(times.flat[0])


def places_on(body: Body, x: ArrayLike) -> Array:
    """Return places (n,) [m], those outside the body by rounding moved onto it.

    Raises
    ------
    ImpactlabError
        If a place lies further outside, or is not a number.
    """
    try:
        places = np.atleast_1d(np.asarray(x, float))
    except (TypeError, ValueError):
        raise ImpactlabError(
            f"{str(x)[:60]!r} is not a place or an array of places in metres",
            remedy="Give x from the left end of the body.",
        ) from None
    slack = END_ROUNDING * body.length
    outside = places[~((places >= -slack) & (places <= body.length + slack))]
    if outside.size:
        raise ImpactlabError(
            f"{float(outside.flat[0]):.6g} m lies outside '{body.name}', 0 to {body.length:.6g} m",
            remedy="Give x from the left end of the body.",
            path=f"bodies.{body.name}",
        )
    return np.asarray(np.clip(places, 0.0, body.length))
