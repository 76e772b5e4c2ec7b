"""Tangents over one interval of a junction, compiled.

Between events the motion is linear, so its derivatives obey the same equations with other loads. They are taken first
with both ends of the interval moving as its start does, and then at the place that the end really moves to.
"""

from __future__ import annotations

import numpy as np

from impactlab.exact.arrays import MarchArrays
from impactlab.exact.kernel import (
    CHOP_TOL,
    HALF_ORDER,
    MAX_LOAD_HALF,
    MAX_RATE_HALF,
    ORDER,
    ROOM,
    chopped,
    integrate,
    restrict,
    within,
)
from impactlab.exact.nodes import group_nodes, tail
from impactlab.exact.tangents.arrays import (
    DAMPING,
    DASHPOT,
    END_FORCE,
    GAP,
    GRAVITY,
    IMPEDANCE,
    MASS,
    SPRING,
    STIFFNESS,
    TRANSIT,
    TangentArrays,
)
from impactlab.exact.tangents.series import at_end, at_start, derivative, eliminate, lever, relaxed
from impactlab.exact.tangents.springs import group_rate
from impactlab.numerics.addresses import call
from impactlab.numerics.compiling import EXACT_PART
from impactlab.types import Array

TAIL_TOL = 1.0e-15  # of the largest coefficient: tail of a tangent that needs no more of them


@EXACT_PART
def fronts(m: MarchArrays, d: TangentArrays, j: int, t0: float) -> int:
    """Write the derivatives of arriving waves by the ends of an interval.

    Return their number of coefficients. Also the jump of a front that arrives with the start of the interval.
    """
    junction = m.junctions[j]
    room = len(m.pieces) // len(m.junctions)
    longest = 1
    for e in range(junction.ends):
        end, wave = m.ends[junction.first_end + e], m.waves[e]
        size = chopped(wave, ROOM, 0.0)
        derivative(wave, size, d.fronts[e, 0])
        lever(d.fronts[e, 0], size, d.fronts[e, 1])
        d.sizes[e], d.jumps[e] = size, 0.0
        longest = max(longest, size)
        number = room * end.source + end.cursor
        piece = m.pieces[number]
        if end.cursor > 0 and abs(piece.start + end.transit - t0) <= 4.0 * m.state[0].tolerance:
            before = m.pieces[number - 1]
            last, next_ = before.offset + end.row * before.size, piece.offset + end.row * piece.size
            jump = at_start(m.pool[next_ : next_ + piece.size]) - at_end(m.pool[last : last + before.size], before.size)
            d.jumps[e] = abs(jump)
    return longest


@EXACT_PART
def arriving(m: MarchArrays, d: TangentArrays, q: int, j: int, t0: float, t1: float) -> int:
    """Write the tangents of waves arriving on [t0, t1]; return their number of coefficients."""
    state, junction = m.state[0], m.junctions[j]
    room = len(m.pieces) // len(m.junctions)
    longest = 1
    trial = d.room[0]
    start = d.clock[j, q]
    for e in range(junction.ends):
        end = m.ends[junction.first_end + e]
        transit = d.of_ends[q, junction.first_end + e, TRANSIT]
        number = room * end.source + end.cursor
        piece = m.pieces[number]
        source = m.junctions[end.source]
        begin, width = piece.start + end.transit, piece.stop - piece.start
        low, high = 2.0 * (t0 - begin) / width - 1.0, 2.0 * (t1 - begin) / width - 1.0
        n = d.size[number]
        at = d.offset[number] + (q * source.rows + end.row) * n
        wave = d.waves[e]
        n = chopped(d.pool[at : at + n], n, 0.0)
        slack = 2.0 * m.state[0].tolerance / width
        if n > 1 and (abs(low + 1.0) > slack or abs(high - 1.0) > slack):
            for k in range(n):
                trial[k] = d.pool[at + k]
            n = restrict(trial, n, within(low), within(high), wave)
        else:
            for k in range(n):
                wave[k] = d.pool[at + k]
        for k in range(n, ROOM):
            wave[k] = 0.0
        # The interval moves relative to the piece that arrives.
        later = 2.0 * (start - transit - d.moves[number, 0, q]) / width
        wider = (d.moves[number, 1, q] - d.moves[number, 0, q]) / width
        of_low, of_high = later - (low + 1.0) * wider, later - (high + 1.0) * wider
        middle, slope = (of_low + of_high) / (high - low), (of_high - of_low) / (high - low)
        if d.sizes[e] > 1 and (middle != 0.0 or slope != 0.0):
            for k in range(d.sizes[e]):
                wave[k] += middle * d.fronts[e, 0, k] + slope * d.fronts[e, 1, k]
        wave[0] += 0.5 * (d.of_state[q, GRAVITY] * end.transit + state.gravity * transit)
        longest = max(longest, n)
        # a front that parts from the start of the interval is found
        d.apart[q] = max(d.apart[q], d.jumps[e] * abs(d.moves[number, 0, q] + transit - start))
    return longest


