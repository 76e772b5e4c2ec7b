"""The warning ``near_grazing``: small errors of this run would change the number of contacts."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.scene.facts import RoundTrip, field_acceleration
from impactlab.types import Array

MAX_NEAR_GAP = 0.10  # of the largest gap of the flight so far: a smaller minimum is nearly a contact
MIN_CONTACT = 0.07  # round trips: a shorter contact nearly did not happen
MIN_MEETING_RATE = 0.1  # of the fastest rate of a flight; its square is the share of the way that is left
MIN_TOUCH = 1e-4  # of the largest impulse of a contact: a smaller one is a ripple
MIN_FLIGHT = 1e-3  # of the widest gap: smaller openings are ripples
MIN_GAP = 1e-12  # of the way at the fastest speed over the run: a smaller gap is the rounding of faces at rest
OPENING_SAMPLES = 32  # of the gap of an opening
SAMPLES = 512  # of the gap per round trip
MAX_SAMPLES = 50_000  # of a flight
MAX_RUN_SAMPLES = 1_000_000  # of all flights together
MAX_TOGETHER = 20_000  # samples of several flights that are evaluated at once


class MergedPeriod(NamedTuple):
    """A contact period, with the short openings of chattering faces inside it."""

    start: float  # s
    end: float | None  # s
    impulse: float  # N s


def merged_periods(history: AbstractHistory, contact_name: str, quiet: float) -> list[MergedPeriod]:
    """Return the periods of a contact, merged where no flight lies between them.

    A flight takes longer than ``quiet`` [s], and its gap grows beyond a thousandth of the widest one. With quiet = 0
    every opening is a flight.
    """
    spans = history.spans(contact_name)
    widest: float | None = None  # found where it is needed
    merged: list[MergedPeriod] = []
    after = itertools.pairwise(spans)
    open_for = [(a.end, b.start) for a, b in after if quiet > 0.0 and a.end is not None and b.start - a.end > quiet]
    openings = _gaps(history, contact_name, [(*each, OPENING_SAMPLES) for each in open_for])
    for span in spans:
        last = merged[-1] if merged else None
        joined = last is not None and (last.end is None or span.start - last.end <= quiet)
        if last is not None and last.end is not None and not joined and quiet > 0.0:
            _, opening = next(openings)
            widest = history.largest(f"gap:{contact_name}") if widest is None else widest
            joined = bool(np.max(opening) <= MIN_FLIGHT * widest)
        if last is not None and joined:
            merged[-1] = MergedPeriod(last.start, span.end, last.impulse + span.impulse)
        else:
            merged.append(MergedPeriod(span.start, span.end, span.impulse))
    return merged


def near_grazing(history: AbstractHistory, contact_name: str, trip: RoundTrip, dt: float = 0.0) -> str | None:
    """Return the text of the warning ``near_grazing``, or None.

    Three signs: inside a flight (from an opening on) the gap has a local minimum, not ended by contact there, below
    10 % of the largest gap between opening and that minimum; or a contact lasts less than 0.07 round trips; or the
    faces meet at less than a tenth of the fastest rate of that flight, so that a hundredth of its way more of a gap
    would part them. Of a stepped run, contacts with openings of less than 0.07 round trips between them are one: faces
    that chatter do not fly.

    Parameters
    ----------
    history : AbstractHistory
        A run, computed or exact.
    contact_name : str
        As in its events: ``hammer|rod.left``.
    trip : RoundTrip
        Of a body of the contact (`impactlab.scene.facts.round_trips_of`).
    dt : float, optional
        Step [s] of a stepped run: contacts shorter than three steps are left to chance and not reported.
    """
    round_trip = trip.time
    contacts = merged_periods(history, contact_name, max(10.0 * dt, MIN_CONTACT * round_trip) if dt > 0.0 else 0.0)
    strongest = max((abs(contact.impulse) for contact in contacts), default=0.0)
    for contact in contacts:
        if contact.end is None or (dt > 0.0 and abs(contact.impulse) <= MIN_TOUCH * strongest):
            continue
        if 3.0 * dt <= contact.end - contact.start < MIN_CONTACT * round_trip:
            lasts = (contact.end - contact.start) / round_trip
            return (
                f"{contact_name}: the contact at {contact.start:.6g} s lasts only {lasts:.3g} round trips of "
                f"'{trip.body}'; a small change of the case or of the method may make it vanish"
            )
    periods = [(each.start, history.duration if each.end is None else each.end) for each in contacts]
    if text := _slow_meeting(history, contact_name, periods, round_trip, dt):
        return text
    return _missed_contact(history, contact_name, periods, round_trip)


def _missed_contact(
    history: AbstractHistory, contact_name: str, periods: Sequence[tuple[float, float]], round_trip: float
) -> str | None:
    """Return a text on the first flight after a contact whose faces nearly meet, or None."""
    most, flights = _most_samples(periods), []
    for (_, end), (until, _) in itertools.pairwise([*periods, (history.duration, history.duration)]):
        if end < until:
            flights.append((end, until, int(min(most, 16 + SAMPLES * (until - end) / round_trip))))
    for t, gap in _gaps(history, contact_name, flights):
        largest = np.maximum.accumulate(gap)
        inner = 1 + np.flatnonzero((gap[1:-1] < gap[:-2]) & (gap[1:-1] <= gap[2:]))
        # Faces may overlap while no force acts (laws that do not tie positions, soft springs): that is no flight; nor
        # are ripples of faces that have hardly parted.
        near = inner[(gap[inner] >= 0.0) & (gap[inner] < MAX_NEAR_GAP * largest[inner])]
        if len(near):
            widest = max(MIN_FLIGHT * history.largest(f"gap:{contact_name}"), _rounding(history))
            near = near[largest[near] > widest]
        if len(near):
            i = int(near[0])
            share = 100.0 * gap[i] / largest[i]
            return (
                f"{contact_name}: at {t[i]:.6g} s the faces come within {share:.3g} % of their largest distance "
                "without touching; a small change of the case or of the method may add a contact"
            )
    return None


def _rounding(history: AbstractHistory) -> float:
    """Return the gap of faces at rest against each other that rounding alone may give [m]."""
    scene = history.scene
    return MIN_GAP * history.duration * (scene.fastest + field_acceleration(scene) * history.duration)


def _most_samples(periods: Sequence[tuple[float, float]]) -> int:
    """Return the largest number of samples of one flight."""
    return min(MAX_SAMPLES, MAX_RUN_SAMPLES // max(1, len(periods)))


def _gaps(
    history: AbstractHistory, contact_name: str, flights: Sequence[tuple[float, float, int]]
) -> Iterator[tuple[Array, Array]]:
    """Yield instants [s] and gaps [m] of flights, each (samples,).

    A flight has its beginning and end [s] and its number of samples. Those of many short flights are evaluated at once.
    """
    waiting: list[Array] = []
    size = 0
    for number, flight in enumerate(flights):
        waiting.append(np.linspace(*flight))
        size += flight[2]
        if size >= MAX_TOGETHER or number == len(flights) - 1:
            gaps = history.evaluate(np.concatenate(waiting), f"gap:{contact_name}")
            yield from zip(waiting, np.split(gaps, np.cumsum([each.size for each in waiting])[:-1]), strict=True)
            waiting, size = [], 0


def grazing_impulse(history: AbstractHistory, contact_name: str, trip: RoundTrip, dt: float) -> str | None:
    """Return the text of the warning ``near_grazing`` for a law of impulses, or None.

    A kick lasts no time and faces that ring under kicks nearly touch all the time: of the signs of `near_grazing` only
    the slow meeting counts. A kick follows from the speed of its instant, which is then least certain: a step dt before
    or after, under an acceleration a, the speed differs by a dt, and the kick with it.
    """
    kicks = [event.time for event in history.events if event.contact == contact_name and event.kind == "impulse"]
    return _slow_meeting(history, contact_name, [(time, time) for time in kicks], trip.time, dt)


def _slow_meeting(
    history: AbstractHistory, contact_name: str, periods: Sequence[tuple[float, float]], round_trip: float, dt: float
) -> str | None:
    """Return a text on the first contact whose faces come to rest together, or None."""
    least, most, flights = _rounding(history), _most_samples(periods), []
    for (_, begin), (start, _) in itertools.pairwise([(0.0, 0.0), *periods]):
        if start - begin > max(10.0 * dt, MIN_CONTACT * round_trip):  # shorter ones are chatter, not flights
            flights.append((begin, start, int(min(16 + most, 16 + SAMPLES * (start - begin) / round_trip))))
    for t, gap in _gaps(history, contact_name, flights):
        rates = np.diff(gap)
        if np.max(gap) > least and 0.0 < -rates[-1] < MIN_MEETING_RATE * np.max(np.abs(rates)):
            share = -100.0 * rates[-1] / np.max(np.abs(rates))
            return (
                f"{contact_name}: at {t[-1]:.6g} s the faces meet at {share:.2g} % of the speed of their flight; "
                "a small change of the case or of the method may keep them apart"
            )
    return None
