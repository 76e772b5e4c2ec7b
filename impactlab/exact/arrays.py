"""The memory of the march: records with names and a few flat arrays, made before it starts.

A record is a C structure: the compiled march and plain Python read it under the same names.
"""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

import numpy as np

from impactlab.numerics.addresses import COMPILED
from impactlab.types import Array

INTEGER, REAL = ctypes.c_int64, ctypes.c_double


class StateRecord(ctypes.Structure):
    """The run as a whole."""

    _fields_ = [
        ("gravity", REAL),  # m/s2
        ("duration", REAL),  # s
        ("tolerance", REAL),  # s, breaks nearer than this are one
        ("resolved", INTEGER),  # 1 where what solves springs could
        ("contact", INTEGER),  # of the event that was found, or -1
        ("kind", INTEGER),  # of that event
        ("pool_used", INTEGER),
        ("events", INTEGER),
        ("intervals", INTEGER),
        ("most", INTEGER),  # intervals before the march returns
        ("fastest", REAL),  # m/s, largest velocity
        ("farthest", REAL),  # m, length below 1e-12 of which a gap is none
        ("work", REAL),  # multiplications so far, about
    ]


class JunctionRecord(ctypes.Structure):
    """Nodes that contacts may tie together, their ends and contacts: ranges from first to before last."""

    _fields_ = [
        *((f"{which}_{kind}", INTEGER) for kind in ("node", "end", "contact") for which in ("first", "last")),
        ("records", INTEGER),  # so far
        ("bursts", INTEGER),  # events in the present series
        ("broken", INTEGER),  # 1 from an event on until the next piece
        ("clock", REAL),  # s, time reached
        ("burst", REAL),  # s, start of the present series of events
    ]


class NodeRecord(ctypes.Structure):
    """A node, and the group of nodes that hard contacts make it part of at the moment."""

    _fields_ = [
        ("mass", REAL),  # kg; inf where it never moves
        ("spring", REAL),  # N/m, to the ground
        ("dashpot", REAL),  # N s/m, to the ground
        ("push", REAL),  # N, end force along +x
        ("u", REAL),  # m
        ("v", REAL),  # m/s
        ("group", INTEGER),  # node whose group it is in
        ("bare", INTEGER),  # 1 where the group has no mass, or never moves
        ("group_mass", REAL),  # kg, of the group that carries this node's number
        ("drag", REAL),  # N s/m, of dashpots and rods at that group
        ("place", INTEGER),  # of that group among the unknowns of the springs, -1 for none
    ]


class EndRecord(ctypes.Structure):
    """An end of a rod piece, and what arrives there: emitted by its peer one transit earlier."""

    _fields_ = [
        ("node", INTEGER),
        ("source", INTEGER),  # junction of the peer
        ("row", INTEGER),  # of the peer's wave in the records there
        ("cursor", INTEGER),  # record that is arriving
        ("impedance", REAL),  # N s/m
        ("transit", REAL),  # s
        ("carried", REAL),  # m, time integral of the emitted wave
    ]


class ContactRecord(ctypes.Structure):
    """A contact of two nodes."""

    _fields_ = [
        ("left", INTEGER),  # node
        ("right", INTEGER),
        ("face", INTEGER),  # the node without mass of a hard contact, -1 for a spring
        ("closed", INTEGER),  # 1 or 0
        ("stiffness", REAL),  # N/m; -1 for a hard contact
        ("damping", REAL),  # N s/m
        ("gap", REAL),  # m, of undisplaced nodes
        ("impedance", REAL),  # N s/m, of the rods at the contact: scale of its force
    ]


class PieceRecord(ctypes.Structure):
    """A piece of all signals of a junction."""

    _fields_ = [
        ("start", REAL),  # s
        ("stop", REAL),  # s
        ("size", INTEGER),  # coefficients per row
        ("offset", INTEGER),  # into the pool
    ]


class EventRecord(ctypes.Structure):
    """An event."""

    _fields_ = [("time", REAL), ("contact", INTEGER), ("kind", INTEGER)]  # s; kind 1 close, 0 open


class Memory(NamedTuple):
    """All that the march touches; rows of the tables are Chebyshev series."""

    coupled: int  # address of what solves springs; 0 where there are none
    state: Any  # (1,) of StateRecord
    junctions: Any  # of JunctionRecord
    nodes: Any  # of NodeRecord
    ends: Any  # of EndRecord
    contacts: Any  # of ContactRecord
    pieces: Any  # of PieceRecord, the same room for each junction
    events: Any  # of EventRecord
    pool: Array  # coefficients of all pieces
    rows: Array  # the record of a junction that is being made
    waves: Array  # arriving at its ends
    load: Array  # on its groups
    stack: Array  # room for searches; the last row is a trial


DTYPES: dict[type[ctypes.Structure], Any] = {
    kind: np.dtype(kind)
    for kind in (StateRecord, JunctionRecord, NodeRecord, EndRecord, ContactRecord, PieceRecord, EventRecord)
}


def records(kind: type[ctypes.Structure], count: int) -> tuple[Any, Any]:
    """Return room for records in the form the march takes, and the same memory as an array with named columns."""
    dtype = DTYPES[kind]
    if COMPILED:
        array = np.zeros(count, dtype)
        return array, array
    structures: Any = (kind * count)()
    return structures, np.frombuffer(structures, dtype) if count else np.zeros(0, dtype)
