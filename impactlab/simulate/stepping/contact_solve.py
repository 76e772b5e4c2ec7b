"""The contact solve: Gauss-Seidel sweeps with Newton steps for coupled contacts.

A single contact is solved directly. Each contact visits its neighbours alone: those that act on it through a body they
share. Where sweeps are slow, as along a chain, Newton steps solve a banded system: of a chain tridiagonal by contacts,
in time linear in their number.
"""

from __future__ import annotations

import math

from impactlab.numerics.addresses import call
from impactlab.numerics.compiling import INLINE, MERGED, PART
from impactlab.numerics.lanes import lanes_at, put_lanes
from impactlab.numerics.linear import first_column, solve_banded
from impactlab.simulate.stepping.arrays import (
    SOLVE_SEVERAL,
    U_FORCE,
    U_IMPULSE,
    U_PROJECTION,
    U_PUSH,
    V_JUMP,
    ContactRecord,
    StepArrays,
)
from impactlab.simulate.stepping.ports import fill_acting, fill_acting_push, predicted_gap

MAX_SWEEPS = 5000  # over the coupled laws of several contacts
MIN_SWEEPS = 3  # before Newton steps
SLOW_RATIO = 0.5  # of a change left by the next sweep, above which sweeps are slow; for n contacts 1 - (pi/n)^2
MAX_SLOW_SWEEPS = 20  # before Newton steps in any case
MAX_NEWTON_TURNS = 100  # each followed by one more sweep
ROUNDING_TOL = 1e-12  # of the largest impulse: a smaller change that Newton steps do not halve is rounding
AGREEMENT_TOL = 1e-9  # of the largest impulse: a larger change in the last sweep is a failure
GIVEN_TOL = 1e-15  # of the impulses given since t = 0: a smaller change of bodies at rest is rounding of their rates


@MERGED
def effect_of(m: StepArrays, pair: int, place: int, layer: int, contact: ContactRecord) -> float:
    """Return the effect of one contact of a pair on a row of the other.

    It is that at the end of the step.

    Place 0 is the left face, 1 the right one, 2 the row that it pushes; layer 0 is displacement (or value), 1 velocity.
    """
    total = 0.0
    if contact.force != 0.0:
        total += m.influence[pair, place, U_FORCE + layer] * contact.force
    if contact.impulse != 0.0:
        total += m.influence[pair, place, U_IMPULSE + layer] * contact.impulse
    if contact.projection != 0.0:
        total += m.influence[pair, place, U_PROJECTION + layer] * contact.projection
    if contact.push != 0.0:
        total += m.influence[pair, place, U_PUSH + layer] * contact.push
    return total


@MERGED
def reply_to(
    m: StepArrays,
    number: int,
    time: float,
    dt: float,
    left_free: tuple[float, float],
    right_free: tuple[float, float],
    others: tuple[float, float, float],
) -> None:
    """Fill the port of a contact and evaluate its law.

    Given are displacement and velocity of both faces at the end of the step without its own reply, and the effects of
    the other contacts on the gap rate at once, on the predicted gap, and on the row that it pushes.
    """
    contact, port, reply = m.contacts[number], m.ports[number], m.replies[number]
    left, right = m.faces[2 * number], m.faces[2 * number + 1]
    (left_u, left_v), (right_u, right_v) = left_free, right_free
    port.time, port.dt = time, dt
    port.left.displacement, port.right.displacement = left.u, right.u
    port.left.velocity, port.right.velocity = left.v, right.v
    port.left.free_displacement, port.right.free_displacement = left_u, right_u
    port.left.free_velocity, port.right.free_velocity = left_v, right_v
    gap = contact.initial_gap + right.u - left.u
    if contact.touching != 0.0 and gap + port.offset > 0.0:
        gap = -port.offset
    port.gap = gap
    port.gap_rate, port.others_rate = right.v - left.v, others[0]
    port.free_gap = contact.initial_gap + right_u - left_u
    port.free_gap_rate = right_v - left_v
    port.predicted_gap = predicted_gap(port, others[1], contact.projects_first != 0)
    fill_acting(port, contact.load_point)
    own_pushed = port.free_pushed
    if len(m.pushes) > 0:
        port.free_pushed = own_pushed + others[2]
        fill_acting_push(port, contact.load_point)
    reply.force, reply.impulse, reply.projection, reply.push, reply.trial = 0.0, 0.0, 0.0, 0.0, 0.0
    reply.stored, reply.dissipated, reply.unresolved, reply.offset = 0.0, 0.0, 0.0, 0.0
    reply.excess = 0.0
    reply.in_contact, reply.failed = 0.0, 0.0
    put_lanes(reply.memory, 0, lanes_at(port.memory, 0))
    call(contact.law, port, reply)
    port.free_pushed = own_pushed


