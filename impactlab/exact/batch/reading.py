"""Compiled signals of a march and their integrals, those of `exact.results.signals` one number at a time."""

from __future__ import annotations

import numpy as np

from impactlab.exact.arrays import MarchArrays
from impactlab.exact.batch.pattern import Pattern
from impactlab.exact.kernel import ROOM, chopped, restrict, value, within
from impactlab.numerics.compiling import EXACT_PART
from impactlab.types import Array

POWERS = np.array([2.0 / (1.0 - k * k) if k % 2 == 0 else 0.0 for k in range(2 * ROOM + 2)])
"""Integral of each Chebyshev polynomial over [-1, 1]."""


@EXACT_PART
def piece_at(m: MarchArrays, j: int, t: float) -> int:
    """Return the piece of junction j at time t; at a break the later one."""
    first = len(m.pieces) // len(m.junctions) * j
    low, high = 0, m.junctions[j].records - 1
    until = t + m.state[0].tolerance
    while low < high:
        middle = (low + high) // 2
        if m.pieces[first + middle].stop <= until:
            low = middle + 1
        else:
            high = middle
    return first + low


@EXACT_PART
def row_at(m: MarchArrays, j: int, row: int, t: float) -> float:
    """Return a row of junction j at time t."""
    piece = m.pieces[piece_at(m, j, t)]
    at = piece.offset + row * piece.size
    y = within((2.0 * t - piece.start - piece.stop) / (piece.stop - piece.start))
    return float(value(m.pool[at : at + piece.size], piece.size, y))


@EXACT_PART
def node_at(m: MarchArrays, node: int, t: float, displaced: bool) -> float:
    """Return the displacement or velocity of a node at time t [m or m/s]."""
    junction = m.junctions[m.nodes[node].junction]
    row = node - junction.first_node + (junction.nodes if displaced else 0)
    return float(row_at(m, m.nodes[node].junction, row, t))


@EXACT_PART
def mean(a: Array, n: int, square: bool) -> float:
    """Return the integral over [-1, 1] of a series a[:n] or its square."""
    total = 0.0
    for i in range(n):
        if square:
            own = 0.5 * (POWERS[2 * i] + POWERS[0]) * a[i]
            for k in range(i - 2, -1, -2):
                own += (POWERS[i + k] + POWERS[i - k]) * a[k]
            total += own * a[i]
        elif i % 2 == 0:
            total += POWERS[i] * a[i]
    return total


@EXACT_PART
def integral(m: MarchArrays, j: int, row: int, t0: float, t1: float, square: bool) -> float:
    """Return the integral of a row of junction j from t0 to t1.

    With ``square`` it is that of the square of the row.
    """
    first, last = piece_at(m, j, t0), piece_at(m, j, t1)
    total = 0.0
    part = m.waves[0]
    for r in range(first, last + 1):
        piece = m.pieces[r]
        at, half = piece.offset + row * piece.size, 0.5 * (piece.stop - piece.start)
        a = m.pool[at : at + piece.size]
        n = chopped(a, piece.size, 0.0)
        low = within((t0 - piece.start) / half - 1.0) if r == first else -1.0
        high = within(1.0 - (piece.stop - t1) / half) if r == last else 1.0
        if n == 1:
            total += half * (high - low) * (a[0] * a[0] if square else a[0])
        elif low == -1.0 and high == 1.0:
            total += half * mean(a, n, square)
        else:
            size = restrict(a, n, low, high, part)
            total += half * 0.5 * (high - low) * mean(part, size, square)
    return total


@EXACT_PART
def wave_integral(m: MarchArrays, end: int, t0: float, t1: float, carried: bool) -> float:
    """Return the integral of an end's squared wave, or ``carried`` of its time integral, from t0 to t1."""
    j = m.ends[end].junction
    junction = m.junctions[j]
    row = 2 * junction.nodes + end - junction.first_end + (junction.ends if carried else 0)
    return float(integral(m, j, row, t0, t1, not carried))


@EXACT_PART
def integrated_wave(m: MarchArrays, end: int, t: float) -> float:
    """Return the time integral of the wave of an end at time t [m]."""
    j = m.ends[end].junction
    junction = m.junctions[j]
    return float(row_at(m, j, 2 * junction.nodes + junction.ends + end - junction.first_end, t))


@EXACT_PART
def momentum(m: MarchArrays, q: Pattern, b: int, t: float) -> float:
    """Return the momentum of a body at time t [N s].

    End masses are included; it is 0 for a body that never moves.
    """
    total, body = 0.0, q.bodies[b]
    for k in range(body.first_link, body.last_link):
        left, right = m.ends[q.links[k].left_end], m.ends[q.links[k].right_end]
        lag = left.transit
        inside = 0.5 * m.state[0].gravity * lag * lag
        for end in (q.links[k].left_end, q.links[k].right_end):
            inside += integrated_wave(m, end, t) - integrated_wave(m, end, t - lag)
        total += right.impedance * inside
    for n in range(len(q.nodes)):
        if q.nodes[n].body == b and 0.0 < m.nodes[n].mass < np.inf:
            total += m.nodes[n].mass * node_at(m, n, t, False)
    return total


