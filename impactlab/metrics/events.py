"""Matching of the events of two histories; metrics of their times and number."""

from __future__ import annotations

import bisect
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from impactlab.history.base import AbstractHistory, Event
from impactlab.scene.problem import Scene

NEAR_EVENT = 0.1  # T: largest distance of a computed event from the exact one that it is matched with


class Matches(NamedTuple):
    """The events of a history matched with those of the exact one."""

    pairs: tuple[tuple[Event, Event], ...]  # (exact, computed)
    missed: tuple[Event, ...]  # exact events without a match
    extra: tuple[Event, ...]  # computed events without one


def match_events(exact: Iterable[Event], computed: Iterable[Event], within: float) -> Matches:
    """Match computed events with exact ones.

    In order of time, each exact event takes the nearest unused one of its contact and kind within ``within`` [s].
    """
    given = list(computed)
    waiting: dict[tuple[str, str], list[tuple[float, int]]] = {}  # by contact and kind: time and place, sorted
    for place, event in enumerate(given):
        waiting.setdefault((event.contact, event.kind), []).append((event.time, place))
    for times in waiting.values():
        times.sort()
    pairs, missed = [], []
    for event in sorted(exact, key=lambda e: e.time):
        times = waiting.get((event.contact, event.kind), [])
        after = bisect.bisect_left(times, (event.time, -1))
        near = [at for at in (after - 1, after) if 0 <= at < len(times)]
        nearest = min(near, key=lambda at: (abs(times[at][0] - event.time), times[at][1]), default=None)
        if nearest is None or abs(times[nearest][0] - event.time) > within:
            missed.append(event)
        else:
            pairs.append((event, given[times.pop(nearest)[1]]))
    left = {place for times in waiting.values() for _, place in times}
    unused = [event for place, event in enumerate(given) if place in left]
    return Matches(tuple(pairs), tuple(missed), tuple(unused))


def _matches(history: AbstractHistory, reference: AbstractHistory, scene: Scene) -> Matches | None:
    """Return the matched closings and openings of the contacts that have any.

    A law of impulses kicks and never closes or opens, so its contacts are left out; None where that leaves no
    contact, or no T to measure in.
    """
    names = {contact.name for contact in scene.contacts if history.method.laws[contact.name].answers_force}
    if not names or not np.isfinite(scene.round_trip):
        return None
    exact, computed = (
        [e for e in h.events if e.contact in names and e.kind != "impulse" and e.time <= scene.duration]
        for h in (reference, history)
    )
    return match_events(exact, computed, NEAR_EVENT * scene.round_trip)


def event_times(history: AbstractHistory, reference: AbstractHistory, scene: Scene) -> float | None:
    """Return the largest error of matched event times, in T; None without a match.

    Events are closings and openings.
    """
    matches = _matches(history, reference, scene)
    if matches is None or not matches.pairs:
        return None
    return max(abs(computed.time - exact.time) for exact, computed in matches.pairs) / scene.round_trip


def events_missed(history: AbstractHistory, reference: AbstractHistory, scene: Scene) -> int | None:
    """Return the number of exact closings and openings without a match; None for impulse laws."""
    matches = _matches(history, reference, scene)
    return None if matches is None else len(matches.missed)


def events_extra(history: AbstractHistory, reference: AbstractHistory, scene: Scene) -> int | None:
    """Return the number of closings and openings without an exact one; None for impulse laws."""
    matches = _matches(history, reference, scene)
    return None if matches is None else len(matches.extra)
