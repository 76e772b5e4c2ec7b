"""Many marches in one compiled call, in one memory.

For each, the numbers are written, the march is made, and its results are read. The march is
`impactlab.exact.march.advance`, which single runs use. The interpreter's lock is released meanwhile, so that several
threads march, each in a memory of its own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from impactlab.exact.arrays import DONE, MORE_EVENTS, MORE_POOL, MORE_RECORDS, MarchArrays
from impactlab.exact.batch.grazing import GAP_ROOM, grazes
from impactlab.exact.batch.pattern import Pattern
from impactlab.exact.batch.reading import energy, momentum
from impactlab.exact.batch.results import BALANCE_TOL, balance, find_spans, may_be_noise, mean_velocity, restitution
from impactlab.exact.batch.writing import round_trip_at, write
from impactlab.exact.march import advance
from impactlab.exact.periods import CONTACT, IMPULSE, PEAK, SPAN_COLUMNS, START, STOP
from impactlab.numerics.compiling import EXACT_PART, RELEASING_ENTRY
from impactlab.types import Array, Ints

MAX_INTERVALS = 50_000  # of a march in a batch, some tenths of a second: longer ones are runs of their own
OF_CONTACT = ("contacts", "first_opening", "time_in_contact", "impulse", "peak_force")
OF_PAIR = ("restitution",)
OF_BODY = ("final_velocity", "final_momentum", "final_energy")
OF_WHOLE = ("energy_gain", "near_grazing")
"""Results of a point: of each contact and pair of the scene, of each body that moves, of the whole, in this order."""

PEAKS, ENERGIES, GRAZES, RESTITUTIONS, VELOCITIES, MOMENTA = 1, 2, 4, 8, 16, 32  # bits of requested results
WANTED = {
    "peak_force": PEAKS, "final_energy": ENERGIES, "near_grazing": GRAZES, "restitution": RESTITUTIONS,
    "final_velocity": VELOCITIES, "final_momentum": MOMENTA,
}  # fmt: skip
WRITTEN, BARE = -1, -2  # in place of results
SERVED, LEFT, UNPROVED, STOPPED = 1, 2, 3, 4
"""States of a point: done, or left to a run of its own: for its pattern or noise, its balance, or its length."""


class Numbers(NamedTuple):
    """The numbers of many points: a scene's, and the values of axes.

    The values of axes replace some of the first scene's numbers. Value k of axis a at point i is number ``(i //
    divisor[a]) % size[a]`` of it; it writes ``counts[a]`` entries.
    """

    base: Array  # the vector of the scene
    divisor: Ints  # (axes,)
    size: Ints  # (axes,)
    first: Ints  # (axes + 1,) into `entries`
    entries: Ints  # places in the vector
    start: Ints  # (axes,) into `values`
    values: Array  # of each axis (size, its entries)


class ResultArrays(NamedTuple):
    """Memory that a march and its results need beside the arrays of the march."""

    vector: Array
    places: Array
    speeds: Array
    openings: Array
    arrivals: Array
    group: Array
    spans: Array
    touches: Array
    gap: Array


def result_arrays(m: MarchArrays, q: Pattern, numbers: Numbers) -> ResultArrays:
    """Return the room for results of marches in these arrays."""
    contacts, spans = len(m.contacts), len(m.events) + len(m.contacts)
    return ResultArrays(
        np.zeros(len(numbers.base)), np.zeros(len(q.cuts)), np.zeros(len(m.ends)), np.zeros(contacts),
        np.zeros(contacts), np.zeros(len(q.bodies)), np.zeros((spans, SPAN_COLUMNS)),
        np.zeros((spans, SPAN_COLUMNS)), np.zeros(GAP_ROOM),
    )  # fmt: skip


@EXACT_PART
def write_vector(numbers: Numbers, point: int, p: Array) -> None:
    """Write the vector of a point."""
    for k in range(len(p)):
        p[k] = numbers.base[k]
    for a in range(len(numbers.size)):
        count = numbers.first[a + 1] - numbers.first[a]
        place = numbers.start[a] + count * ((point // numbers.divisor[a]) % numbers.size[a])
        for k in range(count):
            p[numbers.entries[numbers.first[a] + k]] = numbers.values[place + k]


@EXACT_PART
def read_contacts(m: MarchArrays, q: Pattern, r: ResultArrays, count: int, out: Array) -> None:
    """Write the results of the contacts."""
    for c in range(len(m.contacts)):
        at = len(OF_CONTACT) * q.contacts[c].place
        for k in range(len(OF_CONTACT)):
            out[at + k] = 0.0
        out[at + 1] = r.openings[c]
    for k in range(count):
        span = r.spans[k]
        at = len(OF_CONTACT) * q.contacts[int(span[CONTACT])].place
        out[at] += 1.0
        out[at + 2] += min(span[STOP], m.state[0].duration) - span[START]
        out[at + 3] += span[IMPULSE]
        out[at + 4] = max(out[at + 4], span[PEAK])


@EXACT_PART
def read(m: MarchArrays, q: Pattern, r: ResultArrays, wanted: int, out: Array) -> int:
    """Write the results of a finished march; return whether they stand, or why not."""
    p, t = r.vector, m.state[0].duration
    count = find_spans(m, r.spans, r.openings, wanted & PEAKS != 0)
    if may_be_noise(m, q, p, r.spans, count, r.arrivals):
        return LEFT
    gain = balance(m, q, p, r.spans, count, r.group)
    if not abs(gain) <= BALANCE_TOL:
        return UNPROVED
    read_contacts(m, q, r, count, out)
    at = len(OF_CONTACT) * len(m.contacts)
    if wanted & RESTITUTIONS != 0:
        for pair in range(len(q.pairs)):
            out[at + pair] = restitution(m, q, p, pair, r.spans, count)
    at += len(q.pairs)
    for b in range(len(q.bodies)):
        place = at + len(OF_BODY) * q.bodies[b].place
        if place >= at:
            if wanted & VELOCITIES != 0:
                out[place] = mean_velocity(m, q, p, b, t, r.spans, count)
            if wanted & MOMENTA != 0:
                out[place + 1] = momentum(m, q, b, t)
            if wanted & ENERGIES != 0:
                out[place + 2] = energy(m, q, b, t)
    at += len(OF_BODY) * q.whole[0].moving
    out[at] = max(0.0, gain)
    out[at + 1] = 0.0
    if wanted & GRAZES != 0:
        for c in range(len(m.contacts)):
            if grazes(m, c, r.spans, count, round_trip_at(q, p, c), r.touches, r.gap):
                out[at + 1] = 1.0
                break
    return SERVED


@RELEASING_ENTRY
def march_points(
    m: MarchArrays, q: Pattern, numbers: Numbers, r: ResultArrays, points: Ints, first: int, wanted: int, out: Array,
    states: Ints,
) -> int:  # fmt: skip
    """March points[first:] one after another; return how many are done.

    These are all points unless an array of the march is full. Row k of ``out`` gets the results of points[k],
    ``states[k]`` whether they stand. ``wanted`` are bits of results; with `WRITTEN` the network is written and nothing
    marches, with `BARE` no results are read.
    """
    for k in range(first, len(points)):
        write_vector(numbers, points[k], r.vector)
        if not write(m, q, r.vector, r.places, r.speeds, MAX_INTERVALS):
            states[k] = LEFT
            continue
        if wanted == WRITTEN:
            continue
        status = advance(m)
        if wanted == BARE:
            continue
        if status == DONE:
            states[k] = read(m, q, r, wanted, out[k])
        elif status in (MORE_RECORDS, MORE_POOL, MORE_EVENTS):
            return k
        else:
            states[k] = STOPPED
    return len(points)
