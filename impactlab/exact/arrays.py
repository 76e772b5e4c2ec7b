"""Arrays of the march: named records and flat arrays, allocated before it starts.

A record is a C structure that the compiled march and plain Python read under the same names.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import NamedTuple

from impactlab.numerics.tables import by_table
from impactlab.structures import record
from impactlab.types import Array

CLOSE, OPEN, CHANGE = 1, 0, 2  # kinds of events; of one found, CHANGE and more: the end of a branch that was met
# Statuses of the march: the end, a full array, or the reason of a stop.
DONE, MORE_RECORDS, MORE_POOL, MORE_EVENTS, TOO_MANY, UNRESOLVED, PAUSED = 0, 1, 2, 3, 4, 5, 6


@record
class StateRecord(ctypes.Structure):
    """The run as a whole."""

    gravity: float  # m/s2
    duration: float  # s
    tolerance: float  # s, breaks nearer than this are one
    resolved: int  # 1 if the equations of nodes on springs were resolved
    contact: int  # of the event that was found, or -1
    kind: int  # of that event: 1 close, 0 open, from 2 on the end of a branch that was met
    place: float  # in [-1, 1] of the first event so far, handed to the search among branches and back
    pool_used: int
    events: int
    intervals: int
    most: int  # intervals before the march returns
    fastest: float  # m/s, largest velocity
    farthest: float  # m; gaps below 1e-12 of it count as zero
    work: float  # multiplications so far, about


@record
class JunctionRecord(ctypes.Structure):
    """Nodes that contacts may tie together, with their ends and contacts.

    They are ranges from the first to before the last.
    """

    first_node: int
    last_node: int
    first_end: int
    last_end: int
    first_contact: int
    last_contact: int
    records: int  # so far
    bursts: int  # events in the present series
    broken: int  # 1 from an event on until the next piece
    shifted: float  # m, by which short intervals that the last piece has absorbed may have moved nodes
    clock: float  # s, time reached
    burst: float  # s, start of the present series of events
    nodes: int  # how many
    ends: int
    rows: int  # of a piece: two for each node and each end, one for each contact
    branched: int  # 1 where a contact has a law with branches
    loaded: int  # 1 where a force over time acts on a node


@record
class NodeRecord(ctypes.Structure):
    """A node, and the group of nodes that closed hard contacts form."""

    mass: float  # kg; inf where it never moves
    spring: float  # N/m, to the ground
    dashpot: float  # N s/m, to the ground
    end_force: float  # N, end force along +x: constant, or in the middle of the present interval
    end_force_rise: float  # N, from the middle of that interval to its end
    first_sample: int  # of a force over time, a row of `load`
    last_sample: int  # after it
    sample: int  # next one
    u: float  # m
    v: float  # m/s
    group: int  # node whose group it is in
    bare: int  # 1 where the group has no mass, or never moves
    group_mass: float  # kg, of the group that carries this node's number
    drag: float  # N s/m, of dashpots and rods at that group
    place: int  # of that group among the unknowns of the springs, -1 for none
    junction: int


@record
class EndRecord(ctypes.Structure):
    """An end of a rod piece, and the wave that arrives there.

    Its peer emitted the wave one transit earlier. Waves are velocities along +x: at an end, velocity of the node =
    arriving + emitted wave. On the way half of gravity's gain is added.
    """

    node: int
    junction: int
    source: int  # junction of the peer
    row: int  # of the peer's wave in the records there
    cursor: int  # record that is arriving
    impedance: float  # N s/m
    transit: float  # s
    carried: float  # m, time integral of the emitted wave


@record
class ContactRecord(ctypes.Structure):
    """A contact of two nodes.

    Contacts of a junction stand in the order in which their forces are found.
    """

    left: int  # node
    right: int
    face: int  # the node without mass of a hard contact, -1 for a spring
    closed: int  # 1 or 0
    stiffness: float  # N/m; -1 for a hard contact
    damping: float  # N s/m
    gap: float  # m, of undisplaced nodes
    impedance: float  # N s/m, of the rods at the contact: scale of its force
    branch: (
        int  # row of the stack with the branch, whose stiffness and damping it has now; -1 of a law without branches
    )
    constant: float  # N, force of the branch at zero approach
    elastic: float  # N/m: branches of this stiffness hold the set
    set: float  # m
    kept: float  # N/m, of kinematic hardening
    largest: float  # N, static force at ends of branches so far


@record
class PieceRecord(ctypes.Structure):
    """A piece of all signals of a junction."""

    start: float  # s
    stop: float  # s
    size: int  # coefficients per row
    offset: int  # into the pool


@record
class EventRecord(ctypes.Structure):
    """An event."""

    time: float
    contact: int
    kind: int  # 1 close, 0 open, 2 another change of branch
    branch: int  # row of the stack with the branch that begins, -1 of a law without branches
    constant: float  # N, of the branch that begins
    set: float  # m, when it begins


@by_table
class MarchArrays(NamedTuple):
    """All arrays of the march; rows of the tables are Chebyshev series."""

    coupled: int  # address of the solver of nodes on springs; 0 without springs
    changes: int  # address of the search for ends of branches; 0 without branches
    state: Sequence[StateRecord]  # (1,)
    junctions: Sequence[JunctionRecord]
    nodes: Sequence[NodeRecord]
    ends: Sequence[EndRecord]
    contacts: Sequence[ContactRecord]
    pieces: Sequence[PieceRecord]  # the same room for each junction
    events: Sequence[EventRecord]
    pool: Array  # coefficients of all pieces
    rows: Array  # the record of a junction that is being made
    waves: Array  # arriving at its ends
    load: Array  # on its groups; then samples of forces over time, time [s] and force [N] in a row each
    stack: Array  # room for searches; then a trial; then the branches of laws: an array more makes every call slower
