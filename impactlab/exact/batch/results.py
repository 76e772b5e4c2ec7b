"""Results of a march, compiled: periods of contact, impulses, peak forces, restitution, momenta, energies, balance.

The definitions are those of histories (`impactlab.exact.results.history`, `impactlab.metrics.collisions`). Touches that
may be noise are not judged here: such a point is left to a run of its own.
"""

from __future__ import annotations

import math

import numpy as np

from impactlab.exact.arrays import MarchArrays
from impactlab.exact.batch.arrivals import first_arrivals
from impactlab.exact.batch.pattern import END, Pattern
from impactlab.exact.batch.reading import contact_loss, dashpot_loss, energy, load_work, momentum, spring_energy
from impactlab.exact.batch.writing import DENSITY, LENGTH, MASS, round_trip, velocity_of
from impactlab.exact.periods import CONTACT, IMPULSE, SPAN_COLUMNS, START, STOP, finish_span
from impactlab.history.energy import MIN_ENERGY
from impactlab.history.noise_floor import MAX_EARLY, MIN_OPENING, MIN_SHARE
from impactlab.metrics.collisions import MIN_APPROACH
from impactlab.metrics.third_bodies import MAX_SHARE
from impactlab.numerics.compiling import EXACT_PART
from impactlab.types import Array

BALANCE_TOL = 2e-13  # of the reference energy: a larger error of the balance is left to a run of its own
NOISE_ROOM = 2.0  # times the noise floor: a touch below it is left to a run of its own


@EXACT_PART
def find_spans(m: MarchArrays, spans: Array, openings: Array, peaks: bool) -> int:
    """Write the periods of contact in order of their starts; return how many.

    ``openings`` gets the first one of each contact of the network, NaN for none.
    """
    count, duration = 0, m.state[0].duration
    for c in range(len(m.contacts)):
        openings[c] = np.nan
        began = -1.0
        first = count
        for k in range(m.state[0].events):
            event = m.events[k]
            if event.contact != c or event.time > duration:
                continue
            if event.kind == 1:
                began = event.time
                continue
            if math.isnan(openings[c]):
                openings[c] = event.time
            if began >= 0.0:
                spans[count, CONTACT], spans[count, START], spans[count, STOP] = c, began, event.time
                count += 1
                began = -1.0
        if began >= 0.0:
            spans[count, CONTACT], spans[count, START], spans[count, STOP] = c, began, np.inf
            count += 1
        for k in range(first, count):
            finish_span(m, spans[k], peaks)
    for k in range(1, count):  # insertion: those of a contact are in order
        at = k
        while at > 0 and spans[at - 1, START] > spans[at, START]:
            for column in range(SPAN_COLUMNS):
                spans[at, column], spans[at - 1, column] = spans[at - 1, column], spans[at, column]
            at -= 1
    return count


@EXACT_PART
def may_be_noise(m: MarchArrays, q: Pattern, p: Array, spans: Array, count: int, arrivals: Array) -> bool:
    """Return whether a period of contact is weak, earlier than any wave, or split (`noise_floor`)."""
    strongest = 0.0
    for k in range(count):
        strongest = max(strongest, abs(spans[k, IMPULSE]))
    for k in range(count):
        if abs(spans[k, IMPULSE]) <= NOISE_ROOM * MIN_SHARE * strongest:
            return True
        for i in range(k):
            same = spans[i, CONTACT] == spans[k, CONTACT]
            if same and spans[k, START] - spans[i, STOP] <= NOISE_ROOM * MIN_OPENING * spans[k, START]:
                return True
    first_arrivals(m, q, p, arrivals)
    early = False
    for k in range(count):
        early = early or spans[k, START] < (1.0 - MAX_EARLY) * arrivals[int(spans[k, CONTACT])]
    return early


@EXACT_PART
def mass_of(q: Pattern, p: Array, b: int) -> float:
    """Return the mass that the momentum of a body moves [kg]; 0 of a wall."""
    body, total = q.bodies[b], 0.0
    if body.rigid == 1:
        return float(p[body.first]) if body.place >= 0 else 0.0
    for k in range(body.segments):
        at = body.first_segment + 4 * k
        total += p[at + DENSITY] * p[at + 1] * p[at + LENGTH]
    for n in range(len(q.nodes)):
        if q.nodes[n].body == b and q.nodes[n].kind == END and q.nodes[n].support == MASS:
            total += p[q.nodes[n].value]
    return total


