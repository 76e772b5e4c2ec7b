"""The march of the exact solver, compiled: each junction advances from break to break, events are found by isolation.

A junction is a set of nodes that contacts may tie together. It sees the rest of the scene only through arriving waves,
which the other ends emitted one transit earlier; so junctions advance one by one, the one furthest behind first.
What solves springs is a compiled unit of its own, passed as an address: scenes without springs never compile it.
"""

from __future__ import annotations

import numpy as np

from impactlab import pointers
from impactlab.exact import kernel, memory, tied
from impactlab.exact.kernel import (
    CHOP,
    DEPTH,
    EASY,
    EASY_RATE,
    ENTRY,
    HALF_ORDER,
    ORDER,
    PART,
    RESOLVED,
    ROOM,
    ZERO,
    chopped,
    first_fall,
    integrate,
    relax,
    restrict,
)
from impactlab.exact.memory import Memory
from impactlab.exact.network import Log, Network
from impactlab.pointers import call, drop_stale, entered
from impactlab.types import Array

INLINE = kernel.njit(inline="always", _nrt=False, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
DONE, MORE_RECORDS, MORE_POOL, MORE_EVENTS, TOO_MANY, UNRESOLVED = 0, 1, 2, 3, 4, 5
CLOSE, OPEN = 1, 0
ROUNDED = 1.0e-14  # of displacements and velocities: how far rounding may have moved them
BURST = 64  # events within 1e3 merge tolerances that count as endless
INTERVALS = 3_000_000


@PART
def horizon(m: Memory, j: int) -> float:
    """Return the time up to which every wave that arrives at junction j is one piece."""
    state, junction = m.state[0], m.junctions[j]
    room = len(m.pieces) // len(m.junctions)
    until = state.duration
    for e in range(junction.first_end, junction.last_end):
        end = m.ends[e]
        while m.pieces[room * end.source + end.cursor].stop + end.transit <= junction.clock + state.tolerance:
            end.cursor += 1
        until = min(until, m.pieces[room * end.source + end.cursor].stop + end.transit)
    return float(until)


@PART
def arrivals(m: Memory, j: int, t0: float, t1: float) -> int:
    """Write the waves that arrive at the ends of junction j on [t0, t1]; return the number of coefficients."""
    state, junction = m.state[0], m.junctions[j]
    room = len(m.pieces) // len(m.junctions)
    longest = 1
    trial = m.stack[DEPTH]
    for e in range(junction.first_end, junction.last_end):
        end = m.ends[e]
        piece = m.pieces[room * end.source + end.cursor]
        begin, stop, n = piece.start + end.transit, piece.stop + end.transit, piece.size
        at = piece.offset + end.row * n
        for k in range(n):
            trial[k] = m.pool[at + k]
        n = chopped(trial, n, 0.0)
        wave = m.waves[e - junction.first_end]
        if abs(begin - t0) <= state.tolerance and abs(stop - t1) <= state.tolerance:
            for k in range(n):
                wave[k] = trial[k]
        else:
            width = stop - begin
            n = restrict(trial, n, 2.0 * (t0 - begin) / width - 1.0, 2.0 * (t1 - begin) / width - 1.0, wave)
        for k in range(n, ROOM):
            wave[k] = 0.0
        wave[0] += 0.5 * state.gravity * end.transit
        longest = max(longest, n)
    return longest


@PART
def group_nodes(m: Memory, j: int, longest: int) -> bool:
    """Join the nodes that hard contacts hold together, with their masses and loads; return whether springs act."""
    state, junction = m.state[0], m.junctions[j]
    base = junction.first_node
    tied = False
    for i in range(base, junction.last_node):
        node = m.nodes[i]
        node.group, node.group_mass, node.drag = i, 0.0, 0.0
        for k in range(ROOM):
            m.load[i - base, k] = 0.0
    for c in range(junction.first_contact, junction.last_contact):
        contact = m.contacts[c]
        if contact.closed == 1:
            if contact.stiffness >= 0.0:
                tied = True
            else:
                old, new = m.nodes[contact.right].group, m.nodes[contact.left].group
                for i in range(base, junction.last_node):
                    if m.nodes[i].group == old:
                        m.nodes[i].group = new
    for i in range(base, junction.last_node):
        node = m.nodes[i]
        group = m.nodes[node.group]
        group.group_mass += node.mass
        group.drag += node.dashpot
        m.load[node.group - base, 0] += node.push - node.spring * node.u
        if node.mass < np.inf:
            m.load[node.group - base, 0] += node.mass * state.gravity
            tied = tied or node.spring > 0.0
    for e in range(junction.first_end, junction.last_end):
        end = m.ends[e]
        g = m.nodes[end.node].group
        m.nodes[g].drag += end.impedance
        for k in range(longest):
            m.load[g - base, k] += 2.0 * end.impedance * m.waves[e - junction.first_end, k]
    return tied


@PART
def tail(a: Array, n: int) -> float:
    """Return the size of the last three of n coefficients."""
    return float(abs(a[n - 1]) + abs(a[n - 2]) + abs(a[n - 3]))


@PART
def solve_nodes(m: Memory, j: int, half: float, longest: int) -> int:
    """Write the velocities of the nodes of junction j; return their number of coefficients, 0 where not resolved."""
    state, junction = m.state[0], m.junctions[j]
    base = junction.first_node
    tied = group_nodes(m, j, longest)
    used = longest
    for i in range(base, junction.last_node):
        node = m.nodes[i]
        mass = m.nodes[node.group].group_mass
        node.bare = 1 if mass == 0.0 or mass == np.inf else 0
        node.place = -1
        for k in range(ROOM):
            m.rows[i - base, k] = 0.0
            m.rows[i - base + junction.last_node - base, k] = 0.0
    if tied:
        call(m.coupled, m, j, half)
        if state.resolved == 0:
            return 0
        used = ORDER
    else:
        for i in range(base, junction.last_node):
            node = m.nodes[i]
            group = m.nodes[node.group]
            load, out = m.load[node.group - base], m.rows[node.group - base]
            if group.group_mass == 0.0 and i == node.group:
                for k in range(longest):
                    out[k] = load[k] / group.drag
            elif group.group_mass < np.inf and node.mass > 0.0:
                for k in range(longest):
                    load[k] *= half / group.group_mass
                rate = half * group.drag / group.group_mass
                order = HALF_ORDER if longest <= EASY and rate <= EASY_RATE else ORDER
                relax(rate, load, node.v, order, out, m.stack)
                if order < ORDER and tail(out, order) > CHOP * state.fastest:
                    order = ORDER
                    relax(rate, load, node.v, order, out, m.stack)
                if tail(out, order) > RESOLVED * state.fastest:
                    return 0
                used = max(used, order)
    n = 1
    for i in range(base, junction.last_node):
        out, source = m.rows[i - base], m.rows[m.nodes[i].group - base]
        for k in range(used):
            out[k] = source[k]
        n = max(n, chopped(out, used, CHOP * state.fastest))
    return n


@PART
def balance(m: Memory, j: int, c: int, n: int, force: Array) -> None:
    """Write the force of a hard contact: what all else on its bare face takes, rods, what holds it, other contacts."""
    junction = m.junctions[j]
    base, first_end = junction.first_node, junction.first_end
    nodes, ends = junction.last_node - base, junction.last_end - first_end
    contact = m.contacts[c]
    side = 1.0 if contact.face == contact.right else -1.0
    face, at = m.nodes[contact.face], contact.face - base
    for k in range(n + 1):
        force[k] = side * (face.spring * m.rows[nodes + at, k] + face.dashpot * m.rows[at, k])
    force[0] -= side * face.push
    for e in range(ends):
        end = m.ends[first_end + e]
        if end.node == contact.face:
            z = side * end.impedance
            for k in range(n):
                force[k] += z * (m.rows[2 * nodes + e, k] - m.waves[e, k])
    for other in range(junction.first_contact, c):  # the forces of the others of this face were found before
        there = m.contacts[other]
        if there.left == contact.face or there.right == contact.face:
            push = side if there.left == contact.face else -side
            row = m.rows[2 * (nodes + ends) + other - junction.first_contact]
            for k in range(n + 1):
                force[k] += push * row[k]


@PART
def fill_rows(m: Memory, j: int, half: float, longest: int, n: int) -> int:
    """Write all rows of a record after the velocities of its nodes; return the number of coefficients."""
    junction = m.junctions[j]
    base, first_end = junction.first_node, junction.first_end
    nodes, ends = junction.last_node - base, junction.last_end - first_end
    n = max(n, longest)
    for i in range(nodes):
        node = m.nodes[base + i]
        m.rows[i, n] = 0.0
        if m.nodes[node.group].place < 0:
            integrate(m.rows[i], n, half, node.u, m.rows[nodes + i])
        elif node.group != base + i:
            for k in range(n + 1):
                m.rows[nodes + i, k] = m.rows[nodes + node.group - base, k]
    for i in range(nodes):
        node = m.nodes[base + i]
        if m.nodes[node.group].place >= 0:  # what springs tie has its displacement from them
            m.rows[nodes + i, 0] += node.u
    for e in range(ends):
        end = m.ends[first_end + e]
        row, v, wave = m.rows[2 * nodes + e], m.rows[end.node - base], m.waves[e]
        for k in range(n):
            row[k] = v[k] - wave[k]
        row[n] = 0.0
        integrate(row, n, half, end.carried, m.rows[2 * nodes + ends + e])
    for c in range(junction.first_contact, junction.last_contact):
        contact = m.contacts[c]
        force = m.rows[2 * (nodes + ends) + c - junction.first_contact]
        for k in range(n + 1):
            force[k] = 0.0
        if contact.closed == 1:
            a, b = contact.left - base, contact.right - base
            if contact.stiffness >= 0.0:
                for k in range(n + 1):
                    force[k] = contact.stiffness * (m.rows[nodes + a, k] - m.rows[nodes + b, k])
                    force[k] += contact.damping * (m.rows[a, k] - m.rows[b, k])
                force[0] -= contact.stiffness * contact.gap
            else:
                balance(m, j, c, n, force)
    return n + 1


@PART
def rounded_force(m: Memory, j: int, c: int, n: int) -> float:
    """Return the force below which contact c has none [N]; a stiff spring makes one of rounded displacements."""
    state, junction, contact = m.state[0], m.junctions[j], m.contacts[c]
    none = ZERO * state.fastest * contact.impedance
    if contact.stiffness >= 0.0:
        base, nodes = junction.first_node, junction.last_node - junction.first_node
        reach = abs(contact.gap)
        for k in range(n):
            reach += abs(m.rows[nodes + contact.left - base, k]) + abs(m.rows[nodes + contact.right - base, k])
        none += ROUNDED * (contact.stiffness * reach + contact.damping * state.fastest)
    return float(none)


@PART
def yielding(m: Memory, c: int) -> float:
    """Return how much larger the force of contact c would be on faces that did not give way to it, less 1."""
    contact = m.contacts[c]
    more = 0.0
    for side in (contact.left, contact.right):
        group = m.nodes[m.nodes[side].group]
        if group.group_mass == 0.0:
            more += contact.damping / group.drag
    return float(more)


@PART
def next_event(m: Memory, j: int, n: int) -> float:
    """Return the place in [-1, 1] of the first event, 2 for none; the state holds its contact (or -1) and kind."""
    state, junction = m.state[0], m.junctions[j]
    base = junction.first_node
    nodes = junction.last_node - base
    first_force = 2 * nodes + 2 * (junction.last_end - junction.first_end)
    place = 2.0
    no_gap = ZERO * state.farthest
    trial = m.stack[DEPTH]
    for c in range(junction.first_contact, junction.last_contact):
        contact = m.contacts[c]
        a, b = contact.left - base, contact.right - base
        no_force = rounded_force(m, j, c, n)
        force = m.rows[first_force + c - junction.first_contact]
        if contact.closed == 1 and contact.stiffness < 0.0 and m.nodes[contact.left].bare == 1:
            total = 0.0
            for k in range(n):
                total += abs(force[k])
            if total <= no_force:  # faces that rest on each other without force are apart
                state.contact, state.kind = c, OPEN
                return -1.0
        gap = contact.gap + m.nodes[contact.right].u - m.nodes[contact.left].u
        # what falls: the force; or the gap; or, of an unloaded spring still behind its contact, both ways out of it,
        # as it takes load again or the gap opens
        behind = contact.closed == 0 and gap < -no_gap and contact.stiffness >= 0.0
        for way in range(2 if behind else 1):
            floor = no_gap
            if contact.closed == 1:
                floor = no_force
                for k in range(n):
                    trial[k] = force[k]
            else:
                sign = -1.0 if behind else 1.0
                for k in range(n):
                    trial[k] = sign * (m.rows[nodes + b, k] - m.rows[nodes + a, k])
                trial[0] += sign * contact.gap
            if way == 1:
                floor = no_force * (1.0 + yielding(m, c))
                for k in range(n):
                    pull = contact.damping * (m.rows[b, k] - m.rows[a, k])
                    trial[k] = pull - contact.stiffness * trial[k]
            x = first_fall(trial, n, floor, m.stack)
            if x < place:
                place = x
                state.contact = -1 if behind and way == 0 else c
                state.kind = CLOSE if contact.closed == 0 and not (behind and way == 0) else OPEN
    return place


@PART
def keep(m: Memory, j: int, t0: float, t1: float, n: int) -> None:
    """Write the record of junction j on [t0, t1] and move the junction to its end."""
    state, junction = m.state[0], m.junctions[j]
    nodes, ends = junction.last_node - junction.first_node, junction.last_end - junction.first_end
    height = 2 * nodes + 2 * ends + junction.last_contact - junction.first_contact
    piece = m.pieces[len(m.pieces) // len(m.junctions) * j + junction.records]
    piece.start, piece.stop, piece.size, piece.offset = t0, t1, n, state.pool_used
    at = state.pool_used
    for i in range(height):
        total = 0.0
        bound = 0.0
        for k in range(n):
            m.pool[at + k] = m.rows[i, k]
            total += m.rows[i, k]
            bound += abs(m.rows[i, k])
        at += n
        if i < nodes:
            m.nodes[junction.first_node + i].v = total
            state.fastest = max(state.fastest, bound)
        elif i < 2 * nodes:
            m.nodes[junction.first_node + i - nodes].u = total
            state.farthest = max(state.farthest, 0.01 * bound)
        elif 2 * nodes + ends <= i < 2 * nodes + 2 * ends:
            m.ends[junction.first_end + i - 2 * nodes - ends].carried = total
    state.pool_used = at
    junction.records += 1
    junction.clock = t1


@PART
def happen(m: Memory, j: int, t: float) -> bool:
    """Let the event that was found happen; return whether events still have an end."""
    state, junction = m.state[0], m.junctions[j]
    m.contacts[state.contact].closed = state.kind
    event = m.events[state.events]
    event.time, event.contact, event.kind = t, state.contact, state.kind
    state.events += 1
    if t > junction.burst + 1e3 * state.tolerance:
        junction.burst = t
        junction.bursts = 0
    junction.bursts += 1
    return bool(junction.bursts <= BURST)


@INLINE
def interval(m: Memory, j: int) -> int:
    """Advance junction j to its next break or event; return DONE, or why it cannot go on."""
    state, junction = m.state[0], m.junctions[j]
    t0 = junction.clock
    t1 = horizon(m, j)
    while True:
        half = 0.5 * (t1 - t0)
        longest = arrivals(m, j, t0, t1)
        n = solve_nodes(m, j, half, longest)
        if n > 0:
            break
        t1 = t0 + half
        if half <= state.tolerance:
            return UNRESOLVED
    n = fill_rows(m, j, half, longest, n)
    place = next_event(m, j, n)
    event = t1 if place > 1.0 else t0 + half * (place + 1.0)
    if place <= 1.0 and event < t1:
        if event > t0 + state.tolerance:
            nodes, ends = junction.last_node - junction.first_node, junction.last_end - junction.first_end
            trial = m.stack[DEPTH]
            for i in range(2 * nodes + 2 * ends + junction.last_contact - junction.first_contact):
                # A row keeps its degree: zeros at its end would become rounding, and waves grow with every event.
                kept = restrict(m.rows[i], chopped(m.rows[i], n, 0.0), -1.0, place, trial)
                for k in range(n):
                    m.rows[i, k] = trial[k] if k < kept else 0.0
        t1 = event
    if t1 > t0 + state.tolerance:
        keep(m, j, t0, t1, n)
    if place <= 1.0 and state.contact >= 0:
        return DONE if happen(m, j, t1) else TOO_MANY
    if place <= 1.0 and t1 <= t0 + state.tolerance:
        junction.clock = t0 + state.tolerance
    return DONE


@ENTRY
def advance(m: Memory) -> int:
    """Advance all junctions to the end; return DONE, what has run out of room, or why it cannot go on."""
    state = m.state[0]
    while True:
        j = len(m.junctions) - 1  # not a literal, for which all would be compiled twice
        for other in range(j - 1, -1, -1):
            if m.junctions[other].clock <= m.junctions[j].clock:
                j = other
        junction = m.junctions[j]
        if junction.clock >= state.duration - state.tolerance:
            return DONE
        if junction.records >= len(m.pieces) // len(m.junctions):
            return MORE_RECORDS
        if state.pool_used + m.rows.size > len(m.pool):
            return MORE_POOL
        if state.events >= len(m.events):
            return MORE_EVENTS
        if state.intervals > INTERVALS:
            return TOO_MANY
        state.intervals += 1
        status = interval(m, j)
        if status != DONE:
            return int(status)


drop_stale(advance, kernel, memory, pointers)


def springs(net: Network) -> bool:
    """Return whether any node or contact of a network is held by a spring."""
    return bool(np.any(net.stiffness >= 0.0) or np.any(net.spring > 0.0))


def march(log: Log, coupled: bool) -> int:
    """Advance all junctions to the end; return DONE, what has run out of room, or why it cannot go on."""
    m = log.memory
    if coupled:
        m = m._replace(coupled=tied.address(m))
    return int(entered(advance, m))
