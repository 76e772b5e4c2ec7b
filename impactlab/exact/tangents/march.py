"""March of the exact solver with tangents and the same, never merged, intervals, compiled."""

from __future__ import annotations

from impactlab.exact.arrays import (
    CLOSE,
    DONE,
    MORE_EVENTS,
    MORE_POOL,
    MORE_RECORDS,
    OPEN,
    PAUSED,
    TOO_MANY,
    UNRESOLVED,
    MarchArrays,
)
from impactlab.exact.crossings import next_event
from impactlab.exact.kernel import ROOM, ZERO_TOL
from impactlab.exact.march import apply_event, arrivals, cut, furthest_behind, horizon, keep
from impactlab.exact.nodes import fill_rows, solve_nodes
from impactlab.exact.tangents.arrays import BY_FRONT, CROSSED, DAMPING, DURATION, GAP, STIFFNESS, TRANSIT, TangentArrays
from impactlab.exact.tangents.interval import keep_tangents, make_tangents
from impactlab.exact.tangents.series import at_end, at_start, bend_at_end, derivative, lever, slope_at_end
from impactlab.numerics.compiling import EXACT_ENTRY, EXACT_PART
from impactlab.types import Array

MORE_TANGENTS = 7  # status: the pool of tangents is full


@EXACT_PART
def of_horizon(m: MarchArrays, d: TangentArrays, j: int, t1: float, until: Array) -> None:
    """Write the derivative of the end of arriving waves' pieces.

    Up to this time, all waves that arrive are one piece.
    """
    junction = m.junctions[j]
    room = len(m.pieces) // len(m.junctions)
    for q in range(len(until)):
        until[q] = d.of_state[q, DURATION]
    for e in range(junction.first_end, junction.last_end):
        end = m.ends[e]
        number = room * end.source + end.cursor
        if m.pieces[number].stop + end.transit == t1:
            for q in range(len(until)):
                until[q] = d.moves[number, 1, q] + d.of_ends[q, e, TRANSIT]
            return


@EXACT_PART
def of_crossing(m: MarchArrays, d: TangentArrays, j: int, n: int, half: float, until: Array) -> None:
    """Write the derivative of a zero crossing's time, and its kind.

    A force or a gap crosses zero. f(t, p) = 0, so dt/dp = -(df/dp)/(df/dt). The record ends there; its end still moves
    as its start.
    """
    state, junction = m.state[0], m.junctions[j]
    contact = m.contacts[state.contact]
    base, nodes, ends = junction.first_node, junction.nodes, junction.ends
    a, b = contact.left - base, contact.right - base
    f, tangent = d.room[2], d.room[3]
    gap = contact.gap + m.nodes[contact.right].u - m.nodes[contact.left].u
    overlapped = gap < -ZERO_TOL * state.farthest  # as `next_event` takes it
    behind = contact.closed == 0 and contact.stiffness >= 0.0 and overlapped
    if contact.closed == 1:
        force = 2 * (nodes + ends) + state.contact - junction.first_contact
        for k in range(n):
            f[k] = m.rows[force, k]
    elif behind:
        for k in range(n):
            f[k] = contact.damping * (m.rows[b, k] - m.rows[a, k])
            f[k] += contact.stiffness * (m.rows[nodes + b, k] - m.rows[nodes + a, k])
        f[0] += contact.stiffness * contact.gap
    else:
        for k in range(n):
            f[k] = m.rows[nodes + b, k] - m.rows[nodes + a, k]
        f[0] += contact.gap
    rate = slope_at_end(f, n) / half
    bend = d.bend[state.events]
    bend[0], bend[1], bend[2] = rate, bend_at_end(f, n) / (half * half), CROSSED
    for q in range(len(until)):
        rows = d.rows[q]
        if contact.closed == 1:
            for k in range(ROOM):
                tangent[k] = rows[force, k]
        elif behind:
            stiffer, heavier = d.of_contacts[q, state.contact, STIFFNESS], d.of_contacts[q, state.contact, DAMPING]
            for k in range(ROOM):
                tangent[k] = contact.damping * (rows[b, k] - rows[a, k])
                tangent[k] += contact.stiffness * (rows[nodes + b, k] - rows[nodes + a, k])
                tangent[k] += heavier * (m.rows[b, k] - m.rows[a, k])
                tangent[k] += stiffer * (m.rows[nodes + b, k] - m.rows[nodes + a, k])
            tangent[0] += stiffer * contact.gap + contact.stiffness * d.of_contacts[q, state.contact, GAP]
        else:
            for k in range(ROOM):
                tangent[k] = rows[nodes + b, k] - rows[nodes + a, k]
            tangent[0] += d.of_contacts[q, state.contact, GAP]
        until[q] = d.clock[j, q] - at_end(tangent, ROOM) / rate
        d.steeper[state.events, q] = slope_at_end(tangent, ROOM) / half + bend[1] * (until[q] - d.clock[j, q])