@EXACT_PART
def end_force(m: MarchArrays, q: Pattern, b: int) -> float:
    """Return the sum of the forces on the ends of a body [N]."""
    total = 0.0
    for n in range(len(q.nodes)):
        if q.nodes[n].body == b:
            total += m.nodes[n].end_force
    return total


@EXACT_PART
def size_of_end_forces(m: MarchArrays, q: Pattern, b: int) -> float:
    """Return the sum of sizes of the end forces on a body [N]."""
    total = 0.0
    for n in range(len(q.nodes)):
        if q.nodes[n].body == b:
            total += abs(m.nodes[n].end_force)
    return total


@EXACT_PART
def mean_velocity(m: MarchArrays, q: Pattern, p: Array, b: int, t: float, spans: Array, count: int) -> float:
    """Return the momentum of a body over its mass at time t [m/s].

    That of a free one follows from the impulses that it was given.
    """
    body = q.bodies[b]
    if body.place < 0:
        return 0.0
    mass, given, busy = mass_of(q, p, b), 0.0, -1.0
    for k in range(count):
        of = q.contacts[int(spans[k, CONTACT])]
        sign = (1.0 if of.right_body == b else 0.0) - (1.0 if of.left_body == b else 0.0)
        if sign != 0.0 and spans[k, START] <= t:
            given += sign * spans[k, IMPULSE]
            busy = max(busy, spans[k, STOP])
    if busy <= t and body.held == 0:
        loads = (mass * m.state[0].gravity if body.falls == 1 else 0.0) + end_force(m, q, b)
        return float(velocity_of(q, p, b) + (given + loads * t) / mass)
    return float(momentum(m, q, b, min(max(t, 0.0), m.state[0].duration)) / mass)


@EXACT_PART
def speed(m: MarchArrays, q: Pattern, p: Array, b: int, t: float, spans: Array, count: int) -> float:
    """Return the speed of a body in a collision [m/s].

    It is 0 for a held body, which rests except for its vibration.
    """
    return 0.0 if q.bodies[b].held == 1 else mean_velocity(m, q, p, b, t, spans, count)


@EXACT_PART
def restitution(m: MarchArrays, q: Pattern, p: Array, pair: int, spans: Array, count: int) -> float:
    """Return the apparent restitution of a pair's first collision; NaN for none.

    Bodies that have not parted at the end of the run have none, nor have bodies of which one touches a third one
    meanwhile, is driven into the other, or is under an end force, as in `impactlab.metrics.collisions`.
    """
    left, right = q.pairs[pair].left, q.pairs[pair].right
    longest, fastest = 0.0, 0.0
    for b in (left, right):
        if q.bodies[b].rigid == 0:
            longest = max(longest, 2.0 * round_trip(q, p, b))
    for b in range(len(q.bodies)):
        fastest = max(fastest, abs(velocity_of(q, p, b)))
    start, until, impulse = -1.0, -np.inf, 0.0
    for k in range(count):
        if q.contacts[int(spans[k, CONTACT])].pair != pair:
            continue
        if start >= 0.0 and spans[k, START] - until > longest:
            break
        if start < 0.0:
            start = spans[k, START]
        until, impulse = max(until, spans[k, STOP]), impulse + spans[k, IMPULSE]
    if start < 0.0 or until == np.inf:
        return np.nan
    striker, other, sign = left, right, 1.0
    if rank(q, p, left) < rank(q, p, right):
        striker, other, sign = right, left, -1.0
    for b in (striker, other):
        pushed = others_impulse(q, pair, b, start, until, spans, count) > MAX_SHARE * impulse
        if q.bodies[b].place >= 0 and (pushed or size_of_end_forces(m, q, b) * (until - start) > MAX_SHARE * impulse):
            return np.nan
    before = np.nextafter(start, -1.0)
    approach, driven = speed(m, q, p, striker, before, spans, count), speed(m, q, p, other, before, spans, count)
    if abs(driven) > abs(approach) and others_impulse(q, pair, other, before, start, spans, count) > 0.0:
        return np.nan
    approach = sign * (approach - driven)
    leaves = speed(m, q, p, other, until, spans, count)
    leaves = sign * (leaves - speed(m, q, p, striker, until, spans, count))
    rounding = MIN_APPROACH * max(fastest, abs(leaves))
    return leaves / approach if approach > rounding and leaves >= -rounding else np.nan


