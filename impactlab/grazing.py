"""The warning that a run sits near a grazing contact, where small errors change the number of contacts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from impactlab.history import AbstractHistory

SHALLOW = 0.10  # of the largest gap of the flight so far: a minimum below nearly touches
SHORT = 0.07  # round trips: a contact shorter than this nearly did not happen
SLOW = 0.1  # of the fastest rate of a flight, whose square is the share of its way that is left to go
SAMPLES = 512  # of the gap per round trip
MOST_SAMPLES = 50_000  # of a flight
MOST_OF_RUN = 1_000_000  # of all flights together


def near_grazing(history: AbstractHistory, contact_name: str, round_trip: float, dt: float = 0.0) -> str | None:
    """Return the text of the warning ``near_grazing``, or None where no contact of this name is near grazing.

    Three signs: inside a flight (from an opening on) the gap has a local minimum, not ended by contact there, below
    10 % of the largest gap between opening and that minimum; or a contact lasts less than 0.07 round trips; or the
    faces meet at less than a tenth of the fastest rate of that flight, so that a hundredth of its way more of a gap
    would part them.

    Parameters
    ----------
    history : AbstractHistory
        A run, computed or exact.
    contact_name : str
        As in its events: ``hammer|rod.left``.
    round_trip : float
        T [s].
    dt : float, optional
        Step [s] of a stepped run: contacts shorter than three steps are left to chance and not reported.
    """
    spans = [span for span in history.contacts if span.contact == contact_name]
    for span in spans:
        if span.end is not None and 3.0 * dt <= span.end - span.start < SHORT * round_trip:
            lasts = (span.end - span.start) / round_trip
            return (
                f"{contact_name}: the contact at {span.start:.6g} s lasts only {lasts:.3g} round trips; "
                "a small change of the case or of the method may make it vanish"
            )
    touches = [(span.start, history.duration if span.end is None else span.end) for span in spans]
    if text := _slow_meeting(history, contact_name, touches, round_trip, dt):
        return text
    most = min(MOST_SAMPLES, MOST_OF_RUN // max(1, len(spans)))
    for number, span in enumerate(spans):
        if span.end is None:
            continue
        until = spans[number + 1].start if number + 1 < len(spans) else history.duration
        count = int(min(16 + most, 16 + SAMPLES * (until - span.end) / round_trip))
        t = np.linspace(span.end, until, count)
        gap = history.evaluate(t, f"gap:{contact_name}")
        largest = np.maximum.accumulate(gap)
        inner = 1 + np.flatnonzero((gap[1:-1] < gap[:-2]) & (gap[1:-1] <= gap[2:]))
        # Faces may overlap while no force acts (laws that do not tie positions, soft springs): that is no flight.
        near = inner[(largest[inner] > 0.0) & (gap[inner] >= 0.0) & (gap[inner] < SHALLOW * largest[inner])]
        if len(near):
            i = int(near[0])
            share = 100.0 * gap[i] / largest[i]
            return (
                f"{contact_name}: at {t[i]:.6g} s the faces come within {share:.3g} % of their largest distance "
                "without touching; a small change of the case or of the method may add a contact"
            )
    return None


def grazing_kick(history: AbstractHistory, contact_name: str, round_trip: float, dt: float) -> str | None:
    """Return the text of the warning ``near_grazing`` for a law of kicks, or None.

    A kick lasts no time and faces that ring under kicks nearly touch all the time: of the signs of `near_grazing` the
    slow meeting alone says something. A kick answers to the speed of its instant, which is then known least: a step dt
    before or after, under an acceleration a, it is another by a dt, and the kick with it.
    """
    kicks = [event.time for event in history.events if event.contact == contact_name and event.kind == "impulse"]
    return _slow_meeting(history, contact_name, [(time, time) for time in kicks], round_trip, dt)


def _slow_meeting(
    history: AbstractHistory, contact_name: str, touches: Sequence[tuple[float, float]], round_trip: float, dt: float
) -> str | None:
    """Return the text for the first touch (start, end) whose faces come to rest against each other, or None."""
    before = 0.0
    most = min(MOST_SAMPLES, MOST_OF_RUN // max(1, len(touches)))
    for start, end in touches:
        begin, before = before, end
        if start - begin <= max(10.0 * dt, SHORT * round_trip):
            continue  # touches in quick series: faces that chatter, not that fly
        count = int(min(16 + most, 16 + SAMPLES * (start - begin) / round_trip))
        gap = history.evaluate(np.linspace(begin, start, count), f"gap:{contact_name}")
        rates = np.diff(gap)
        if np.max(gap) > 0.0 and 0.0 < -rates[-1] < SLOW * np.max(np.abs(rates)):
            share = -100.0 * rates[-1] / np.max(np.abs(rates))
            return (
                f"{contact_name}: at {start:.6g} s the faces meet at {share:.2g} % of the speed of their flight; "
                "a small change of the case or of the method may keep them apart"
            )
    return None