@EXACT_PART
def start_at_closing(m: MarchArrays, d: TangentArrays, j: int, half: float) -> None:
    """Move the start of a junction's march to where its faces meet.

    These touch at t = 0, and a parameter opens their gap. Where a front or another contact brings them together, the
    gap parts their closing from that, as it parts two fronts: this is noted instead.
    """
    state, junction = m.state[0], m.junctions[j]
    base, nodes, ends = junction.first_node, junction.nodes, junction.ends
    contact = m.contacts[state.contact]
    slopes, moved = d.room[2], d.room[3]
    number = len(m.pieces) // len(m.junctions) * j + junction.records - 1
    piece = m.pieces[number]
    approach = at_start(m.rows[contact.left - base]) - at_start(m.rows[contact.right - base])
    at_once = junction.clock == 0.0 and junction.bursts == 0 and approach > 0.0
    for q in range(len(d.apart)):
        opening = d.of_contacts[q, state.contact, GAP] + d.u[q, contact.right] - d.u[q, contact.left]
        if not at_once:
            d.apart[q] = max(d.apart[q], abs(opening))
            continue
        later = opening / approach
        if later != 0.0:
            d.clock[j, q] += later
            for i in range(nodes):
                derivative(m.rows[i], ROOM, slopes)
                d.v[q, base + i] += later * at_start(slopes) / half
                d.u[q, base + i] += later * at_start(m.rows[i])
            for e in range(ends):
                d.carried[q, junction.first_end + e] += later * at_start(m.rows[2 * nodes + e])
            d.moves[number, 1, q] += later  # the waves before t = 0 last until then
            for i in range(junction.rows):
                first, mine = piece.offset + i * piece.size, d.offset[number] + (q * junction.rows + i) * piece.size
                before, tangent = m.pool[first : first + piece.size], d.pool[mine : mine + piece.size]
                if piece.size > 1:
                    middle = 0.5 * later / (0.5 * (piece.stop - piece.start))
                    derivative(before, piece.size, slopes)
                    lever(slopes, piece.size, moved)
                    for k in range(piece.size):
                        tangent[k] += middle * (slopes[k] + moved[k])


@EXACT_PART
def date(m: MarchArrays, d: TangentArrays, j: int, half: float, found: bool) -> None:
    """Keep the derivative of the event's time, and of the force after a parting front."""
    state, junction = m.state[0], m.junctions[j]
    if not found and state.kind == CLOSE:
        start_at_closing(m, d, j, half)
    elif not found and state.kind == OPEN:
        make_tangents(m, d, j, junction.clock, junction.clock + 2.0 * half)  # as if the contact held
        row = 2 * (junction.nodes + junction.ends) + state.contact - junction.first_contact
        bend = d.bend[state.events]
        bend[0], bend[2] = at_start(m.rows[row]), BY_FRONT
        for q in range(len(d.apart)):
            d.pull[state.events, q] = at_start(d.rows[q, row])
    for q in range(len(d.apart)):
        d.dated[state.events, q] = d.clock[j, q]


@EXACT_PART
def tried(m: MarchArrays, d: TangentArrays, j: int, until: Array) -> tuple[int, float]:
    """Solve junction j up to the next break, or less.

    Return the number of coefficients, 0 for none, and the end.
    """
    state, junction = m.state[0], m.junctions[j]
    t0 = junction.clock
    t1 = horizon(m, j)
    of_horizon(m, d, j, t1, until)
    while True:
        half = 0.5 * (t1 - t0)
        longest = arrivals(m, j, t0, t1)
        n = solve_nodes(m, j, half, longest)
        if n > 0:
            break
        t1 = t0 + half
        for q in range(len(until)):
            until[q] = d.clock[j, q]
        if half <= state.tolerance:
            return 0, t1
    n = fill_rows(m, j, half, longest, n)
    for i in range(junction.rows):
        for k in range(n, ROOM):
            m.rows[i, k] = 0.0
    return n, t1


@EXACT_PART
def interval(m: MarchArrays, d: TangentArrays, j: int, until: Array) -> int:
    """Advance junction j and its tangents to the next break or event; return a status as `march.interval`."""
    state, junction = m.state[0], m.junctions[j]
    t0 = junction.clock
    n, t1 = tried(m, d, j, until)
    if n == 0:
        return UNRESOLVED
    half = 0.5 * (t1 - t0)
    place = next_event(m, j, n, half)
    event = t1 if place > 1.0 else t0 + half * (place + 1.0)
    found = place <= 1.0 and event > t0 + state.tolerance
    if found:
        cut(m, j, n, place)
    if place <= 1.0:
        t1 = event
    if t1 > t0 + state.tolerance:
        half = 0.5 * (t1 - t0)
        if found:
            arrivals(m, j, t0, t1)
        filled = make_tangents(m, d, j, t0, t1)
        if found and state.contact >= 0:
            of_crossing(m, d, j, n, half, until)
        elif found:  # only the next event sought changes there
            for q in range(len(until)):
                until[q] = d.clock[j, q]
        room = len(m.pieces) // len(m.junctions)
        junction.broken = 1  # no piece is joined to the one before it
        keep_tangents(m, d, j, room * j + junction.records, half, n, filled, until)
        keep(m, j, t0, t1, n)
    if place <= 1.0 and state.contact >= 0:
        date(m, d, j, half, found)
        return DONE if apply_event(m, j, t1) else TOO_MANY
    if place <= 1.0 and t1 <= t0 + state.tolerance:
        junction.clock = t0 + state.tolerance
    return DONE


@EXACT_ENTRY
def advance(m: MarchArrays, d: TangentArrays, until: Array) -> int:
    """Advance all junctions and their tangents to the end; return a status. As `march.advance`."""
    state = m.state[0]
    needed = d.rows.size
    while True:
        j = furthest_behind(m)
        junction = m.junctions[j]
        if junction.clock >= state.duration - state.tolerance:
            return DONE
        if junction.records >= len(m.pieces) // len(m.junctions):
            return MORE_RECORDS
        if state.pool_used + m.rows.size > len(m.pool):
            return MORE_POOL
        if d.used[0] + needed > len(d.pool):
            return MORE_TANGENTS
        if state.events >= len(m.events):
            return MORE_EVENTS
        if state.intervals >= state.most:
            return PAUSED
        state.intervals += 1
        status = interval(m, d, j, until)
        if status != DONE:
            return int(status)
