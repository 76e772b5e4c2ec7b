"""The march of the exact solver: junctions advance from break to break.

Events are found by root isolation; the code is compiled. A junction is a set of nodes that contacts may tie together.
The rest of the scene acts on it only by arriving waves, emitted at the other ends one transit earlier; so junctions
advance one by one, the one furthest behind first. Springs are solved by a function that is compiled separately and
called by address: scenes without springs never compile it.
"""

from __future__ import annotations

from typing import Any, cast

from impactlab.exact import branch_changes, spring_systems
from impactlab.exact.arrays import (
    CHANGE,
    DONE,
    MORE_EVENTS,
    MORE_POOL,
    MORE_RECORDS,
    PAUSED,
    TOO_MANY,
    UNRESOLVED,
    MarchArrays,
)
from impactlab.exact.crossings import next_event
from impactlab.exact.kernel import MAX_DEPTH, ROOM, chopped, restrict, within
from impactlab.exact.merging import joined
from impactlab.exact.nodes import fill_rows, solve_nodes
from impactlab.exact.setup.end_loads import next_sample, write_end_loads
from impactlab.exact.setup.network import Log
from impactlab.numerics.addresses import COMPILED, call, entered_with_table, load, type_of
from impactlab.numerics.compiling import EXACT_ENTRY, EXACT_INLINE, EXACT_PART
from impactlab.numerics.windows import window
from impactlab.types import Array

WAVE_TOL = 1.1e-16  # of the sum of a wave's coefficients, half its rounding: smaller ones at its end are noise
MAX_BURST = 64  # events within 1e3 merge tolerances; more count as infinitely many


@EXACT_PART
def horizon(m: MarchArrays, j: int) -> float:
    """Return the end of the present pieces of junction j's arriving waves [s].

    Up to this time, every wave that arrives is one piece.
    """
    state, junction = m.state[0], m.junctions[j]
    room = len(m.pieces) // len(m.junctions)
    until = state.duration
    for e in range(junction.first_end, junction.last_end):
        end = m.ends[e]
        while m.pieces[room * end.source + end.cursor].stop + end.transit <= junction.clock + state.tolerance:
            end.cursor += 1
        until = min(until, m.pieces[room * end.source + end.cursor].stop + end.transit)
    return float(until)


@EXACT_PART
def arrivals(m: MarchArrays, j: int, t0: float, t1: float) -> int:
    """Write the waves arriving at junction j on [t0, t1]; return their number of coefficients."""
    state, junction = m.state[0], m.junctions[j]
    room = len(m.pieces) // len(m.junctions)
    longest = 1
    trial = m.stack[MAX_DEPTH]
    for e in range(junction.first_end, junction.last_end):
        end = m.ends[e]
        piece = m.pieces[room * end.source + end.cursor]
        begin, stop, n = piece.start + end.transit, piece.stop + end.transit, piece.size
        sent = window(m.pool, piece.offset + end.row * n, n)
        for k in range(n):
            trial[k] = sent[k]
        n = chopped(trial, n, 0.0)
        wave = m.waves[e - junction.first_end]
        if n == 1:
            wave[0] = trial[0]
        elif abs(begin - t0) <= state.tolerance and abs(stop - t1) <= state.tolerance:
            for k in range(n):
                wave[k] = trial[k]
        else:
            width = stop - begin
            state.work += 2 * n * n
            low, high = within(2.0 * (t0 - begin) / width - 1.0), within(2.0 * (t1 - begin) / width - 1.0)
            n = restrict(trial, n, low, high, wave)
        if n > 1:
            bound = 0.0
            for k in range(n):
                bound += abs(wave[k])
            n = chopped(wave, n, WAVE_TOL * bound)
        for k in range(n, ROOM):
            wave[k] = 0.0
        wave[0] += 0.5 * state.gravity * end.transit
        longest = max(longest, n)
    return longest


@EXACT_PART
def keep(m: MarchArrays, j: int, t0: float, t1: float, n: int) -> None:
    """Write the record of junction j on [t0, t1]; move the junction to its end."""
    state, junction = m.state[0], m.junctions[j]
    nodes, ends = junction.nodes, junction.ends
    last = len(m.pieces) // len(m.junctions) * j + junction.records - 1
    whole = joined(m, j, t0, t1, n)
    at = state.pool_used
    if whole > 0:
        piece = m.pieces[last]
        n = whole
        if n <= piece.size:
            at = piece.offset
    else:
        piece = m.pieces[last + 1]
        piece.start = t0
        junction.records += 1
        junction.broken = 0
        junction.shifted = 0.0
    piece.stop, piece.size, piece.offset = t1, n, at
    for i in range(junction.rows):
        total = 0.0
        bound = 0.0
        row, kept = m.rows[i], window(m.pool, at, n)
        for k in range(n):
            kept[k] = row[k]
            total += row[k]
            bound += abs(row[k])
        at += n
        if i < nodes:
            m.nodes[junction.first_node + i].v = total
            state.fastest = max(state.fastest, bound)
        elif i < 2 * nodes:
            m.nodes[junction.first_node + i - nodes].u = total
            state.farthest = max(state.farthest, 0.01 * bound)
        elif 2 * nodes + ends <= i < 2 * nodes + 2 * ends:
            m.ends[junction.first_end + i - 2 * nodes - ends].carried = total
    state.pool_used = max(state.pool_used, at)
    junction.clock = t1