@EXACT_PART
def floor_of(m: MarchArrays, d: TangentArrays, q: int) -> float:
    """Return the size of the tangent of a velocity below which it is rounding."""
    return float(CHOP_TOL * m.state[0].fastest / d.scale[q])


@EXACT_PART
def drive(m: MarchArrays, d: TangentArrays, q: int, j: int, longest: int) -> None:
    """Write the tangents of the loads of the groups.

    They replace the loads and are less drag' times velocity. The value written to m.load then is (load - drag *
    velocity)' at constant velocity'.
    """
    state, junction = m.state[0], m.junctions[j]
    base = junction.first_node
    for i in range(base, junction.last_node):
        for k in range(ROOM):
            m.load[i - base, k] = 0.0
    for i in range(base, junction.last_node):
        node = m.nodes[i]
        g = node.group - base
        v = m.rows[g]
        load = m.load[g]
        load[0] += d.of_nodes[q, i, END_FORCE] - d.of_nodes[q, i, SPRING] * node.u - node.spring * d.u[q, i]
        if node.mass < np.inf:
            load[0] += d.of_nodes[q, i, MASS] * state.gravity + node.mass * d.of_state[q, GRAVITY]
        if d.of_nodes[q, i, DASHPOT] != 0.0:
            for k in range(longest):
                load[k] -= d.of_nodes[q, i, DASHPOT] * v[k]
    for e in range(junction.first_end, junction.last_end):
        end = m.ends[e]
        g = m.nodes[end.node].group - base
        load, v, own = m.load[g], m.rows[g], d.of_ends[q, e, IMPEDANCE]
        for k in range(longest):
            load[k] += 2.0 * end.impedance * d.waves[e - junction.first_end, k]
        if own != 0.0:
            for k in range(longest):
                load[k] += own * (2.0 * m.waves[e - junction.first_end, k] - v[k])


@EXACT_PART
def massive(m: MarchArrays, d: TangentArrays, q: int, j: int, i: int, half: float, longest: int, floor: float) -> int:
    """Write the tangent of velocity of node i's massive group; return its coefficients."""
    node, base = m.nodes[i], m.junctions[j].first_node
    g = node.group
    group = m.nodes[g]
    load, plain, v, out = m.load[g - base], d.loads[g - base], m.rows[g - base], d.rows[q, g - base]
    mass, rate = group.group_mass, half * group.drag / group.group_mass
    growth = group_rate(m, d, q, j, g) / mass
    n = min(longest, ORDER)
    for k in range(n):
        load[k] = half / mass * (load[k] - growth * (plain[k] - group.drag * v[k]))
    n = chopped(load, n, 0.0)
    order = HALF_ORDER if n <= MAX_LOAD_HALF and rate <= MAX_RATE_HALF else ORDER
    while True:
        if d.orders[g - base] != order:
            eliminate(rate, order, d.pivots[g - base])
            d.orders[g - base] = order
        relaxed(d.pivots[g - base], load, n, d.v[q, i], order, out, d.room[0])
        largest = 0.0
        for k in range(order):
            largest = max(largest, abs(out[k]))
        if order == ORDER or tail(out, order) <= max(TAIL_TOL * largest, floor):
            break
        order = ORDER
    kept = chopped(out, order, floor)
    for k in range(kept, order):
        out[k] = 0.0
    return kept


