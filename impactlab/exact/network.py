"""The scene as a network: nodes with mass, spring and dashpot, rods between them, contacts that may tie them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from numpy import float64, int64
from numpy.typing import NDArray

from impactlab.types import Array

Integers = NDArray[int64]
Number = TypeVar("Number", int64, float64)


class Network(NamedTuple):
    """What the march needs of a scene. Nodes, ends and contacts are ordered by junction.

    A rod piece has two ends; an end receives what its peer emitted one transit earlier, plus half of gravity's gain on
    the way. Waves are velocities along +x: at an end, velocity of the node = arriving + emitted wave.
    """

    node_of: Integers  # (junctions + 1,) first node of each junction
    end_of: Integers  # (junctions + 1,)
    contact_of: Integers  # (junctions + 1,)
    mass: Array  # (nodes,) kg; inf where it never moves
    spring: Array  # (nodes,) N/m, to the ground
    dashpot: Array  # (nodes,) N s/m, to the ground
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
    unknowns: int  # most unknowns of a coupled junction


class Log(NamedTuple):
    """What the march writes; all arrays are kept when it returns for more room."""

    clock: Array  # (junctions,) s, time reached
    u: Array  # (nodes,) m
    v: Array  # (nodes,) m/s
    carried: Array  # (ends,) m, time integral of the emitted wave
    closed: Integers  # (contacts,) 1 or 0
    cursor: Integers  # (ends,) record of the peer that is arriving
    records: Integers  # (junctions,) records so far
    start: Array  # (junctions, room) s
    stop: Array  # (junctions, room) s
    size: Integers  # (junctions, room) coefficients per row
    offset: Integers  # (junctions, room) into pool
    pool: Array  # (room,) Chebyshev coefficients
    event_time: Array  # (room,) s
    event_contact: Integers  # (room,)
    event_kind: Integers  # (room,) 1 close, 0 open
    tally: Integers  # (3,) pool used, events, intervals
    scale: Array  # (2,) largest velocity [m/s], length below 1e-12 of which a gap is none [m]
    burst: Array  # (junctions,) s, start of the present series of events
    bursts: Integers  # (junctions,) events in it


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


def grown(log: Log, records: bool, pool: bool, events: bool) -> Log:
    """Return the log with twice the room where asked."""

    def wide(a: NDArray[Number], grow: bool) -> NDArray[Number]:
        return np.concatenate([a, np.zeros_like(a)], axis=-1) if grow else a

    return Log(
        log.clock, log.u, log.v, log.carried, log.closed, log.cursor, log.records,
        wide(log.start, records), wide(log.stop, records), wide(log.size, records), wide(log.offset, records),
        wide(log.pool, pool),
        wide(log.event_time, events), wide(log.event_contact, events), wide(log.event_kind, events),
        log.tally, log.scale, log.burst, log.bursts,
    )  # fmt: skip
