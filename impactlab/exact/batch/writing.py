"""Compiled code that writes a vector's network at t = 0 into arrays.

The arrays are those of a march. The formulas and their order are those of `impactlab.exact.setup.build` and
`impactlab.exact.setup.initial_waves`: the network has the same bits.
"""

from __future__ import annotations

import math

import numpy as np

from impactlab.exact.arrays import MarchArrays
from impactlab.exact.batch.pattern import END, FIXED, RIGID, Pattern
from impactlab.exact.setup.build import MERGE_TOL, SAME_CUT
from impactlab.numerics.compiling import EXACT_PART
from impactlab.types import Array

LENGTH, AREA, YOUNG, DENSITY = 0, 1, 2, 3  # numbers of a segment
MASS, SPRING, DASHPOT = 1, 2, 3  # supports of ends
FIRST_SIZE = 3  # coefficients of the piece before t = 0


@EXACT_PART
def wave_speed(p: Array, segment: int) -> float:
    """Return sqrt(E/rho) of a segment [m/s]."""
    return math.sqrt(p[segment + YOUNG] / p[segment + DENSITY])


@EXACT_PART
def impedance(p: Array, segment: int) -> float:
    """Return rho c A of a segment [N s/m]."""
    return float(p[segment + DENSITY] * wave_speed(p, segment) * p[segment + AREA])


@EXACT_PART
def round_trip(q: Pattern, p: Array, body: int) -> float:
    """Return 2 L/c of a rod, summed over its segments [s]."""
    trip = 0.0
    first = q.bodies[body].first_segment
    for k in range(q.bodies[body].segments):
        trip += 2.0 * p[first + 4 * k + LENGTH] / wave_speed(p, first + 4 * k)
    return trip


@EXACT_PART
def round_trip_at(q: Pattern, p: Array, contact: int) -> float:
    """Return the round trip by which a contact is measured [s], as `impactlab.scene.facts.round_trips_of`."""
    own = shortest = math.inf
    for body in range(len(q.bodies)):
        if q.bodies[body].rigid == 0:
            trip = round_trip(q, p, body)
            shortest = min(shortest, trip)
            if body in (q.contacts[contact].left_body, q.contacts[contact].right_body):
                own = min(own, trip)
    return own if own < math.inf else shortest


@EXACT_PART
def velocity_of(q: Pattern, p: Array, b: int) -> float:
    """Return the velocity of a body at t = 0 [m/s]."""
    body = q.bodies[b]
    if body.place < 0:
        return 0.0
    return float(p[body.first + body.rigid])


@EXACT_PART
def write_ends(m: MarchArrays, q: Pattern, p: Array, places: Array) -> bool:
    """Write impedance and transit of all ends.

    Return whether the cuts of each rod keep their order. ``places`` is room for the places of all cuts [m].
    """
    for b in range(len(q.bodies)):
        body = q.bodies[b]
        for at in range(body.first_cut, body.first_cut + body.cuts):
            places[at] = 0.0
            if q.cuts[at] < 0:
                places[at] = q.fixed[-1 - q.cuts[at]]
            for k in range(q.cuts[at]):
                places[at] += p[body.first_segment + 4 * k + LENGTH]
        last = body.first_cut + body.cuts - 1
        for at in range(body.first_cut, last):
            if places[at + 1] - places[at] <= SAME_CUT * places[last]:
                return False
    for k in range(len(q.links)):
        link = q.links[k]
        z, time = impedance(p, link.segment), (places[link.cut + 1] - places[link.cut]) / wave_speed(p, link.segment)
        left, right = m.ends[link.left_end], m.ends[link.right_end]
        left.impedance, left.transit, left.carried, left.cursor = z, time, 0.0, 0
        right.impedance, right.transit, right.carried, right.cursor = z, time, 0.0, 0
    return True


@EXACT_PART
def write_nodes(m: MarchArrays, q: Pattern, p: Array, tolerance: float) -> None:
    """Write the nodes at t = 0."""
    for n in range(len(q.nodes)):
        of, node = q.nodes[n], m.nodes[n]
        node.mass = node.v = node.u = node.spring = node.dashpot = node.end_force = 0.0
        if of.kind == FIXED:
            node.mass = np.inf
        elif of.kind == RIGID:
            node.mass, node.v = p[of.value], p[of.velocity]
        elif of.kind == END:
            node.end_force = p[of.force]
            if of.support == MASS:
                node.mass = p[of.value]
                node.v = p[of.velocity] if node.mass > 0.0 else 0.0
            elif of.support == SPRING:
                node.spring = p[of.value]
            elif of.support == DASHPOT:
                node.dashpot = p[of.value]
    for e in range(len(m.ends)):  # a mass that only delays an echo by less than rounding is neglected
        node = m.nodes[m.ends[e].node]
        if 0.0 < node.mass <= m.ends[e].impedance * tolerance:
            node.mass = node.v = 0.0


