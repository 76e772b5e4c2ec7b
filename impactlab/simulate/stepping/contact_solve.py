"""The contact solve: direct for one contact, Gauss-Seidel with Newton steps for several coupled ones."""

from __future__ import annotations

import math

from impactlab.numerics.addresses import call
from impactlab.numerics.compiling import INLINE, PART
from impactlab.numerics.linear import solve_dense
from impactlab.simulate.stepping.arrays import (
    U_FORCE,
    U_IMPULSE,
    U_PROJECTION,
    U_PUSH,
    V_JUMP,
    ContactRecord,
    StepArrays,
)
from impactlab.simulate.stepping.ports import fill_acting, fill_acting_push, predicted_gap
from impactlab.types import MEMORY

MAX_SWEEPS = 5000  # over the coupled laws of several contacts
MIN_SWEEPS = 20  # before Newton steps: forces that still change are coupled so closely that sweeps are slow
MAX_NEWTON_TURNS = 100  # each followed by one more sweep
AGREEMENT_TOL = 1e-9  # of the largest impulse: a larger change in the last sweep is a failure


@INLINE
def effect_of(m: StepArrays, pair: int, place: int, layer: int, contact: ContactRecord) -> float:
    """Return the effect of the contact of a pair on a row of the one it acts on, at the end of the step.

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


@INLINE
def evaluate_law(m: StepArrays, number: int, time: float, dt: float) -> None:
    """Evaluate a law for the state and the present replies of the other contacts."""
    contact, port, reply = m.contacts[number], m.ports[number], m.replies[number]
    left, right = m.faces[2 * number], m.faces[2 * number + 1]
    left_u, right_u, left_v, right_v = left.free_u, right.free_u, left.free_v, right.free_v
    others_rate, others_pushed, predicted = 0.0, 0.0, 0.0
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
            others_rate += jump * theirs.impulse
            predicted += jump * theirs.projection
            others_pushed += effect_of(m, pair, 2, 0, theirs)
    own_pushed = port.free_pushed
    port.time, port.dt = time, dt
    port.left.displacement, port.right.displacement = left.u, right.u
    port.left.velocity, port.right.velocity = left.v, right.v
    port.left.free_displacement, port.right.free_displacement = left_u, right_u
    port.left.free_velocity, port.right.free_velocity = left_v, right_v
    port.gap = contact.initial_gap + right.u - left.u
    if contact.touching != 0.0 and port.gap + port.offset > 0.0:
        port.gap = -port.offset
    port.gap_rate, port.others_rate = right.v - left.v, others_rate
    port.free_gap = contact.initial_gap + right_u - left_u
    port.free_gap_rate = right_v - left_v
    port.predicted_gap = predicted_gap(port, predicted, contact.projects_first != 0)
    fill_acting(port, contact.load_point)
    if len(m.pushes) > 0:
        port.free_pushed = own_pushed + others_pushed
        fill_acting_push(port, contact.load_point)
    reply.force, reply.impulse, reply.projection, reply.push, reply.trial = 0.0, 0.0, 0.0, 0.0, 0.0
    reply.stored, reply.dissipated, reply.unresolved, reply.offset = 0.0, 0.0, 0.0, 0.0
    reply.in_contact, reply.failed = 0.0, 0.0
    for k in range(MEMORY):
        reply.memory[k] = port.memory[k]
    call(contact.law, port, reply)
    port.free_pushed = own_pushed


@INLINE
def heard_news(m: StepArrays, number: int, sweep: int) -> bool:
    """Return whether a contact that acts on this one has changed its reply since this one was evaluated."""
    news = False
    contact = m.contacts[number]
    for pair in range(contact.first_pair, contact.first_pair + contact.coupled):
        other = m.coupled[pair]
        if other != number:
            news = news or m.contacts[other].moved == (sweep if other < number else sweep - 1)
    return news


@PART
def write_residuals(m: StepArrays, time: float, dt: float, column: int) -> None:
    """Write the residuals of all contacts, reply less present value, into a column of the linear system."""
    for number in range(len(m.contacts)):
        evaluate_law(m, number, time, dt)
        contact, reply = m.contacts[number], m.replies[number]
        m.system[2 * number, column] = (reply.force - contact.force) * dt
        m.system[2 * number + 1, column] = reply.impulse - contact.impulse


@PART
def newton(m: StepArrays, time: float, dt: float, largest: float) -> None:
    """Take a Newton step of all forces and impulses on the residuals of the laws; slopes are differences.

    Replies are piecewise linear, so one step within the right pieces is exact. A nonzero reply is extended beyond the
    end of its piece: the larger of the differences to both sides is its slope. A zero reply stays zero. The set of
    acting contacts is then found as by an active set method.
    """
    size = 2 * len(m.contacts)
    known, base, ahead = size, size + 1, size + 2
    write_residuals(m, time, dt, known)
    for i in range(size):
        m.system[i, base] = m.system[i, known]
    step = 1e-3 * largest
    if not 0.0 < step < math.inf:
        return
    for unknown in range(size):
        contact = m.contacts[unknown // 2]
        force, impulse = contact.force, contact.impulse
        of_force, of_impulse = (step / dt, 0.0) if unknown % 2 == 0 else (0.0, step)
        contact.force, contact.impulse = force - of_force, impulse - of_impulse
        write_residuals(m, time, dt, unknown)
        contact.force, contact.impulse = force + of_force, impulse + of_impulse
        write_residuals(m, time, dt, ahead)
        contact.force, contact.impulse = force, impulse
        for i in range(size):
            own = 1.0 if i == unknown else 0.0  # derivative of the present value
            behind = (m.system[i, base] - m.system[i, unknown]) / step + own
            beyond = (m.system[i, ahead] - m.system[i, base]) / step + own
            slope = beyond if abs(beyond) > abs(behind) else behind
            given = m.contacts[i // 2].force if i % 2 == 0 else m.contacts[i // 2].impulse
            answered = m.system[i, base] + (given * dt if i % 2 == 0 else given)
            m.system[i, unknown] = own - (slope if answered != 0.0 else 0.0)
    solve_dense(m.system, size)
    for number in range(len(m.contacts)):
        contact = m.contacts[number]
        contact.force += m.system[2 * number, known] / dt
        contact.impulse += m.system[2 * number + 1, known]


@INLINE
def solve_contacts(m: StepArrays, time: float, dt: float) -> bool:
    """Evaluate the laws until their coupled replies agree; return False if a law failed or they do not agree."""
    n_contacts = len(m.contacts)
    for number in range(n_contacts):
        contact = m.contacts[number]
        contact.force, contact.impulse, contact.projection, contact.push = 0.0, 0.0, 0.0, 0.0
    answered, change, largest, sweep, since = True, 0.0, 0.0, 0, 0
    while True:
        change, largest = 0.0, 0.0
        for number in range(n_contacts):
            contact, reply = m.contacts[number], m.replies[number]
            if sweep == since or (contact.coupled > 1 and heard_news(m, number, sweep)):
                evaluate_law(m, number, time, dt)
                answered = answered and reply.failed == 0.0
                own = max(abs(reply.force - contact.force) * dt, abs(reply.impulse - contact.impulse))
                # A projection counts as the impulse with the same displacement over the step, also without a force.
                if reply.projection != contact.projection:
                    own = max(own, abs(reply.projection - contact.projection) / dt)
                if reply.push != contact.push:
                    # A push counts by its effect on the pushed row, a force, for open contacts too.
                    pushed = abs(m.ports[number].pushed_per_push)
                    own = max(own, abs(reply.push - contact.push) * pushed * dt)
                    largest = max(largest, abs(reply.push) * pushed * dt)
                contact.moved = sweep if own != 0.0 else -1
                change = max(change, own)
                contact.force, contact.impulse = reply.force, reply.impulse
                contact.projection, contact.push = reply.projection, reply.push
            largest = max(largest, abs(contact.force) * dt + abs(contact.impulse))
            if contact.projection != 0.0:
                largest = max(largest, abs(contact.projection) / dt)
        sweep += 1
        if n_contacts == 1 or change <= 1e-15 * largest or not answered or sweep == MAX_SWEEPS:
            break
        if MIN_SWEEPS <= sweep < MIN_SWEEPS + MAX_NEWTON_TURNS:
            newton(m, time, dt, largest)
            since = sweep
    return answered and (n_contacts == 1 or change <= AGREEMENT_TOL * largest)
