"""Times before which no contact can close, compiled: as `impactlab.history.arrivals`."""

from __future__ import annotations

import numpy as np

from impactlab.exact.arrays import MarchArrays
from impactlab.exact.batch.pattern import FIXED, Pattern
from impactlab.exact.batch.writing import velocity_of
from impactlab.numerics.compiling import EXACT_PART
from impactlab.types import Array


@EXACT_PART
def travel_time(m: MarchArrays, q: Pattern, a: int, b: int) -> float:
    """Return the time of a wave between two nodes of a body [s]; 0 if rigid."""
    body, total, inside = q.bodies[q.nodes[a].body], 0.0, False
    if a == b:
        return 0.0
    for k in range(body.first_link, body.last_link):  # from left to right
        left, right = m.ends[q.links[k].left_end].node, m.ends[q.links[k].right_end].node
        inside = inside != (left in (a, b))
        if inside:
            total += m.ends[q.links[k].left_end].transit
        if right in (a, b):
            break
    return total


@EXACT_PART
def flight_time(m: MarchArrays, q: Pattern, p: Array, c: int) -> float:
    """Return when two faces meet if no wave comes [s].

    It is inf where they rest or separate, 0 where this is not known.
    """
    left, right, gap = q.contacts[c].left_body, q.contacts[c].right_body, m.contacts[c].gap
    for b in (left, right):  # a held body that moves at the start strikes its own clamp
        if q.bodies[b].held == 1 and velocity_of(q, p, b) != 0.0:
            return 0.0
    closing = velocity_of(q, p, left) - velocity_of(q, p, right)
    if m.state[0].gravity != 0.0 or gap < 0.0 or (gap == 0.0 and closing != 0.0):
        return 0.0
    return gap / closing if closing > 0.0 else np.inf


@EXACT_PART
def from_loads(m: MarchArrays, q: Pattern, node: int) -> float:
    """Return when forces on the ends of its body reach a node [s]; inf without any."""
    first = np.inf
    for n in range(len(m.nodes)):
        if m.nodes[n].end_force != 0.0 and q.nodes[n].kind != FIXED and q.nodes[n].body == q.nodes[node].body:
            first = min(first, travel_time(m, q, node, n))
    return first


@EXACT_PART
def pass_on(m: MarchArrays, q: Pattern, c: int, other: int, arrivals: Array) -> None:
    """Let a wave run from one contact to another through a body that has both."""
    for node in (m.contacts[c].left, m.contacts[c].right):
        for start in (m.contacts[other].left, m.contacts[other].right):
            body = q.nodes[node].body
            if body == q.nodes[start].body and q.bodies[body].place >= 0:
                arrivals[c] = min(arrivals[c], arrivals[other] + travel_time(m, q, node, start))


@EXACT_PART
def first_arrivals(m: MarchArrays, q: Pattern, p: Array, arrivals: Array) -> None:
    """Write for each contact the time [s] before which nothing can have reached it."""
    contacts, at_once = len(m.contacts), True
    for c in range(contacts):
        arrivals[c] = flight_time(m, q, p, c)
        at_once = at_once and arrivals[c] == 0.0
    if at_once:
        return
    for c in range(contacts):
        sooner = min(from_loads(m, q, m.contacts[c].left), from_loads(m, q, m.contacts[c].right))
        arrivals[c] = min(arrivals[c], sooner)
    for _ in range(contacts):
        for c in range(contacts):
            for other in range(contacts):
                pass_on(m, q, c, other, arrivals)
    for c in range(contacts):
        if arrivals[c] == np.inf:
            arrivals[c] = 0.0
