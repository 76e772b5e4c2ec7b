"""Changes of branch: the end that is met first, and the next branch.

They are compiled separately. Laws are tables here (`impactlab.contact.branches`); none is known by name.
"""

from __future__ import annotations

from numba import types

from impactlab.exact.arrays import CHANGE, CLOSE, OPEN, MarchArrays
from impactlab.exact.crossings import increase_if_rigid, least_force
from impactlab.exact.kernel import MAX_DEPTH, ZERO_TOL, first_crossing
from impactlab.exact.setup.branch_tables import (
    ACTS,
    APPROACH,
    DAMPING,
    ENDS,
    FORCE,
    NEXT,
    OF,
    REMEMBERED,
    SLOPE,
    STATIC,
    STIFFNESS,
    UNTIL,
    VALUE,
    WAY,
    WIDE,
)
from impactlab.numerics.addresses import address_for
from impactlab.numerics.compiling import EXACT_INLINE, EXACT_PART
from impactlab.types import Array


@EXACT_PART
def threshold(m: MarchArrays, c: int, until: Array) -> float:
    """Return the value, moved by the law's memory, that the quantity of an end passes."""
    contact = m.contacts[c]
    kept = contact.set if until[OF] == APPROACH else contact.largest
    return float(until[VALUE] + until[REMEMBERED] * kept)


@EXACT_PART
def beyond(m: MarchArrays, j: int, c: int, until: Array, n: int) -> float:
    """Write the distance of a quantity to its value to the trial row; return its tolerance."""
    state, junction, contact = m.state[0], m.junctions[j], m.contacts[c]
    base, nodes = junction.first_node, junction.nodes
    a, b = contact.left - base, contact.right - base
    trial = m.stack[MAX_DEPTH]
    no_force = least_force(m, j, c, n)
    by_approach = by_rate = constant = 0.0
    if until[OF] == STATIC:
        by_approach, constant, floor = contact.stiffness - until[SLOPE], contact.constant, no_force
    elif until[OF] == FORCE:
        by_approach, by_rate, constant = contact.stiffness, contact.damping, contact.constant
        floor = no_force if contact.closed == 1 else no_force * (1.0 + increase_if_rigid(m, c))
    elif until[OF] == APPROACH:
        by_approach, floor = 1.0, ZERO_TOL * state.farthest
    else:
        by_rate, floor = 1.0, no_force / contact.impedance
    for k in range(n):
        trial[k] = by_approach * (m.rows[nodes + a, k] - m.rows[nodes + b, k]) + by_rate * (m.rows[a, k] - m.rows[b, k])
        trial[k] *= -until[WAY]
    trial[0] -= until[WAY] * (constant - by_approach * contact.gap - threshold(m, c, until))
    return float(floor)


@EXACT_INLINE
def find(m: MarchArrays, j: int, n: int) -> None:
    """Write contact, kind and place of the first end that is met before ``state.place``."""
    state, junction = m.state[0], m.junctions[j]
    for c in range(junction.first_contact, junction.last_contact):
        contact = m.contacts[c]
        if contact.branch >= 0:
            branch = m.stack[contact.branch]
            for e in range(int(branch[ENDS])):
                floor = beyond(m, j, c, branch[UNTIL + WIDE * e :], n)
                place = first_crossing(m.stack[MAX_DEPTH], n, floor, m.stack)
                if place < state.place:
                    state.place, state.contact, state.kind = place, c, CHANGE + e


@EXACT_INLINE
def change(m: MarchArrays) -> None:
    """Take the event's contact to its next branch, and the event to that kind."""
    state = m.state[0]
    contact = m.contacts[state.contact]
    until = m.stack[contact.branch][UNTIL + WIDE * (state.kind - CHANGE) :]
    following = int(until[NEXT])
    branch = m.stack[following]
    approach = m.nodes[contact.left].u - m.nodes[contact.right].u - contact.gap
    value = threshold(m, state.contact, until)
    if until[OF] == STATIC:  # on a line of the slope of the next branch, exactly
        contact.constant = value + (until[SLOPE] - branch[STIFFNESS]) * approach
        static = value + until[SLOPE] * approach
    else:
        if until[OF] == APPROACH:
            approach = value
        static = contact.constant + contact.stiffness * approach
        if contact.stiffness != branch[STIFFNESS]:
            contact.constant = static - branch[STIFFNESS] * approach
    contact.largest = max(contact.largest, abs(static))
    if branch[STIFFNESS] == contact.elastic:
        contact.set = 0.0 - contact.constant / contact.elastic
    acts = int(branch[ACTS])
    state.kind = CHANGE
    if acts != contact.closed:
        state.kind = CLOSE if acts == 1 else OPEN
    contact.branch, contact.closed = following, acts
    contact.stiffness, contact.damping = branch[STIFFNESS], branch[DAMPING]


def changes(m: MarchArrays, j: int, n: int) -> None:
    """Find the first end of a branch in n coefficients of junction j.

    With n < 0, change the branch that was found.
    """
    if n < 0:
        change(m)
    else:
        find(m, j, n)


def address(m: MarchArrays) -> int:
    """Return the address of `changes`, compiled when a scene first needs it."""
    return address_for(changes, (m,), (types.int64, types.int64))
