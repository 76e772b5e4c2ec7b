"""Arrays of a march with tangents, per parameter.

They are derivatives of the network's numbers, and of all pieces. A tangent is the derivative of a series at a fixed
place of its piece; the derivatives of the times where the piece begins and ends stand beside it. So a front that moves
with a parameter needs no delta function.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from impactlab.exact.kernel import ROOM
from impactlab.exact.setup.network import Log
from impactlab.types import Array, Ints

OF_STATE = ("gravity", "duration")
OF_NODES = ("mass", "u", "v", "spring", "dashpot", "end_force")
OF_ENDS = ("impedance", "transit")
OF_CONTACTS = ("stiffness", "damping", "gap")
AT_ONCE, CROSSED, BY_FRONT = range(3)  # how an event was found
GRAVITY, DURATION = range(2)
MASS, U, V, SPRING, DASHPOT, END_FORCE = range(6)
IMPEDANCE, TRANSIT = range(2)
STIFFNESS, DAMPING, GAP = range(3)


class Rates(NamedTuple):
    """Derivatives of the numbers of a network by P parameters."""

    state: Array  # (P, 2), order of OF_STATE
    nodes: Array  # (P, nodes, 6), order of OF_NODES
    ends: Array  # (P, ends, 2), order of OF_ENDS
    contacts: Array  # (P, contacts, 3), order of OF_CONTACTS
    first: Array  # (P, pieces, 2): start and stop of the pieces before t = 0, junction by junction
    pool: Array  # (P, coefficients) of those pieces, at their offsets
    scale: Array  # (P,): size of a parameter, for which a change of the motion by rounding is no change


class TangentArrays(NamedTuple):
    """All arrays of the tangents; pieces are numbered as in the march.

    Each junction has the same room.
    """

    scale: Array
    of_state: Array
    of_nodes: Array
    of_ends: Array
    of_contacts: Array
    clock: Array  # (junctions, P): derivative of the time that a junction has reached
    u: Array  # (P, nodes): of the displacements at that time
    v: Array  # (P, nodes): of the velocities; used of nodes with mass
    carried: Array  # (P, ends)
    moves: Array  # (pieces, 2, P): of start and stop of a piece
    size: Ints  # (pieces,): coefficients of a row
    offset: Ints  # (pieces,): into the pool
    used: Ints  # (2,): of the pool; coefficients of the rows that have ever been written
    pool: Array  # of a piece: parameter by parameter, row by row
    dated: Array  # (events, P): of the time of an event
    bend: Array  # (events, 3): first two time derivatives of the quantity that crossed zero, and 1 (`CROSSED`); or the
    # force after the front that parts the faces, 0 and 2 (`BY_FRONT`); or zeros, of faces that touch at once
    pull: Array  # (events, P): of that force
    steeper: Array  # (events, P): of the rate at which it crosses zero, at the event
    apart: Array  # (P,): largest jump of a wave times the speed at which it parts from another front, over its scale
    rows: Array  # (P, rows, ROOM): of the piece that is being made
    waves: Array  # (ends of a junction, ROOM)
    loads: Array  # (nodes of a junction, ROOM): of the groups, without tangents
    fronts: Array  # (ends of a junction, 2, ROOM): slopes of the waves that arrive, and x times these
    sizes: Ints  # (ends of a junction,): coefficients of the waves that arrive
    jumps: Array  # (ends of a junction,): of the waves at a front that arrives with the start of the interval
    pivots: Array  # (nodes of a junction, 4, ROOM): of the equations of nodes with mass, see `series.eliminate`
    orders: Ints  # (nodes of a junction,): for which they were made; 0 for none
    room: Array  # (4, ROOM): scratch
    springs: int  # address of the tangents of nodes on springs; 0 without springs


def tangent_arrays(log: Log, rates: Rates) -> TangentArrays:
    """Return the tangents' arrays, with the room of a log, at t = 0."""
    parameters = len(rates.state)
    junctions, room = log.pieces.shape
    nodes, ends = int(log.junctions["nodes"].max()), int(log.junctions["ends"].max())
    rows = int(log.junctions["rows"].max())
    pieces = junctions * room
    made = TangentArrays(
        rates.scale, rates.state, rates.nodes, rates.ends, rates.contacts,
        np.zeros((junctions, parameters)), rates.nodes[:, :, U].copy(), rates.nodes[:, :, V].copy(),
        np.zeros((parameters, rates.ends.shape[1])),
        np.zeros((pieces, 2, parameters)), np.zeros(pieces, np.int64), np.zeros(pieces, np.int64),
        np.zeros(2, np.int64), np.empty(parameters * len(log.pool)),
        np.zeros((len(log.events), parameters)), np.zeros((len(log.events), 3)),
        np.zeros((len(log.events), parameters)), np.zeros((len(log.events), parameters)), np.zeros(parameters),
        np.zeros((parameters, rows, ROOM)), np.zeros((max(1, ends), ROOM)), np.zeros((nodes, ROOM)),
        np.zeros((max(1, ends), 2, ROOM)),
        np.zeros(max(1, ends), np.int64), np.zeros(max(1, ends)),
        np.zeros((nodes, 4, ROOM)), np.zeros(nodes, np.int64), np.zeros((4, ROOM)), 0,
    )  # fmt: skip
    at, number = 0, 0
    for j in range(junctions):
        height = int(log.junctions["rows"][j])
        for k in range(int(log.junctions["records"][j])):
            size, offset = int(log.pieces["size"][j, k]), int(log.pieces["offset"][j, k])
            piece = room * j + k
            made.moves[piece] = rates.first[:, number].T
            made.size[piece], made.offset[piece] = size, at
            for q in range(parameters):
                made.pool[at : at + height * size] = rates.pool[q, offset : offset + height * size]
                at += height * size
            number += 1
    made.used[0] = at
    return made
