"""The scene as a network: nodes with mass, spring and dashpot, rods between them, contacts that may tie them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy import int64
from numpy.typing import NDArray

from impactlab.exact.arrays import (
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
from impactlab.numerics.records import columns, dtype_of
from impactlab.types import Array

Integers = NDArray[int64]


class Network(NamedTuple):
    """What the march needs of a scene. Nodes, ends and contacts are ordered by junction.

    Contacts of a junction stand in the order in which their forces are found: springs first, then the hard ones.
    A rod piece has two ends; an end receives what its peer emitted one transit earlier, plus half of gravity's gain on
    the way. Waves are velocities along +x: at an end, velocity of the node = arriving + emitted wave.
    """

    node_of: Integers  # (junctions + 1,) first node of each junction
    end_of: Integers  # (junctions + 1,)
    contact_of: Integers  # (junctions + 1,)
    mass: Array  # (nodes,) kg; inf where it never moves
    spring: Array  # (nodes,) N/m, to the ground
    dashpot: Array  # (nodes,) N s/m, to the ground
    push: Array  # (nodes,) N, end forces along +x
    end_node: Integers  # (ends,)
    end_peer: Integers  # (ends,)
    end_junction: Integers  # (ends,)
    impedance: Array  # (ends,) N s/m
    transit: Array  # (ends,) s
    left: Integers  # (contacts,) node on the left
    right: Integers  # (contacts,)
    face: Integers  # (contacts,) the node without mass of a hard contact, -1 for a spring
    stiffness: Array  # (contacts,) N/m; -1 for a hard contact
    damping: Array  # (contacts,) N s/m
    gap: Array  # (contacts,) m, gap of undisplaced nodes
    contact_impedance: Array  # (contacts,) N s/m, of the rods at the contact: scale of its force
    gravity: float  # m/s2
    duration: float  # s
    tolerance: float  # s, breaks nearer than this are one


class Log(NamedTuple):
    """What the march writes: views of its memory, which is kept when it returns for more room."""

    memory: MarchArrays
    clock: Array  # (junctions,) s, time reached
    u: Array  # (nodes,) m
    v: Array  # (nodes,) m/s
    records: Integers  # (junctions,) records so far
    start: Array  # (junctions, room) s
    stop: Array  # (junctions, room) s
    size: Integers  # (junctions, room) coefficients per row
    offset: Integers  # (junctions, room) into pool
    pool: Array  # (room,) Chebyshev coefficients
    event_time: Array  # (room,) s
    event_contact: Integers  # (room,)
    event_kind: Integers  # (room,) 1 close, 0 open
    tally: Integers  # (4,) pool used, events, intervals, intervals before the march returns
    scale: Array  # (2,) largest velocity [m/s], length below 1e-12 of which a gap is none [m]
    work: Array  # (1,) multiplications so far, about
    source: Integers  # (ends,) junction of the peer
    cursor: Integers  # (ends,) record of it that is arriving
    heights: Integers  # (junctions,) rows of a record


@dataclass(frozen=True)
class Link:
    """A uniform piece of a rod between two nodes."""

    x: float  # m, of its left end on the rod
    length: float  # m
    area: float  # m2
    young: float  # Pa
    density: float  # kg/m3
    left_end: int  # emits the waves that travel to the right
    right_end: int

    @property
    def wave_speed(self) -> float:
        """Speed of axial waves [m/s]."""
        return float((self.young / self.density) ** 0.5)

    @property
    def transit(self) -> float:
        """Time of a wave from end to end [s]."""
        return self.length / self.wave_speed


@dataclass(frozen=True)
class Layout:
    """Where the bodies of a scene sit in its network."""

    network: Network
    links: dict[str, tuple[Link, ...]]  # rods, from left to right
    nodes: dict[str, tuple[int, ...]]  # every body: its nodes (rods: from left to right; walls: one per contact)
    node_junction: Integers  # (nodes,)
    places: Integers  # contact of the network -> contact of the scene


def log_of(net: Network, u: Array, v: Array, room: int, pool: int, events: int) -> Log:
    """Return a log without records, and its memory with all that the march needs of the network."""
    count = len(net.node_of) - 1
    states, state = columns(StateRecord, 1)
    junctions, junction = columns(JunctionRecord, count)
    nodes, node = columns(NodeRecord, len(net.mass))
    ends, end = columns(EndRecord, len(net.transit))
    contacts, contact = columns(ContactRecord, len(net.left))
    state["most"] = np.iinfo(np.int64).max
    state["gravity"], state["duration"], state["tolerance"] = net.gravity, net.duration, net.tolerance
    junction["burst"] = -np.inf
    for kind, of in (("node", net.node_of), ("end", net.end_of), ("contact", net.contact_of)):
        junction[f"first_{kind}"], junction[f"last_{kind}"] = of[:-1], of[1:]
    node["mass"], node["spring"], node["dashpot"], node["push"] = net.mass, net.spring, net.dashpot, net.push
    node["u"], node["v"] = u, v
    source = net.end_junction[net.end_peer]
    end["node"], end["source"], end["impedance"], end["transit"] = net.end_node, source, net.impedance, net.transit
    end["row"] = 2 * (net.node_of[source + 1] - net.node_of[source]) + net.end_peer - net.end_of[source]
    contact["left"], contact["right"], contact["face"], contact["gap"] = net.left, net.right, net.face, net.gap
    contact["stiffness"], contact["damping"] = net.stiffness, net.damping
    contact["impedance"] = net.contact_impedance
    before = 2 * net.node_of + 2 * net.end_of + net.contact_of
    tables = np.zeros((3, int((before[1:] - before[:-1]).max()), ROOM))
    memory = MarchArrays(
        0, states, junctions, nodes, ends, contacts, (), (), np.empty(pool),
        tables[0], tables[1], tables[2], np.zeros((MAX_DEPTH + 1, WIDTH)),
    )  # fmt: skip
    place = {name: offset for name, (_, offset) in dtype_of(StateRecord).fields.items()}  # bytes
    tally = np.ndarray((4,), np.int64, state, place["pool_used"])
    scale = np.ndarray((2,), np.float64, state, place["fastest"])
    work = np.ndarray((1,), np.float64, state, place["work"])
    none, nothing = np.zeros((count, 0)), np.zeros((count, 0), np.int64)
    never, no_event = np.zeros(0), np.zeros(0, np.int64)
    return widened(
        Log(
            memory, junction["clock"], node["u"], node["v"], junction["records"],
            none, none, nothing, nothing, memory.pool, never, no_event, no_event, tally, scale, work,
            end["source"], end["cursor"], before[1:] - before[:-1],
        ), room, events,
    )  # fmt: skip


def widened(log: Log, room: int, events: int) -> Log:
    """Return the log with room for so many records per junction and events."""
    count, old = log.start.shape
    memory = log.memory
    if room > old:
        pieces, piece = columns(PieceRecord, count * room)
        table = piece.reshape(count, room)
        for name, column in (("start", log.start), ("stop", log.stop), ("size", log.size), ("offset", log.offset)):
            table[name][:, :old] = column
        memory = memory._replace(pieces=pieces)
        log = log._replace(start=table["start"], stop=table["stop"], size=table["size"], offset=table["offset"])
    if events > len(log.event_time):
        dated, event = columns(EventRecord, events)
        for name, column in (("time", log.event_time), ("contact", log.event_contact), ("kind", log.event_kind)):
            event[name][: len(column)] = column
        memory = memory._replace(events=dated)
        log = log._replace(event_time=event["time"], event_contact=event["contact"], event_kind=event["kind"])
    return log._replace(memory=memory)


def grown(log: Log, pieces: bool, pool: bool, events: bool) -> Log:
    """Return the log with twice the room where asked."""
    if pool:
        wider = np.empty(2 * len(log.pool))
        wider[: len(log.pool)] = log.pool
        log = log._replace(pool=wider, memory=log.memory._replace(pool=wider))
    room, dated = log.start.shape[1], len(log.event_time)
    return widened(log, 2 * room if pieces else room, 2 * dated if events else dated)


def without(log: Log, before: float, until: float) -> Log:
    """Return the log without the records that end before a time, and without the events up to another [s]."""
    count = len(log.clock)
    used, parts = 0, []
    dropped = np.zeros(count, np.int64)
    for j in range(count):
        n = int(log.records[j])
        first = min(int(np.searchsorted(log.stop[j, :n], before)), n - 1)
        sizes, offsets = log.size[j, first:n].copy(), log.offset[j, first:n].copy()
        rows = log.heights[j]
        for size, offset in zip(sizes.tolist(), offsets.tolist(), strict=True):
            parts.append(log.pool[offset : offset + rows * size].copy())
        for column in (log.start, log.stop, log.size):
            column[j, : n - first] = column[j, first:n].copy()
        log.offset[j, : n - first] = used + rows * np.concatenate([[0], np.cumsum(sizes)[:-1]])
        used += rows * int(np.sum(sizes))
        log.records[j] = n - first
        dropped[j] = first
    log.pool[:used] = np.concatenate(parts)
    log.cursor[:] -= dropped[log.source]
    log.tally[0] = used
    events = int(log.tally[1])
    later = np.flatnonzero(log.event_time[:events] > until)
    for column in (log.event_time, log.event_contact, log.event_kind):
        column[: len(later)] = column[later]
    log.tally[1] = len(later)
    return log