@MERGED
def evaluate(m: StepArrays, number: int, time: float, dt: float) -> None:
    """Evaluate a law for the state and the present replies of the other contacts."""
    contact, left, right = m.contacts[number], m.faces[2 * number], m.faces[2 * number + 1]
    left_u, right_u, left_v, right_v = left.free_u, right.free_u, left.free_v, right.free_v
    rate, predicted, pushed = 0.0, 0.0, 0.0
    for pair in range(contact.first_pair, contact.first_pair + contact.coupled):
        other = m.coupled[pair]
        if other == number:
            continue
        theirs = m.contacts[other]
        if theirs.force != 0.0 or theirs.impulse != 0.0 or theirs.projection != 0.0 or theirs.push != 0.0:
            left_u += effect_of(m, pair, 0, 0, theirs)
            right_u += effect_of(m, pair, 1, 0, theirs)
            left_v += effect_of(m, pair, 0, 1, theirs)
            right_v += effect_of(m, pair, 1, 1, theirs)
            jump = m.influence[pair, 1, V_JUMP] - m.influence[pair, 0, V_JUMP]
            rate += jump * theirs.impulse
            predicted += jump * theirs.projection
            pushed += effect_of(m, pair, 2, 0, theirs)
    reply_to(m, number, time, dt, (left_u, left_v), (right_u, right_v), (rate, predicted, pushed))


@INLINE
def neighbour_changed(m: StepArrays, number: int, sweep: int) -> bool:
    """Return whether a neighbour's reply has changed since this contact was evaluated."""
    changed = False
    contact = m.contacts[number]
    for pair in range(contact.first_pair, contact.first_pair + contact.coupled):
        other = m.coupled[pair]
        if other != number:
            changed = changed or m.contacts[other].moved == (sweep if other < number else sweep - 1)
    return changed


@PART
def write_slopes(m: StepArrays, number: int, other: int, kind: int, step: float, time: float, dt: float) -> None:
    """Write the slopes of a contact's replies with respect to another contact.

    They are with respect to its force (kind 0) or its impulse (1). Slopes are differences. A nonzero reply is extended
    beyond the end of its piece: the larger of the differences to both sides is its slope. A zero reply stays zero.
    """
    size, band = 2 * len(m.contacts), 2 * m.clock[0].reach + 1
    width, base = min(3 * band + 1, size), min(3 * band + 1, size) + 1
    theirs, reply = m.contacts[other], m.replies[number]
    force, impulse = theirs.force, theirs.impulse
    of_force, of_impulse = (step / dt, 0.0) if kind == 0 else (0.0, step)
    theirs.force, theirs.impulse = force - of_force, impulse - of_impulse
    evaluate(m, number, time, dt)
    force_behind, impulse_behind = reply.force * dt, reply.impulse
    theirs.force, theirs.impulse = force + of_force, impulse + of_impulse
    evaluate(m, number, time, dt)
    theirs.force, theirs.impulse = force, impulse
    for place in range(2):
        row = 2 * m.order[number] + place
        reply_now = m.system[row, base]
        if reply_now != 0.0:
            behind = (reply_now - (force_behind if place == 0 else impulse_behind)) / step
            beyond = ((reply.force * dt if place == 0 else reply.impulse) - reply_now) / step
            at = 2 * m.order[other] + kind - first_column(row, band, size, width)
            m.system[row, at] = -(beyond if abs(beyond) > abs(behind) else behind)


