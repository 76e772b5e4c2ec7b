"""Touches by rounding that follow each other are read as one.

Faces that rest on each other with a gap of zero may touch and part in every step until a wave arrives: a chain of some
hundred rods has a million such events. The noise floor (`impactlab.history.noise_floor`) leaves them out one by one;
here those in a row become one, with the sum of their impulses, before an object is made of each.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impactlab.history.noise_floor import MIN_OPENING, reach_of, share_of
from impactlab.simulate.stepping.event_times import CLOSE, OPEN
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.types import Array, Ints

MIN_EVENTS = 5000  # of a run: fewer are read as they are
RawEvent = tuple[float, int, int, float, float, float]  # the fields of `EventRecord`


def events_of(
    assembly: Assembly, raw: Sequence[Any], duration: float, left_alone: Container[int]
) -> Iterable[RawEvent]:
    """Return the events of a run from arrays of its records, touches by rounding that follow each other as one.

    Contacts that are left alone are given by their numbers in the scene.
    """
    if sum(map(len, raw)) < MIN_EVENTS:
        return [event for each in raw for event in each.tolist()]
    numbers, contacts, events = assembly.layout.numbers, assembly.scene.contacts, np.concatenate(raw)
    group_of = reach_of(assembly.scene, assembly.method).groups
    groups = np.array([group_of[contacts[number].name] for number in numbers])
    alone = {place for place, number in enumerate(numbers) if number in left_alone}
    found: list[RawEvent] = joined(
        events[events["time"] <= duration], groups, share_of(duration / assembly.dt), alone
    ).tolist()
    return found


def joined(events: Any, groups: Ints, share: float, left_alone: Container[int]) -> Any:
    """Return the events of a run, with consecutive touches by rounding of a contact as one.

    Parameters
    ----------
    events : structured array
        Of the fields of `EventRecord`, in the order of the loop.
    groups : ndarray
        Number of the group of interacting bodies that each contact is in.
    share : float
        Largest force and impulse of a touch by rounding, over the largest in its group.
    left_alone : container of int
        Contacts whose events stay as they are.
    """
    order = np.argsort(events["contact"], kind="stable")
    kind, contact = events["kind"][order], events["contact"][order]
    paired = (kind[:-1] == CLOSE) & (kind[1:] == OPEN) & (contact[:-1] == contact[1:])
    first = np.flatnonzero(paired)
    if not first.size:
        return events
    closes, opens, of = order[first], order[first + 1], contact[first]
    impulse, peak = events["span_impulse"][opens], events["span_peak"][opens]
    floors = [share * _largest(np.abs(each), groups[of], groups.max()) for each in (impulse, peak)]
    noise = (np.abs(impulse) <= floors[0]) & (peak <= floors[1])
    noise &= ~np.isin(of, [number for number in range(groups.size) if number in left_alone])
    # Touches follow each other where no other event of the contact lies between.
    follows = np.append(False, (first[1:] == first[:-1] + 2) & (of[1:] == of[:-1]))
    starts, ends = events["time"][closes], events["time"][opens]
    apart = np.append(True, starts[1:] - ends[:-1] > MIN_OPENING * starts[1:])  # else both are one period of contact
    begins = np.flatnonzero(noise & ~(follows & np.append(False, noise[:-1])))
    last = np.flatnonzero(noise & ~np.append((follows & noise)[1:], False))
    totals = np.add.reduceat(np.where(noise, impulse, 0.0), begins) if begins.size else impulse[:0]
    beside = apart[begins] | ~follows[begins]
    after = np.append(apart[1:] | ~follows[1:], True)[last]
    joins = (last > begins) & (np.abs(totals) <= floors[0][begins]) & beside & after
    kept, found = np.ones(events.size, bool), events.copy()
    for one, end, total in zip(begins[joins].tolist(), last[joins].tolist(), totals[joins].tolist(), strict=True):
        kept[closes[one + 1 : end + 1]] = False
        kept[opens[one:end]] = False
        found["span_impulse"][opens[end]], found["span_peak"][opens[end]] = total, peak[one : end + 1].max()
    return found[kept]


def _largest(values: Array, groups: NDArray[np.int64], last: int) -> Array:
    """Return for each value the largest one of its group."""
    found = np.zeros(last + 2)  # group -1 is the last entry
    np.maximum.at(found, groups, values)
    return found[groups]