@EXACT_PART
def contact_force(m: MarchArrays, d: TangentArrays, q: int, j: int, c: int, n: int) -> None:
    """Write the tangent of the force of a closed contact."""
    junction, contact = m.junctions[j], m.contacts[c]
    base, nodes, ends = junction.first_node, junction.nodes, junction.ends
    rows = d.rows[q]
    force = rows[2 * (nodes + ends) + c - junction.first_contact]
    a, b = contact.left - base, contact.right - base
    if contact.stiffness >= 0.0:
        stiffer, heavier = d.of_contacts[q, c, STIFFNESS], d.of_contacts[q, c, DAMPING]
        for k in range(n):
            force[k] = contact.stiffness * (rows[nodes + a, k] - rows[nodes + b, k])
            force[k] += contact.damping * (rows[a, k] - rows[b, k])
            force[k] += stiffer * (m.rows[nodes + a, k] - m.rows[nodes + b, k])
            force[k] += heavier * (m.rows[a, k] - m.rows[b, k])
        force[0] -= stiffer * contact.gap + contact.stiffness * d.of_contacts[q, c, GAP]
        return
    side = 1.0 if contact.face == contact.right else -1.0
    face, at = m.nodes[contact.face], contact.face - base
    for k in range(n):
        force[k] = side * (face.spring * rows[nodes + at, k] + face.dashpot * rows[at, k])
        force[k] += side * d.of_nodes[q, contact.face, SPRING] * m.rows[nodes + at, k]
        force[k] += side * d.of_nodes[q, contact.face, DASHPOT] * m.rows[at, k]
    force[0] -= side * d.of_nodes[q, contact.face, END_FORCE]
    for e in range(ends):
        end = m.ends[junction.first_end + e]
        if end.node == contact.face:
            z, own = side * end.impedance, side * d.of_ends[q, junction.first_end + e, IMPEDANCE]
            for k in range(n):
                force[k] += z * (rows[2 * nodes + e, k] - d.waves[e, k])
                force[k] += own * (m.rows[2 * nodes + e, k] - m.waves[e, k])
    for other in range(junction.first_contact, c):
        there = m.contacts[other]
        if there.left == contact.face or there.right == contact.face:
            sign = side if there.left == contact.face else -side
            row = rows[2 * (nodes + ends) + other - junction.first_contact]
            for k in range(n):
                force[k] += sign * row[k]


@EXACT_PART
def displace(m: MarchArrays, d: TangentArrays, q: int, j: int, half: float, used: int) -> None:
    """Write the tangents of the displacements of the nodes after those of their velocities."""
    base, nodes = m.junctions[j].first_node, m.junctions[j].nodes
    rows = d.rows[q]
    for i in range(nodes):
        node = m.nodes[base + i]
        if m.nodes[node.group].place < 0:
            integrate(rows[i], used, half, d.u[q, base + i], rows[nodes + i])
        elif node.group != base + i:
            for k in range(used):
                rows[nodes + i, k] = rows[nodes + node.group - base, k]
    for i in range(nodes):
        if m.nodes[m.nodes[base + i].group].place >= 0:
            rows[nodes + i, 0] += d.u[q, base + i]


@EXACT_PART
def move_nodes(m: MarchArrays, d: TangentArrays, q: int, j: int, half: float, longest: int, tied: bool) -> int:
    """Write the tangents of the nodes' motion; return coefficients of the velocities.

    Motion is velocities and displacements.
    """
    junction = m.junctions[j]
    base, nodes = junction.first_node, junction.nodes
    rows = d.rows[q]
    used = ORDER if tied else longest
    if tied:
        call(d.springs, m, d, q, j, half)
    else:
        for i in range(base, junction.last_node):
            node = m.nodes[i]
            node.place = -1
            group = m.nodes[node.group]
            if group.group_mass == 0.0 and i == node.group:
                for k in range(longest):
                    rows[i - base, k] = m.load[i - base, k] / group.drag
            elif group.group_mass < np.inf and node.mass > 0.0:
                used = max(used, massive(m, d, q, j, i, half, longest, floor_of(m, d, q)))
    for i in range(nodes):
        source = m.nodes[base + i].group - base
        if source != i:
            for k in range(used):
                rows[i, k] = rows[source, k]
    displace(m, d, q, j, half, used)
    return used