@PART
def newton(m: StepArrays, time: float, dt: float, largest: float) -> None:
    """Take a Newton step of all forces and impulses on the laws' residuals.

    A residual is the reply of a law less its present value. Replies are piecewise linear, so one step within the right
    pieces is exact, and the set of acting contacts is found as by an active set method. A law is evaluated for changes
    of its neighbours alone, those that act on it: of a chain the system is tridiagonal by contacts. Entries that are
    zero and stay zero change nothing.
    """
    size, band = 2 * len(m.contacts), 2 * m.clock[0].reach + 1
    width = min(3 * band + 1, size)
    known, base = width, width + 1
    step = 1e-3 * largest
    if not 0.0 < step < math.inf:
        return
    for number in range(len(m.contacts)):
        evaluate(m, number, time, dt)
        row, contact, reply = 2 * m.order[number], m.contacts[number], m.replies[number]
        for i in range(row, row + 2):
            for j in range(width):
                m.system[i, j] = 0.0
            m.system[i, i - first_column(i, band, size, width)] = 1.0
        m.system[row, base], m.system[row + 1, base] = reply.force * dt, reply.impulse
        m.system[row, known], m.system[row + 1, known] = (
            (reply.force - contact.force) * dt,
            reply.impulse - contact.impulse,
        )
    for number in range(len(m.contacts)):
        row, contact = 2 * m.order[number], m.contacts[number]
        if m.system[row, base] == 0.0 and m.system[row + 1, base] == 0.0:
            continue
        for pair in range(contact.first_pair, contact.first_pair + contact.coupled):
            other = m.coupled[pair]
            if other == number:
                continue
            theirs, column = m.contacts[other], 2 * m.order[other]
            if m.system[column, base] != 0.0 or theirs.force != 0.0:
                write_slopes(m, number, other, 0, step, time, dt)
            if m.system[column + 1, base] != 0.0 or theirs.impulse != 0.0:
                write_slopes(m, number, other, 1, step, time, dt)
    solve_banded(m.system, size, band)
    for number in range(len(m.contacts)):
        contact = m.contacts[number]
        contact.force += m.system[2 * m.order[number], known] / dt
        contact.impulse += m.system[2 * m.order[number] + 1, known]


@PART
def take_up(m: StepArrays) -> None:
    """Start Newton steps from the forces of the step before where larger.

    Most contacts that press continue to do so.
    """
    for number in range(len(m.contacts)):
        contact = m.contacts[number]
        if abs(contact.before) > abs(contact.force):
            contact.force = contact.before


@INLINE
def change_of(m: StepArrays, number: int, dt: float) -> float:
    """Return the difference of a law's reply from the impulse that acts [N s]."""
    contact, reply = m.contacts[number], m.replies[number]
    change = max(abs(reply.force - contact.force) * dt, abs(reply.impulse - contact.impulse))
    # A projection counts as the impulse with the same displacement over the step, also without a force.
    if reply.projection != contact.projection:
        change = max(change, abs(reply.projection - contact.projection) / dt)
    # A push counts by its effect on the pushed row, a force, for open contacts too.
    if reply.push != contact.push:
        change = max(change, abs(reply.push - contact.push) * abs(m.ports[number].pushed_per_push) * dt)
    return float(change)


@INLINE
def size_of(m: StepArrays, number: int, dt: float) -> float:
    """Return how much acts at a contact, by the same measure [N s]."""
    contact = m.contacts[number]
    size = abs(contact.force) * dt + abs(contact.impulse)
    if contact.projection != 0.0:
        size = max(size, abs(contact.projection) / dt)
    if contact.push != 0.0:
        size = max(size, abs(contact.push) * abs(m.ports[number].pushed_per_push) * dt)
    return float(size)


