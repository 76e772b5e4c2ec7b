"""Pairs of contacts that may act on each other within a step.

They share a body and are read where the other acts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from impactlab.simulate.planning.preparation import Push
from impactlab.simulate.stepping.arrays import ContactRecord, FaceRecord
from impactlab.types import Ints

ReadOn = Mapping[str, Mapping[int, Sequence[Ints]]]
"""Entries of a body's state that its faces are read from, by name of the body and number of the face."""


MAX_ONE_BY_ONE = 4  # faces of a body that are compared one by one: the two of a bead in a chain of thousands


def find_pairs(
    faces: Sequence[FaceRecord], contacts: Sequence[ContactRecord], pushes: Sequence[Push], read_on: ReadOn
) -> Ints:
    """Return the contacts that may act on each contact, itself included.

    The range of each is written into its record.

    Parameters
    ----------
    faces : sequence of FaceRecord
        Two to a contact, with the ranges of the state that a force, an impulse or a projection there changes.
    contacts : sequence of ContactRecord
        Their ``first_pair`` and ``last_pair`` are written.
    pushes : sequence of Push
        Rows that laws push; all contacts on the body of one may act on each other.
    read_on : mapping
        Of the bodies that move.
    """
    if len(contacts) == 1:
        contacts[0].first_pair, contacts[0].last_pair = 0, 1
        return np.zeros(1, np.int64)
    found: list[set[int]] = [{number} for number in range(len(contacts))]
    for body, read in read_on.items():
        pushing = {push.contact for push in pushes if push.body == body}
        if pushing:
            together = pushing | {number // 2 for number in read}
            for contact in together:
                found[contact] |= together
            continue
        if len(read) <= MAX_ONE_BY_ONE:
            _add_few(found, faces, read)
            continue
        numbers = np.array(list(read))
        changed = np.array([(faces[number].low[:], faces[number].high[:]) for number in read])
        for number, rows in read.items():
            for entries in rows:
                if entries.size:
                    acts = ((changed[:, 0] <= entries.max()) & (entries.min() < changed[:, 1])).any(axis=1)
                    found[number // 2].update((numbers[acts] // 2).tolist())
    lists = [sorted(each) for each in found]
    bounds = np.cumsum([0, *map(len, lists)]).tolist()
    for record, first, last in zip(contacts, bounds[:-1], bounds[1:], strict=True):
        record.first_pair, record.last_pair = first, last
    return np.array([other for each in lists for other in each], np.int64)


def _add_few(found: list[set[int]], faces: Sequence[FaceRecord], read: Mapping[int, Sequence[Ints]]) -> None:
    """Add the contacts that act on the faces of a body with few of them."""
    changed = [(number // 2, list(zip(faces[number].low, faces[number].high, strict=True))) for number in read]
    for number, rows in read.items():
        for entries in rows:
            if entries.size:
                low, high = int(entries.min()), int(entries.max())
                acts = (other for other, ranges in changed if any(a <= high and low < b for a, b in ranges))
                found[number // 2].update(acts)


class SystemOrder(NamedTuple):
    """Contacts in the order of the linear system of the contact solve."""

    order: Ints  # (n_contacts,) place of each
    reach: int  # largest distance of two that may act on each other


def arranged(contacts: Sequence[ContactRecord], candidates: Ints) -> SystemOrder:
    """Return contacts in an order that keeps coupled ones close together.

    The order of the scene is kept where it is as good as that of Cuthill and McKee, reversed: of a chain it is.
    """
    number = len(contacts)
    if number <= 1:
        return SystemOrder(np.arange(number), 0)
    counts = [record.last_pair - record.first_pair for record in contacts]
    own = np.repeat(np.arange(number), counts)
    given = int(np.abs(own - candidates).max(initial=0))
    if given <= 2:
        return SystemOrder(np.arange(number), given)
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    graph = csr_array((np.ones(own.size), (own, candidates)), (number, number))
    places = np.argsort(reverse_cuthill_mckee(graph + graph.T, symmetric_mode=True)).astype(np.int64)
    reach = int(np.abs(places[own] - places[candidates]).max(initial=0))
    return SystemOrder(places, reach) if reach < given else SystemOrder(np.arange(number), given)