@EXACT_PART
def make_tangents(m: MarchArrays, d: TangentArrays, j: int, t0: float, t1: float) -> int:
    """Write all tangents of the record in m.rows on [t0, t1].

    Its ends move as the junction's time. m.waves holds the waves that arrive on the same interval. Returned is the
    number of coefficients that are written.
    """
    junction = m.junctions[j]
    base, nodes, ends = junction.first_node, junction.nodes, junction.ends
    half = 0.5 * (t1 - t0)
    shortest = fronts(m, d, j, t0)
    filled = 1
    tied = group_nodes(m, j, min(shortest, ORDER))
    for i in range(nodes):
        shortest = max(shortest, chopped(m.rows[i], ROOM, 0.0))
        d.orders[i] = 0
        for k in range(ROOM):
            d.loads[i, k] = m.load[i, k]
    for q in range(len(d.apart)):
        longest = min(max(shortest, arriving(m, d, q, j, t0, t1)), ORDER)
        rows = d.rows[q]
        for i in range(junction.rows):
            for k in range(d.used[1]):
                rows[i, k] = 0.0
        drive(m, d, q, j, longest)
        used = move_nodes(m, d, q, j, half, longest, tied)
        filled = max(filled, used + 1)
        for e in range(ends):
            end = m.ends[junction.first_end + e]
            row, v = rows[2 * nodes + e], rows[end.node - base]
            for k in range(used):
                row[k] = v[k] - d.waves[e, k]
            integrate(row, used, half, d.carried[q, junction.first_end + e], rows[2 * nodes + ends + e])
        for c in range(junction.first_contact, junction.last_contact):
            if m.contacts[c].closed == 1:
                contact_force(m, d, q, j, c, used + 1)
    d.used[1] = max(d.used[1], filled)
    return filled


@EXACT_PART
def keep_tangents(
    m: MarchArrays, d: TangentArrays, j: int, number: int, half: float, n: int, filled: int, until: Array
) -> None:
    """Write the tangents of a piece; move the junction to its end.

    m.rows holds the piece; its end is moved by ``until`` (P,).
    """
    junction = m.junctions[j]
    nodes, ends, first = junction.nodes, junction.ends, junction.first_end
    size = n
    slopes, moved = d.room[0], d.room[1]
    for i in range(junction.rows):
        if n > 1:
            derivative(m.rows[i], n, slopes)
            lever(slopes, n, moved)
            for q in range(len(until)):
                later = 0.5 * (until[q] - d.clock[j, q]) / half
                if later != 0.0:
                    row = d.rows[q, i]
                    for k in range(n):
                        row[k] += later * (slopes[k] + moved[k])
        if i < nodes or 2 * nodes <= i < 2 * nodes + ends:
            for q in range(len(until)):
                kept = chopped(d.rows[q, i], filled, floor_of(m, d, q))
                size = max(size, min(kept + 1, filled))
    d.size[number], d.offset[number] = size, d.used[0]
    at = d.used[0]
    for q in range(len(until)):
        for i in range(junction.rows):
            row = d.rows[q, i]
            for k in range(size):
                d.pool[at + k] = row[k]
            at += size
            if i < nodes:
                d.v[q, junction.first_node + i] = at_end(row, size)
            elif i < 2 * nodes:
                d.u[q, junction.first_node + i - nodes] = at_end(row, size)
            elif 2 * nodes + ends <= i < 2 * nodes + 2 * ends:
                d.carried[q, first + i - 2 * nodes - ends] = at_end(row, size)
        d.moves[number, 0, q], d.moves[number, 1, q] = d.clock[j, q], until[q]
        d.clock[j, q] = until[q]
    d.used[0], d.used[1] = at, max(d.used[1], size)
