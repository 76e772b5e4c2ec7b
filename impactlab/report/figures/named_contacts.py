"""Contacts as figures show them: by name, and some of many.

Of many these are the first, the last and those of the largest force between.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from impactlab.errors import ImpactlabError
from impactlab.history.base import AbstractHistory
from impactlab.history.sampling import HISTORY_POINTS
from impactlab.plugins import kind_of
from impactlab.scene.problem import Scene
from impactlab.types import Array

MAX_FIGURES = 12  # contacts of a page that have figures of their own: more are not compared by eye
FORCE_TOL = 0.1  # share of the largest force, within which forces are alike
ZOOM = 0.2  # share of the run; all contact within less is drawn large
RISE_TOL = 1e-3  # share of the largest force: the front of a wave in a row of beads rises slowly from zero
MARGIN = 0.5  # of the length of the contact, on each side of it where it is drawn large
MIN_ZOOM = 1e-3  # of the run: a single kick has no length


class NamedContact(NamedTuple):
    """The contacts of one name: one contact, or the pieces whose forces are summed."""

    name: str  # of the channel force:NAME
    number: int  # of the first of them in the scene, from 1
    members: tuple[str, ...]  # names of the contacts
    linked: bool  # joined from the start: it has no gap to close


def named_contacts(histories: Sequence[AbstractHistory]) -> list[NamedContact]:
    """Return one contact per name that histories share, in the order of the scene."""
    if not histories:
        return []
    found: dict[str, list[tuple[int, str]]] = defaultdict(list)
    for number, contact in enumerate(histories[0].scene.contacts, start=1):
        found[contact.shared_name].append((number, contact.name))
    made = []
    for name, own in found.items():
        members = tuple(member for _, member in own)
        made.append(NamedContact(name, own[0][0], members, all(_is_linked(each, members) for each in histories)))
    return made


def _is_linked(history: AbstractHistory, members: Sequence[str]) -> bool:
    """Return whether contacts are joined from the start in a run.

    The run may have been read from a file.
    """
    laws = history.method.laws
    return all(name in laws and laws[name].two_sided for name in members)


def with_figures(histories: Sequence[AbstractHistory]) -> list[NamedContact]:
    """Return at most `MAX_FIGURES` contacts.

    They are the first, the last, and those of the largest force between. Of several with forces alike those are chosen
    that are spread over the row.
    """
    contacts = named_contacts(histories)
    if len(contacts) <= MAX_FIGURES:
        return contacts
    forces = [_largest_forces(history) for history in histories]

    def largest(contact: NamedContact) -> float:
        return max(force.get(member, 0.0) for force in forces for member in (contact.name, *contact.members))

    between, loads = contacts[1:-1], [largest(contact) for contact in contacts[1:-1]]
    level = np.round(np.array(loads) / ((max(loads) or 1.0) * FORCE_TOL))
    chosen: list[int] = []
    for value in np.unique(level)[::-1]:
        same, room = np.flatnonzero(level == value), MAX_FIGURES - 2 - len(chosen)
        places = np.linspace(0, same.size - 1, min(room, same.size)).round().astype(int)
        chosen += same[places].tolist()
    return [contacts[0], *(between[number] for number in sorted(chosen)), contacts[-1]]


def _largest_forces(history: AbstractHistory) -> Mapping[str, float]:
    """Return the largest force of contacts and links [N] by name.

    Of impulse laws it is the impulse [N s].
    """
    found: dict[str, float] = {}
    for span in history.contacts:
        own = span.impulse if span.peak_force is None else span.peak_force
        found[span.contact] = max(found.get(span.contact, 0.0), own)
    return found | {link.name: max(link.largest, -link.smallest) for link in history.links}


def words_on_figures(histories: Sequence[AbstractHistory], rest: str) -> str:
    """Return a sentence on the contacts that have figures.

    ``rest`` is the file that has the others; the text is empty if all have figures.
    """
    count = len(named_contacts(histories))
    if count <= MAX_FIGURES:
        return ""
    return f"{MAX_FIGURES} of {count}: the first, the last and those of the largest force between; {rest}"


def members_of(scene: Scene, name: str) -> list[str]:
    """Return the names of the contacts of one name."""
    return [each.name for each in scene.contacts if name in (each.group, each.name)]


def law_of(history: AbstractHistory, contact: NamedContact) -> str:
    """Return the kinds of the laws of a contact in words."""
    laws = [history.method.laws[member] for member in contact.members if member in history.method.laws]
    return ", ".join(dict.fromkeys(kind_of(law) for law in laws))


def force_of(history: AbstractHistory, name: str, times: Array) -> Array:
    """Return the force of the contacts of one name, the sum of the pieces [N], at times (n,)."""
    return _of_all(history, "force", name, times, np.sum)


def gap_of(history: AbstractHistory, name: str, times: Array) -> Array:
    """Return the gap of the contacts of one name, the least one of the pieces [m], at times (n,)."""
    return _of_all(history, "gap", name, times, np.min)


def _of_all(history: AbstractHistory, quantity: str, name: str, times: Array, one: Callable[..., Array]) -> Array:
    """Return a quantity of the contacts of one name at times (n,), made one from those of the pieces."""
    try:
        return history.evaluate(times, f"{quantity}:{name}")
    except ImpactlabError:  # a name for several contacts, whose channels are those of the pieces
        members = members_of(history.scene, name)
        if members in ([], [name]):
            raise
        return np.asarray(one([history.evaluate(times, f"{quantity}:{each}") for each in members], axis=0))


def view_of(histories: Sequence[AbstractHistory], name: str, duration: float) -> tuple[float, float]:
    """Return the times [s] between which the force of a contact is drawn.

    The whole run; all contact with a margin, where it lies within less than `ZOOM` of the run.
    """
    if any(_is_linked(history, members_of(history.scene, name)) for history in histories):
        return 0.0, duration
    ends = [each for each in (_loaded(history, name, duration) for history in histories) if each is not None]
    first, last = min((each[0] for each in ends), default=0.0), max((each[1] for each in ends), default=duration)
    length = max(last - first, MIN_ZOOM * duration)
    if length >= ZOOM * duration:
        return 0.0, duration
    return max(0.0, first - MARGIN * length), min(duration, last + MARGIN * length)


def _loaded(history: AbstractHistory, name: str, duration: float) -> tuple[float, float] | None:
    """Return the times between which a contact has a force [s].

    It is above `RISE_TOL`; None for a contact that is never closed. Of laws without a force those of the first and the
    last period of contact.
    """
    spans = history.spans_of(members_of(history.scene, name))
    if not spans:
        return None
    first, last = min(span.start for span in spans), max(span.until(duration) for span in spans)
    times = np.linspace(first, last, HISTORY_POINTS)
    force = np.abs(force_of(history, name, times))
    above = times[force > RISE_TOL * float(np.nanmax(force, initial=0.0))]
    return (float(above[0]), float(above[-1])) if above.size else (first, last)
