"""The scene as a network of nodes joined by rod pieces and contacts, and the log of its march."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from impactlab.exact.arrays import (
    MORE_EVENTS,
    MORE_POOL,
    MORE_RECORDS,
    ContactRecord,
    EndRecord,
    EventRecord,
    JunctionRecord,
    MarchArrays,
    NodeRecord,
    PieceRecord,
    StateRecord,
)
from impactlab.exact.kernel import MAX_DEPTH, ROOM, WIDTH
from impactlab.numerics import records
from impactlab.numerics.records import columns
from impactlab.scene.bodies import Segment
from impactlab.types import Array, Ints

ARRAYS = [name for name in MarchArrays._fields if name not in ("coupled", "changes", "pool")]
Columns = Any  # structured arrays; with NDArray[np.void], whose columns are of any type, mypy takes a fifth longer


@dataclass(frozen=True)
class Link:
    """A uniform piece of a rod between two nodes."""

    x: float  # m, of its left end on the rod
    length: float  # m
    segment: Segment  # of which it is a piece
    u: float  # m, displacement of its left end at t = 0
    left_end: int  # emits the waves that travel to the right
    right_end: int

    @property
    def transit(self) -> float:
        """Time of a wave from end to end [s]."""
        return self.length / self.segment.wave_speed


class Place(NamedTuple):
    """A place on a rod: its uniform piece, and its travel time.

    This is the time of a wave from the left end of the piece.
    """

    link: Link
    way: float | Array  # s; one per time

    @classmethod
    def on(cls, links: Sequence[Link], length: float, x: float, exact: bool) -> Place:
        """Return the place x [m] on a rod of some length [m], ``exact`` or to six digits."""
        link = next((item for item in links if x < item.x + item.length * (1.0 - 1e-12)), links[-1])
        way = (x - link.x) / link.segment.wave_speed
        # Names carry six digits: a place that rounds to the end of the rod is the end, however short its last link is.
        at_end = link is links[-1] and x > length * (1.0 - 5e-6)
        if at_end or (exact and x == link.x + link.length):
            way = link.transit
        return cls(link, min(max(way, 0.0), link.transit))


@dataclass(frozen=True)
class NetworkLayout:
    """Where the bodies of a scene sit in its network."""

    links: dict[str, tuple[Link, ...]]  # rods, from left to right
    nodes: dict[str, tuple[int, ...]]  # every body: its nodes (rods: from left to right; walls: one per contact)
    places: Ints  # contact of the network -> contact of the scene
    carried: dict[int, float] = field(default_factory=dict)  # m, by end: time integral of its wave up to -transit


class Log(NamedTuple):
    """The records of a march as arrays with named columns.

    ``memory`` holds the same for the compiled march. Nodes, ends and contacts are ordered by junction. They are shared
    by all logs of a march.
    """

    memory: MarchArrays
    state: Any  # one record
    junctions: Columns  # (junctions,)
    nodes: Columns  # (nodes,)
    ends: Columns  # (ends,)
    contacts: Columns  # (contacts,)
    names: tuple[str, ...]  # of the branches of laws, in the order of their rows in the stack
    begins: Columns  # (contacts,), as they are where the events begin; none without branches
    pieces: Columns  # (junctions, room); of each junction the first `records` are filled
    events: Columns  # (room,), the first `state["events"]` are filled

    @property
    def pool(self) -> Array:
        """Chebyshev coefficients of all pieces, (room,); a piece holds its rows one after the other."""
        return self.memory.pool

    @property
    def reached(self) -> float:
        """Time that all junctions have reached [s]."""
        return float(self.junctions["clock"].min())


def copied(log: Log) -> Log:
    """Return a copy, with arrays of its own, of a log that has not marched."""
    old, used = log.memory, int(log.state["pool_used"])
    arrays: dict[str, Any] = {name: records.copied(getattr(old, name)) for name in ARRAYS}
    arrays["pool"] = np.empty(len(old.pool))
    arrays["pool"][:used] = old.pool[:used]
    begins = log.begins.copy() if log.begins.size else log.begins
    named = {name: arrays[name] for name in ("junctions", "nodes", "ends", "contacts", "events")}
    pieces = arrays["pieces"].reshape(log.pieces.shape)
    return log._replace(memory=old._replace(**arrays), state=arrays["state"][0], pieces=pieces, begins=begins, **named)


def empty_log(junctions: int, nodes: int, ends: int, contacts: int, rows: int) -> Log:
    """Return a log of zeros for a network of some size.

    ``rows`` is the number of rows in a piece. It has no room for pieces and events.
    """
    states, state = columns(StateRecord, 1)
    of_junctions, junction = columns(JunctionRecord, junctions)
    of_nodes, node = columns(NodeRecord, nodes)
    of_ends, end = columns(EndRecord, ends)
    of_contacts, contact = columns(ContactRecord, contacts)
    _, piece = columns(PieceRecord, 0)
    contact["branch"] = -1
    state["most"] = np.iinfo(np.int64).max
    tables = np.zeros((3, rows, ROOM))
    memory = MarchArrays(
        0, 0, states, of_junctions, of_nodes, of_ends, of_contacts, (), (), np.zeros(0),
        tables[0], tables[1], tables[2], np.zeros((MAX_DEPTH + 1, WIDTH)),
    )  # fmt: skip
    events = columns(EventRecord, 0)[1]
    return Log(memory, state[0], junction, node, end, contact, (), contact[:0], piece.reshape(junctions, 0), events)


def with_room(log: Log, pieces: int, pool: int, events: int) -> Log:
    """Return a log with room, more where it has less, for pieces, coefficients and events."""
    memory: dict[str, Any] = {}
    named: dict[str, Any] = {}
    count, old = log.pieces.shape
    if pieces > old:
        memory["pieces"], piece = columns(PieceRecord, count * pieces)
        named["pieces"] = piece.reshape(count, pieces)
        named["pieces"][:, :old] = log.pieces
    if events > len(log.events):
        memory["events"], named["events"] = columns(EventRecord, events)
        named["events"][: len(log.events)] = log.events
    if pool > len(log.pool):
        memory["pool"] = np.empty(pool)
        memory["pool"][: len(log.pool)] = log.pool
    return log._replace(memory=log.memory._replace(**memory), **named)


def grown(log: Log, status: int) -> Log:
    """Return the log with twice the room of the array that a march found full."""
    twice = [1 + (status == full) for full in (MORE_RECORDS, MORE_POOL, MORE_EVENTS)]
    return with_room(log, twice[0] * log.pieces.shape[1], twice[1] * len(log.pool), twice[2] * len(log.events))


def needed(log: Log, before: float) -> tuple[int, int]:
    """Return the numbers and the most pieces of a junction that `without` would keep."""
    numbers = most = 0
    for j, junction in enumerate(log.junctions):
        n, piece = int(junction["records"]), log.pieces[j]
        first = first_after(piece["stop"][:n], before)
        numbers += int(junction["rows"]) * int(piece["size"][first:n].sum())
        most = max(most, n - first)
    return numbers, most


def first_after(stop: Array, before: float) -> int:
    """Return the number of the first piece that ends ``before`` a time [s] or later; the last one is kept always."""
    return min(int(np.searchsorted(stop, before)), stop.size - 1)


def without(log: Log, before: float, until: float) -> Log:
    """Return the log without old pieces and events.

    Pieces that end ``before`` a time [s], and events up to ``until`` [s], are dropped.
    """
    count = len(log.junctions)
    used, parts = 0, []
    dropped = np.zeros(count, np.int64)
    for j, junction in enumerate(log.junctions):
        n, rows, piece = int(junction["records"]), int(junction["rows"]), log.pieces[j]
        first = first_after(piece["stop"][:n], before)
        kept = piece[first:n].copy()
        for size, offset in zip(kept["size"].tolist(), kept["offset"].tolist(), strict=True):
            parts.append(log.pool[offset : offset + rows * size].copy())
        kept["offset"] = used + rows * np.concatenate([[0], np.cumsum(kept["size"])[:-1]])
        used += rows * int(np.sum(kept["size"]))
        piece[: n - first] = kept
        log.junctions["records"][j] = n - first
        dropped[j] = first
    log.pool[:used] = np.concatenate(parts)
    log.ends["cursor"] -= dropped[log.ends["source"]]
    log.state["pool_used"] = used
    found = log.events[: int(log.state["events"])]
    for event in found[(found["time"] <= until) & (found["branch"] >= 0)]:
        for name in ("branch", "constant", "set"):
            log.begins[name][event["contact"]] = event[name]
    later = found[found["time"] > until]
    log.events[: len(later)] = later
    log.state["events"] = len(later)
    return log