@EXACT_PART
def apply_event(m: MarchArrays, j: int, t: float) -> bool:
    """Open or close a contact, or change its branch; return False if events accumulate."""
    state, junction = m.state[0], m.junctions[j]
    event, contact = m.events[state.events], m.contacts[state.contact]
    if state.kind >= CHANGE:
        call(m.changes, m, j, -1)
    else:
        contact.closed = state.kind
    event.time, event.contact, event.kind = t, state.contact, state.kind
    event.branch, event.constant, event.set = contact.branch, contact.constant, contact.set
    state.events += 1
    junction.broken = 1
    if t > junction.burst + 1e3 * state.tolerance:
        junction.burst = t
        junction.bursts = 0
    junction.bursts += 1
    return bool(junction.bursts <= MAX_BURST)


@EXACT_PART
def cut(m: MarchArrays, j: int, n: int, place: float) -> None:
    """Restrict the rows of a record to the part before a place in [-1, 1]."""
    trial = m.stack[MAX_DEPTH]
    for i in range(m.junctions[j].rows):
        # A row keeps its degree: its last zeros would become rounding, which grows with every event.
        row = m.rows[i]
        kept = restrict(row, chopped(row, n, 0.0), -1.0, place, trial)
        for k in range(n):
            row[k] = trial[k] if k < kept else 0.0


@EXACT_INLINE
def interval(m: MarchArrays, j: int) -> int:
    """Advance junction j to its next break or event; return a status."""
    state, junction = m.state[0], m.junctions[j]
    t0 = junction.clock
    t1 = horizon(m, j)
    if junction.loaded == 1:
        t1 = min(t1, next_sample(m, j))
    while True:
        half = 0.5 * (t1 - t0)
        longest = arrivals(m, j, t0, t1)
        if junction.loaded == 1:
            longest = max(longest, write_end_loads(m, j, t0, t1))
        n = solve_nodes(m, j, half, longest)
        if n > 0:
            break
        t1 = t0 + half
        if half <= state.tolerance:
            return UNRESOLVED
    n = fill_rows(m, j, half, longest, n)
    state.work += 4 * n * (junction.nodes + junction.ends)
    place = next_event(m, j, n, half)
    event = t1 if place > 1.0 else t0 + half * (place + 1.0)
    if place <= 1.0 and event < t1:
        if event > t0 + state.tolerance:
            state.work += 2 * n * n * junction.rows
            cut(m, j, n, place)
        t1 = event
    if t1 > t0 + state.tolerance:
        keep(m, j, t0, t1, n)
    if place <= 1.0 and state.contact >= 0:
        return DONE if apply_event(m, j, t1) else TOO_MANY
    if place <= 1.0 and t1 <= t0 + state.tolerance:
        junction.clock = t0 + state.tolerance
    return DONE


@EXACT_PART
def furthest_behind(m: MarchArrays) -> int:
    """Return the junction whose clock is furthest behind; of several the first."""
    j = len(m.junctions) - 1  # not a literal, which would be compiled as another type
    for other in range(j - 1, -1, -1):
        if m.junctions[other].clock <= m.junctions[j].clock:
            j = other
    return j


@EXACT_ENTRY
def advance(m: MarchArrays) -> int:
    """Advance all junctions to the end; return a status.

    It is DONE, an array that is full, or the reason of a stop.
    """
    state = m.state[0]
    while True:
        j = furthest_behind(m)
        junction = m.junctions[j]
        if junction.clock >= state.duration - state.tolerance:
            return DONE
        if junction.records >= len(m.pieces) // len(m.junctions):
            return MORE_RECORDS
        if state.pool_used + m.rows.size > len(m.pool):
            return MORE_POOL
        if state.events >= len(m.events):
            return MORE_EVENTS
        if state.intervals >= state.most:
            return PAUSED
        state.intervals += 1
        status = interval(m, j)
        if status != DONE:
            return int(status)


def prepared(log: Log) -> Log:
    """Return the log ready for `march`: compiled code is loaded, which counts as set-up."""
    memory, entry = log.memory, cast(Any, advance)
    if _largest(log.contacts["stiffness"]) >= 0.0 or _largest(log.nodes["spring"]) > 0.0:
        memory = memory._replace(coupled=spring_systems.address(memory))
    if _largest(log.contacts["branch"]) >= 0:
        memory = memory._replace(changes=branch_changes.address(memory))
    if COMPILED and not entry.overloads:  # the type takes longer to find than a short march
        load(entry, (type_of(memory),))
    return log._replace(memory=memory)


def _largest(values: Array) -> float:
    """Return the largest of few values, -1 for none, in a fifth of numpy's time."""
    return float(max(values.tolist(), default=-1.0))


def march(log: Log) -> int:
    """Advance all junctions to the end; return a status.

    It is DONE, an array that is full, or the reason of a stop.
    """
    return int(entered_with_table(advance, log.memory))
