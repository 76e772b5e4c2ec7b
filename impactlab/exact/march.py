"""The march of the exact solver, compiled: each junction advances from break to break, events are found by isolation.

A junction is a set of nodes that contacts may tie together. It sees the rest of the scene only through arriving waves,
which the other ends emitted one transit earlier; so junctions advance one by one, the one furthest behind first.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from impactlab.exact.kernel import (
    CHOP,
    CLOSE,
    DONE,
    MORE_EVENTS,
    MORE_POOL,
    MORE_RECORDS,
    OPEN,
    ORDER,
    RESOLVED,
    ROOM,
    TOO_MANY,
    UNRESOLVED,
    ZERO,
    chopped,
    coupled,
    first_fall,
    integrate,
    relax,
    restrict,
)  # fmt: skip
from impactlab.exact.network import Integers, Log, Network
from impactlab.types import Array

BURST = 64  # events within 1e3 merge tolerances that count as endless
INTERVALS = 3_000_000


@njit(cache=True)
def arrivals(net: Network, log: Log, j: int, t0: float, t1: float, waves: Array) -> float:
    """Write the waves that arrive at the ends of junction j on [t0, t1]; return the number of coefficients.

    With t1 < t0 nothing is written; returned is the time up to which every arriving wave is one piece.
    """
    until = net.duration
    longest = 1
    for e in range(net.end_of[j], net.end_of[j + 1]):
        peer = net.end_peer[e]
        source = net.end_junction[peer]
        lag = net.transit[e]
        while log.stop[source, log.cursor[e]] + lag <= t0 + net.tolerance:
            log.cursor[e] += 1
        r = log.cursor[e]
        until = min(until, log.stop[source, r] + lag)
        if t1 > t0:
            begin, end, n = log.start[source, r] + lag, log.stop[source, r] + lag, log.size[source, r]
            row = 2 * (net.node_of[source + 1] - net.node_of[source]) + peer - net.end_of[source]
            at = log.offset[source, r] + row * n
            piece = log.pool[at : at + n]
            n = chopped(piece, n, 0.0)
            out = waves[e - net.end_of[j]]
            if abs(begin - t0) <= net.tolerance and abs(end - t1) <= net.tolerance:
                for k in range(n):
                    out[k] = piece[k]
            else:
                width = end - begin
                n = restrict(piece, n, 2.0 * (t0 - begin) / width - 1.0, 2.0 * (t1 - begin) / width - 1.0, out)
            for k in range(n, ROOM):
                out[k] = 0.0
            out[0] += 0.5 * net.gravity * lag
            longest = max(longest, n)
    return float(longest) if t1 > t0 else until


@njit(cache=True)
def solve_nodes(  # noqa: C901 - one kernel
    net: Network, log: Log, j: int, half: float, waves: Array, longest: int, out: Array, group: Integers,
    bare: Integers, work: Array, dense: Array,
) -> int:  # fmt: skip
    """Write the velocities of the nodes of junction j; return their number of coefficients, 0 where not resolved."""
    base = net.node_of[j]
    nodes = net.node_of[j + 1] - base
    mass = np.zeros(nodes)
    drag = np.zeros(nodes)
    load = np.zeros((nodes, ROOM))
    tied = False
    for i in range(nodes):
        group[i] = i
    for c in range(net.contact_of[j], net.contact_of[j + 1]):
        if log.closed[c] == 1:
            if net.stiffness[c] >= 0.0:
                tied = True
            else:
                old = group[net.right[c] - base]
                new = group[net.left[c] - base]
                for i in range(nodes):
                    if group[i] == old:
                        group[i] = new
    for i in range(nodes):
        g = group[i]
        m = net.mass[base + i]
        mass[g] += m
        drag[g] += net.dashpot[base + i]
        load[g, 0] -= net.spring[base + i] * log.u[base + i]
        if m < np.inf:
            load[g, 0] += m * net.gravity
            tied = tied or net.spring[base + i] > 0.0
    for e in range(net.end_of[j], net.end_of[j + 1]):
        g = group[net.end_node[e] - base]
        drag[g] += net.impedance[e]
        for k in range(longest):
            load[g, k] += 2.0 * net.impedance[e] * waves[e - net.end_of[j], k]
    used = longest
    for i in range(nodes):
        bare[i] = 1 if mass[group[i]] == 0.0 or mass[group[i]] == np.inf else 0
        for k in range(ROOM):
            out[i, k] = 0.0
    if tied:
        if not coupled(net, log, j, half, group, mass, drag, load, out, dense):
            return 0
        used = ORDER
    else:
        for i in range(nodes):
            g = group[i]
            if mass[g] == 0.0 and i == g:
                for k in range(longest):
                    out[g, k] = load[g, k] / drag[g]
            elif mass[g] < np.inf and net.mass[base + i] > 0.0:
                for k in range(longest):
                    load[g, k] *= half / mass[g]
                relax(half * drag[g] / mass[g], load[g], log.v[base + i], out[g], work)
                used = ORDER
                tail = abs(out[g, ORDER - 1]) + abs(out[g, ORDER - 2]) + abs(out[g, ORDER - 3])
                if tail > RESOLVED * log.scale[0]:
                    return 0
    for i in range(nodes):
        if group[i] != i:
            for k in range(used):
                out[i, k] = out[group[i], k]
    n = 1
    for i in range(nodes):
        n = max(n, chopped(out[i], used, CHOP * log.scale[0]))
    return n


@njit(cache=True)
def fill_rows(
    net: Network, log: Log, j: int, half: float, waves: Array, longest: int, v: Array, n: int, rows: Array
) -> int:
    """Write all rows of a record from the velocities v of the nodes; return the number of coefficients."""
    base, ends, contacts = net.node_of[j], net.end_of[j], net.contact_of[j]
    nodes = net.node_of[j + 1] - base
    count = net.end_of[j + 1] - ends
    n = max(n, longest)
    for i in range(2 * nodes + 2 * count + net.contact_of[j + 1] - contacts):
        for k in range(n + 1):
            rows[i, k] = 0.0
    for i in range(nodes):
        for k in range(n):
            rows[i, k] = v[i, k]
        integrate(rows[i], n, half, log.u[base + i], rows[nodes + i])
    for e in range(count):
        row = 2 * nodes + e
        for k in range(n):
            rows[row, k] = v[net.end_node[ends + e] - base, k] - waves[e, k]
        integrate(rows[row], n, half, log.carried[ends + e], rows[row + count])
    for c in range(contacts, net.contact_of[j + 1]):
        if log.closed[c] == 1:
            force = rows[2 * nodes + 2 * count + c - contacts]
            if net.stiffness[c] >= 0.0:
                a, b = net.left[c] - base, net.right[c] - base
                for k in range(n + 1):
                    force[k] = net.stiffness[c] * (rows[nodes + a, k] - rows[nodes + b, k])
                    force[k] += net.damping[c] * (rows[a, k] - rows[b, k])
                force[0] -= net.stiffness[c] * net.gap[c]
            else:
                # the side without mass: what its rods carry away is what the contact gives
                for e in range(count):
                    if net.end_node[ends + e] == net.face[c]:
                        z = net.impedance[ends + e] if net.face[c] == net.right[c] else -net.impedance[ends + e]
                        for k in range(n):
                            force[k] += z * (rows[2 * nodes + e, k] - waves[e, k])
    return n + 1


@njit(cache=True)
def next_event(
    net: Network, log: Log, j: int, n: int, rows: Array, bare: Integers, trial: Array, stack: Array, low: Array,
    high: Array, sizes: Integers, found: Integers,
) -> float:  # fmt: skip
    """Return the place in [-1, 1] of the first event, 2 for none; found holds the contact (or -1) and the kind."""
    base, contacts = net.node_of[j], net.contact_of[j]
    nodes = net.node_of[j + 1] - base
    first_force = 2 * nodes + 2 * (net.end_of[j + 1] - net.end_of[j])
    place = 2.0
    no_gap = ZERO * log.scale[1]
    for c in range(contacts, net.contact_of[j + 1]):
        a, b = net.left[c] - base, net.right[c] - base
        no_force = ZERO * log.scale[0] * net.contact_impedance[c]
        if log.closed[c] == 1:
            force = rows[first_force + c - contacts]
            if net.stiffness[c] < 0.0 and bare[a] == 1:
                total = 0.0
                for k in range(n):
                    total += abs(force[k])
                if total <= no_force:  # faces that rest on each other without force are apart
                    found[0], found[1] = c, OPEN
                    return -1.0
            x = first_fall(force, n, no_force, stack, low, high, sizes)
            if x < place:
                place = x
                found[0], found[1] = c, OPEN
            continue
        for k in range(n):
            trial[k] = rows[nodes + b, k] - rows[nodes + a, k]
        trial[0] += net.gap[c]
        gap = net.gap[c] + log.u[net.right[c]] - log.u[net.left[c]]
        if gap >= -no_gap or net.stiffness[c] < 0.0:
            x = first_fall(trial, n, no_gap, stack, low, high, sizes)
            if x < place:
                place = x
                found[0], found[1] = c, CLOSE
        else:
            # an unloaded spring still behind its contact: it takes load again, or the gap opens
            for k in range(n):
                trial[k] = -trial[k]
            x = first_fall(trial, n, no_gap, stack, low, high, sizes)
            if x < place:
                place = x
                found[0], found[1] = -1, OPEN
            for k in range(n):
                trial[k] = net.damping[c] * (rows[b, k] - rows[a, k]) - net.stiffness[c] * trial[k]
            x = first_fall(trial, n, no_force, stack, low, high, sizes)
            if x < place:
                place = x
                found[0], found[1] = c, CLOSE
    return place


@njit(cache=True)
def march(net: Network, log: Log) -> int:  # noqa: C901 - the one loop
    """Advance all junctions to the end; return DONE, what has run out of room, or why it cannot go on."""
    junctions = len(log.clock)
    widest = 1
    for j in range(junctions):
        rows_j = 2 * (net.node_of[j + 1] - net.node_of[j] + net.end_of[j + 1] - net.end_of[j])
        widest = max(widest, rows_j + net.contact_of[j + 1] - net.contact_of[j])
    rows = np.zeros((widest, ROOM))
    v = np.zeros((widest, ROOM))
    waves = np.zeros((widest, ROOM))
    group = np.zeros(widest, np.int64)
    bare = np.zeros(widest, np.int64)
    work = np.zeros((2, ROOM))
    dense = np.zeros((ORDER * net.unknowns, ORDER * net.unknowns + 1))
    trial = np.zeros(ROOM)
    stack = np.zeros((64, ROOM))
    low = np.zeros(64)
    high = np.zeros(64)
    sizes = np.zeros(64, np.int64)
    found = np.zeros(2, np.int64)
    while True:
        j = int(np.argmin(log.clock))
        t0 = log.clock[j]
        if t0 >= net.duration - net.tolerance:
            return DONE
        nodes, ends = net.node_of[j + 1] - net.node_of[j], net.end_of[j + 1] - net.end_of[j]
        height = 2 * nodes + 2 * ends + net.contact_of[j + 1] - net.contact_of[j]
        if log.records[j] >= log.start.shape[1]:
            return MORE_RECORDS
        if log.tally[0] + height * ROOM > len(log.pool):
            return MORE_POOL
        if log.tally[1] >= len(log.event_time):
            return MORE_EVENTS
        if log.tally[2] > INTERVALS:
            return TOO_MANY
        log.tally[2] += 1
        t1 = arrivals(net, log, j, t0, -np.inf, waves)
        n = 0
        while True:
            half = 0.5 * (t1 - t0)
            longest = int(arrivals(net, log, j, t0, t1, waves))
            n = solve_nodes(net, log, j, half, waves, longest, v, group, bare, work, dense)
            if n > 0:
                break
            t1 = t0 + half
            if half <= net.tolerance:
                return UNRESOLVED
        n = fill_rows(net, log, j, half, waves, longest, v, n, rows)
        place = next_event(net, log, j, n, rows, bare, trial, stack, low, high, sizes, found)
        event = t1 if place > 1.0 else t0 + half * (place + 1.0)
        if place <= 1.0 and event < t1:
            if event > t0 + net.tolerance:
                for i in range(height):
                    m = restrict(rows[i], n, -1.0, place, trial)
                    for k in range(n):
                        rows[i, k] = trial[k] if k < m else 0.0
            t1 = event
        if t1 > t0 + net.tolerance:
            r = log.records[j]
            log.start[j, r], log.stop[j, r] = t0, t1
            log.size[j, r], log.offset[j, r] = n, log.tally[0]
            at = log.tally[0]
            for i in range(height):
                total = 0.0
                bound = 0.0
                for k in range(n):
                    log.pool[at + i * n + k] = rows[i, k]
                    total += rows[i, k]
                    bound += abs(rows[i, k])
                if i < nodes:
                    log.v[net.node_of[j] + i] = total
                    log.scale[0] = max(log.scale[0], bound)
                elif i < 2 * nodes:
                    log.u[net.node_of[j] + i - nodes] = total
                    log.scale[1] = max(log.scale[1], 0.01 * bound)
                elif i >= 2 * nodes + ends and i < 2 * nodes + 2 * ends:
                    log.carried[net.end_of[j] + i - 2 * nodes - ends] = total
            log.tally[0] += height * n
            log.records[j] += 1
            log.clock[j] = t1
        if place <= 1.0 and found[0] >= 0:
            log.closed[found[0]] = found[1]
            k = log.tally[1]
            log.event_time[k], log.event_contact[k], log.event_kind[k] = t1, found[0], found[1]
            log.tally[1] += 1
            if t1 > log.burst[j] + 1e3 * net.tolerance:
                log.burst[j] = t1
                log.bursts[j] = 0
            log.bursts[j] += 1
            if log.bursts[j] > BURST:
                return TOO_MANY
        elif place <= 1.0 and t1 <= t0 + net.tolerance:
            log.clock[j] = t0 + net.tolerance