@INLINE
def skipped(m: StepArrays, number: int) -> bool:
    """Return whether a law need not be evaluated, as its faces stay apart.

    They stay apart in this step and in the one before. No other contact may act on the faces within the step, so that
    the free step is their whole motion.
    """
    contact = m.contacts[number]
    if contact.zero_apart == 0:
        return False
    port, left, right, before = m.ports[number], m.faces[2 * number], m.faces[2 * number + 1], contact.apart
    contact.apart = 0
    if contact.coupled == 1 and port.in_contact == 0.0:
        gap = contact.initial_gap + port.offset
        if gap + right.u - left.u > 0.0 and gap + right.free_u - left.free_u > 0.0:
            contact.apart = 1
    contact.skipped = contact.apart * before
    return contact.skipped != 0


@PART
def solve_several(m: StepArrays, time: float, dt: float) -> None:
    """Evaluate the laws until their coupled replies agree.

    `scratch` holds whether they agree without a failed law.
    """
    n_contacts, given = len(m.contacts), 0.0
    for number in range(n_contacts):
        contact = m.contacts[number]
        given = max(given, abs(contact.total))
        contact.before, contact.force = contact.force, 0.0
        contact.impulse, contact.projection, contact.push = 0.0, 0.0, 0.0
    evaluated, change, largest, sweep, since, turns, backwards = True, 0.0, 0.0, 0, 0, 0, False
    while True:
        before, change, largest = change, 0.0, 0.0
        for place in range(n_contacts):
            number = n_contacts - 1 - place if backwards else place
            contact, reply = m.contacts[number], m.replies[number]
            if (sweep == 0 and skipped(m, number)) or contact.skipped != 0:
                continue
            if sweep == since or (contact.coupled > 1 and neighbour_changed(m, number, sweep)):
                evaluate(m, number, time, dt)
                evaluated = evaluated and reply.failed == 0.0
                if n_contacts > 1:
                    moved = change_of(m, number, dt)
                    contact.moved = sweep if moved != 0.0 else -1
                    change = max(change, moved)
                contact.force, contact.impulse = reply.force, reply.impulse
                contact.projection, contact.push = reply.projection, reply.push
            if n_contacts > 1:
                largest = max(largest, size_of(m, number, dt))
        sweep += 1
        if change <= 1e-15 * largest or not evaluated or sweep == MAX_SWEEPS:
            break
        repeated = change <= ROUNDING_TOL * largest and change >= 0.5 * before
        if turns > 0 and (repeated or change <= GIVEN_TOL * given):
            break  # the remainder is rounding, which Newton steps repeat
        backwards = False
        if turns > 0 or sweep >= MAX_SLOW_SWEEPS or (sweep >= MIN_SWEEPS and change > SLOW_RATIO * before):
            turns += 1
            if turns == 1:
                take_up(m)
            if turns <= MAX_NEWTON_TURNS:
                newton(m, time, dt, largest)
                backwards = turns % 2 == 1  # from both ends in turn: a change at one end reaches the other in a sweep
            if turns <= MAX_NEWTON_TURNS + 1:
                since = sweep  # all laws are evaluated in it
    m.scratch[0] = 1.0 if evaluated and change <= max(AGREEMENT_TOL * largest, GIVEN_TOL * given) else 0.0


@INLINE
def solve_contacts(m: StepArrays, time: float, dt: float) -> bool:
    """Evaluate the laws of the step; return False if one failed.

    Return False, too, if coupled replies do not agree.
    """
    if len(m.contacts) > 1:
        call(m.pieces[SOLVE_SEVERAL], m, time, dt)
        return bool(m.scratch[0] != 0.0)
    if len(m.contacts) == 0:
        return True
    if skipped(m, 0):
        return True
    contact, reply, left, right = m.contacts[0], m.replies[0], m.faces[0], m.faces[1]
    reply_to(m, 0, time, dt, (left.free_u, left.free_v), (right.free_u, right.free_v), (0.0, 0.0, 0.0))
    contact.force, contact.impulse = reply.force, reply.impulse
    contact.projection, contact.push = reply.projection, reply.push
    return bool(reply.failed == 0.0)