@EXACT_PART
def energy(m: MarchArrays, q: Pattern, b: int, t: float) -> float:
    """Return the energy of a body with its ends at time t [J].

    End masses and end springs are counted; the energy of a body that never moves is 0.
    """
    total, body, gravity = 0.0, q.bodies[b], m.state[0].gravity
    for k in range(body.first_link, body.last_link):
        lag, inside = m.ends[q.links[k].left_end].transit, 0.0
        for end in (q.links[k].left_end, q.links[k].right_end):
            inside += wave_integral(m, end, t - lag, t, False)
            if gravity != 0.0:  # on the way a wave gains g/2 times its age
                more = wave_integral(m, end, t - lag, t, True) - integrated_wave(m, end, t - lag) * lag
                inside += gravity * more + gravity * gravity * lag**3 / 12.0
        total += m.ends[q.links[k].left_end].impedance * inside
    for n in range(len(q.nodes)):
        if q.nodes[n].body != b:
            continue
        node = m.nodes[n]
        if 0.0 < node.mass < np.inf:
            total += 0.5 * node.mass * node_at(m, n, t, False) ** 2
        if node.spring > 0.0:
            total += 0.5 * node.spring * node_at(m, n, t, True) ** 2
    return total


@EXACT_PART
def load_work(m: MarchArrays, q: Pattern, b: int, t: float) -> float:
    """Return the work of gravity and end forces on a body from 0 to t [J]."""
    total, body, gravity = 0.0, q.bodies[b], m.state[0].gravity
    for k in range(body.first_link, body.last_link):
        lag = m.ends[q.links[k].left_end].transit
        if gravity != 0.0:
            z = m.ends[q.links[k].left_end].impedance
            for end in (q.links[k].left_end, q.links[k].right_end):
                inside = wave_integral(m, end, t - lag, t, True) - wave_integral(m, end, -lag, 0.0, True)
                total += z * gravity * inside
            total += z * gravity * 0.5 * gravity * lag * lag * t
    for n in range(len(q.nodes)):
        if q.nodes[n].body != b:
            continue
        node = m.nodes[n]
        load = node.end_force + (node.mass * gravity if 0.0 < node.mass < np.inf else 0.0)
        if load != 0.0:
            total += load * (node_at(m, n, t, True) - node_at(m, n, 0.0, True))
    return total


@EXACT_PART
def dashpot_loss(m: MarchArrays, t: float) -> float:
    """Return the energy that the dashpots at ends took from 0 to t [J]."""
    total = 0.0
    for n in range(len(m.nodes)):
        node = m.nodes[n]
        if node.dashpot > 0.0:
            row = n - m.junctions[node.junction].first_node
            total += node.dashpot * integral(m, node.junction, row, 0.0, t, True)
    return total


@EXACT_PART
def spring_energy(m: MarchArrays, c: int, t: float) -> float:
    """Return the energy of a spring contact at time t [J]."""
    contact = m.contacts[c]
    depth = node_at(m, contact.left, t, True) - node_at(m, contact.right, t, True) - contact.gap
    return float(0.5 * contact.stiffness * max(0.0, depth) ** 2)


@EXACT_PART
def contact_loss(m: MarchArrays, c: int, t: float) -> float:
    """Return the loss in a contact's dashpot from 0 to t [J]; see `energies.SpringContact`."""
    contact, total = m.contacts[c], 0.0
    j = m.nodes[contact.left].junction
    junction = m.junctions[j]
    a, b = contact.left - junction.first_node, contact.right - junction.first_node
    force = 2 * junction.nodes + 2 * junction.ends + c - junction.first_contact
    for r in range(piece_at(m, j, 0.0), piece_at(m, j, t) + 1):
        piece = m.pieces[r]
        begin, until, n = max(piece.start, 0.0), min(piece.stop, t), piece.size
        loaded = False
        for k in range(n):
            loaded = loaded or m.pool[piece.offset + force * n + k] != 0.0
        if not loaded:
            total += max(0.0, spring_energy_in(m, c, r, begin) - spring_energy_in(m, c, r, until))
            continue
        rate, part = m.waves[0], m.waves[1]
        for k in range(n):
            rate[k] = m.pool[piece.offset + a * n + k] - m.pool[piece.offset + b * n + k]
        half = 0.5 * (piece.stop - piece.start)
        size = restrict(rate, n, (begin - piece.start) / half - 1.0, (until - piece.start) / half - 1.0, part)
        total += contact.damping * 0.5 * (until - begin) * mean(part, size, True)
    return total


@EXACT_PART
def spring_energy_in(m: MarchArrays, c: int, r: int, t: float) -> float:
    """Return the energy of a spring contact at time t in piece r [J]."""
    contact, piece = m.contacts[c], m.pieces[r]
    junction = m.junctions[m.nodes[contact.left].junction]
    y, n = (2.0 * t - piece.start - piece.stop) / (piece.stop - piece.start), piece.size
    left = piece.offset + (junction.nodes + contact.left - junction.first_node) * n
    right = piece.offset + (junction.nodes + contact.right - junction.first_node) * n
    depth = value(m.pool[left : left + n], n, y) - value(m.pool[right : right + n], n, y) - contact.gap
    return float(0.5 * contact.stiffness * max(0.0, depth) ** 2)