@EXACT_PART
def others_impulse(q: Pattern, pair: int, b: int, start: float, end: float, spans: Array, count: int) -> float:
    """Return the impulses of other pairs' contacts on a body [N s].

    It is the sum over contacts that are closed in a time.
    """
    total = 0.0
    for k in range(count):
        of = q.contacts[int(spans[k, CONTACT])]
        third = of.pair != pair and (of.left_body == b or of.right_body == b)
        if third and spans[k, START] < end and spans[k, STOP] > start:
            total += abs(spans[k, IMPULSE])
    return total


@EXACT_PART
def rank(q: Pattern, p: Array, b: int) -> int:
    """Return the rank of a body as the striker of a pair.

    First a mass, then a body that moved, then one that can move.
    """
    body = q.bodies[b]
    moves = 1 if body.place >= 0 else 0
    return 4 * moves + 2 * moves * body.rigid + (1 if velocity_of(q, p, b) != 0.0 else 0)


@EXACT_PART
def total_energy(m: MarchArrays, q: Pattern, t: float) -> float:
    """Return the energy of all bodies and contact springs at time t [J]."""
    total = 0.0
    for b in range(len(q.bodies)):
        total += energy(m, q, b, t)
    for c in range(len(m.contacts)):
        if m.contacts[c].stiffness >= 0.0:
            total += spring_energy(m, c, t)
    return total


@EXACT_PART
def at_stake(
    m: MarchArrays, q: Pattern, p: Array, spans: Array, count: int, start: float, work: float, group: Array
) -> float:
    """Return the energy of `EnergyBook.at_stake` [J]; ``group`` is room for the bodies."""
    t, gravity = m.state[0].duration, m.state[0].gravity
    n = len(q.bodies)
    for b in range(n):
        group[b] = b
    for k in range(count):
        of = q.contacts[int(spans[k, CONTACT])]
        if q.bodies[of.left_body].place >= 0 and q.bodies[of.right_body].place >= 0:
            old, new = group[of.left_body], group[of.right_body]
            for b in range(n):
                if group[b] == old:
                    group[b] = new
    inside_start, carried_work = start, 0.0
    for g in range(n):
        mass = drift = force = 0.0
        free = True
        for b in range(n):
            if group[b] != g:
                continue
            body = q.bodies[b]
            free = free and body.held == 0 and (body.falls == 1 or gravity == 0.0)
            for k in range(count):  # a wall holds those that touch it
                of = q.contacts[int(spans[k, CONTACT])]
                walls = q.bodies[of.left_body].place < 0 or q.bodies[of.right_body].place < 0
                free = free and not (walls and (of.left_body == b or of.right_body == b))
            mass += mass_of(q, p, b)
            drift += mass_of(q, p, b) * velocity_of(q, p, b)
            force += end_force(m, q, b)
        if free and mass > 0.0:
            way = drift / mass * t + 0.5 * gravity * t * t
            inside_start -= 0.5 * drift * drift / mass
            carried_work += gravity * (mass * way + 0.5 * force * t * t) + force * way
    whole = max(abs(start), abs(work))
    inside = max(0.0, inside_start, abs(work - carried_work))
    return inside if inside > 1e-13 * whole else whole


@EXACT_PART
def balance(m: MarchArrays, q: Pattern, p: Array, spans: Array, count: int, group: Array) -> float:
    """Return the relative error of the energy balance at the end.

    It is relative to the reference energy, or to 1 J without any.
    """
    t, start, work = m.state[0].duration, total_energy(m, q, 0.0), 0.0
    error = total_energy(m, q, t) - start + dashpot_loss(m, t)
    for b in range(len(q.bodies)):
        work += load_work(m, q, b, t)
    for c in range(len(m.contacts)):
        if m.contacts[c].damping > 0.0:
            error += contact_loss(m, c, t)
    scale = at_stake(m, q, p, spans, count, start, work, group)
    return (error - work) / (scale if scale > MIN_ENERGY else 1.0)