@EXACT_PART
def rods_at(m: MarchArrays, node: int) -> float:
    """Return the impedance of the rod pieces that meet in a node [N s/m]."""
    total = 0.0
    for e in range(len(m.ends)):
        if m.ends[e].node == node:
            total += m.ends[e].impedance
    return total


@EXACT_PART
def write_contacts(m: MarchArrays, q: Pattern, p: Array) -> None:
    """Write the contacts at t = 0: all open."""
    for c in range(len(q.contacts)):
        of, contact = q.contacts[c], m.contacts[c]
        contact.gap, contact.stiffness, contact.damping = p[of.number], p[of.number + 1], p[of.number + 2]
        contact.closed = 0
        sides_left, sides_right = rods_at(m, contact.left), rods_at(m, contact.right)
        scale = max(sides_left, sides_right)
        contact.face = -1
        if of.hard == 1:
            right = of.bare_right == 1
            if right and of.bare_left == 1:
                right = sides_right < sides_left
            contact.face = contact.right if right else contact.left
            if (of.right_alone if right else of.left_alone) == 1:
                scale = sides_right if right else sides_left
        if not scale > 0.0:
            series = 1.0 / m.nodes[contact.left].mass + 1.0 / m.nodes[contact.right].mass
            scale = max(contact.damping, math.sqrt(contact.stiffness / series))
        contact.impedance = scale


@EXACT_PART
def write_first_pieces(m: MarchArrays, speeds: Array) -> None:
    """Write the pieces of waves in rods with uniform motion at t = 0.

    ``speeds`` [m/s] are by end.
    """
    state = m.state[0]
    room, used = len(m.pieces) // len(m.junctions), 0
    for j in range(len(m.junctions)):
        junction = m.junctions[j]
        junction.records = junction.bursts = junction.broken = 0
        junction.clock, junction.burst = 0.0, -np.inf
        if junction.ends == 0:
            continue
        first, lag = 2 * junction.nodes, 0.0
        for e in range(junction.first_end, junction.last_end):
            lag = max(lag, m.ends[e].transit)
        junction.records = 1
        piece = m.pieces[room * j]
        piece.start, piece.stop, piece.size, piece.offset = -lag, 0.0, FIRST_SIZE, used
        for at in range(used, used + FIRST_SIZE * junction.rows):
            m.pool[at] = 0.0
        for e in range(junction.ends):
            wave = used + FIRST_SIZE * (first + e)
            carried = wave + FIRST_SIZE * junction.ends
            m.pool[wave] = 0.5 * speeds[junction.first_end + e] + 0.25 * state.gravity * (-lag + 0.0)
            m.pool[wave + 1] = 0.25 * state.gravity * (0.0 + lag)
            half = 0.5 * (0.0 + lag)
            m.pool[carried + 1] = half * (2.0 * m.pool[wave] - 0.0) / 2.0
            m.pool[carried + 2] = half * (m.pool[wave + 1] - 0.0) / 4.0
            m.pool[carried] = 0.0 - (m.pool[carried + 1] + m.pool[carried + 2])
        used += FIRST_SIZE * junction.rows
    state.pool_used = used


@EXACT_PART
def write(m: MarchArrays, q: Pattern, p: Array, places: Array, speeds: Array, most: int) -> bool:
    """Write the network of a vector; return False where it is not of the pattern.

    ``places`` is room for the cuts of all rods, ``speeds`` for all ends; ``most`` are the intervals of the march.
    """
    state, whole = m.state[0], q.whole[0]
    if not write_ends(m, q, p, places):
        return False
    shortest, longest = np.inf, 0.0
    for e in range(len(m.ends)):
        shortest, longest = min(shortest, m.ends[e].transit), max(longest, m.ends[e].transit)
    state.gravity, state.duration = p[whole.gravity], p[whole.duration]
    if whole.in_round_trips == 1:
        state.duration = p[whole.duration] * round_trip(q, p, whole.counted)
    state.tolerance = MERGE_TOL * 2.0 * shortest
    state.resolved = state.contact = state.kind = state.events = state.intervals = 0
    state.work, state.most = 0.0, most
    write_nodes(m, q, p, state.tolerance)
    write_contacts(m, q, p)
    fastest = abs(state.gravity * 2.0 * longest)
    for b in range(len(q.bodies)):
        body = q.bodies[b]
        for k in range(body.first_link, body.last_link):
            link = q.links[k]
            speeds[link.left_end] = speeds[link.right_end] = p[body.first]
            fastest = max(fastest, abs(p[body.first]))
    for n in range(len(m.nodes)):
        fastest = max(fastest, abs(m.nodes[n].v))
    for e in range(len(m.ends)):
        fastest = max(fastest, abs(m.nodes[m.ends[e].node].end_force / m.ends[e].impedance))
    state.fastest = fastest
    state.farthest = max(fastest * 2.0 * shortest, 0.0)
    write_first_pieces(m, speeds)
    for row in range(len(m.rows)):
        for k in range(m.rows.shape[1]):
            m.rows[row, k] = m.waves[row, k] = m.load[row, k] = 0.0
    return True
