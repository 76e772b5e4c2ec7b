"""The one loop: free step, contact answer, correction, events, bookkeeping; compiled, and the same as plain Python.

It knows bodies only as linear steppers behind addresses and laws only as `respond` behind addresses. All its memory
is made before the run (`impactlab.memory`, `impactlab.assembly`); a step allocates nothing, so it is compiled without
a runtime for objects, and its helpers are copied into it.
"""

from __future__ import annotations

from typing import Any

import numba

from impactlab.memory import U_FORCE, U_IMPULSE, V_FORCE, V_IMPULSE, V_JUMP, Memory
from impactlab.pointers import FAST, call
from impactlab.types import MEMORY

# Why `advance` came back.
DONE, LAW_FAILED, NOT_FINITE, RECORDS_FULL, EVENTS_FULL = 0, 1, 2, 3, 4
CLOSE, OPEN, IMPULSE = 0, 1, 2
SWEEPS = 5000  # of the coupled answers of several contacts
LATE = 1e-9  # of a step: a snapshot this little after its end belongs to it (a multiple of dt is not exact)
AGREED = 1e-9  # of the largest impulse: answers that still change by more have not been found

njit: Any = numba.njit
ENTRY = njit(cache=True, _nrt=False, fastmath=FAST)
PART = njit(cache=True, _nrt=False, fastmath=FAST, no_cpython_wrapper=True, no_cfunc_wrapper=True)
INLINE = njit(inline="always", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)


@INLINE
def row_times_state(m: Memory, row: int) -> float:
    """Return a sparse row times the state."""
    total = 0.0
    for entry in range(m.row_start[row], m.row_start[row + 1]):
        total += m.row_value[entry] * m.state[m.row_index[entry]]
    return total


@PART
def compliances(m: Memory) -> None:
    """Fill the answers of each face to each contact from the responses of the bodies."""
    n_contacts, n_faces = len(m.contacts), len(m.faces)
    for number in range(n_faces):
        face = m.faces[number]
        body = m.bodies[face.body]
        size = body.state_end - body.state_start
        for contact in range(n_contacts):
            for layer in range(5):
                m.answers[layer, number, contact] = 0.0
            for other in range(2 * contact, 2 * contact + 2):
                if m.faces[other].body != face.body:
                    continue
                sign, place = m.faces[other].sign, m.faces[other].place
                force = body.force_start + place * size - body.state_start
                impulse = body.impulse_start + place * size - body.state_start
                jump = body.jump_start + place * body.n_dof - body.state_start - body.n_dof
                for entry in range(m.row_start[number], m.row_start[number + 1]):
                    index, value = m.row_index[entry], sign * m.row_value[entry]
                    m.answers[U_FORCE, number, contact] += value * m.responses[force + index]
                    m.answers[U_IMPULSE, number, contact] += value * m.responses[impulse + index]
                for entry in range(m.row_start[n_faces + number], m.row_start[n_faces + number + 1]):
                    index, value = m.row_index[entry], sign * m.row_value[entry]
                    m.answers[V_FORCE, number, contact] += value * m.responses[force + index]
                    m.answers[V_IMPULSE, number, contact] += value * m.responses[impulse + index]
                    m.answers[V_JUMP, number, contact] += value * m.jump[jump + index]
    for contact in range(n_contacts):
        left, right = 2 * contact, 2 * contact + 1
        port = m.ports[contact]
        port.left.displacement_per_force = -m.answers[U_FORCE, left, contact]
        port.left.velocity_per_force = -m.answers[V_FORCE, left, contact]
        port.left.velocity_per_impulse = -m.answers[V_JUMP, left, contact]
        port.right.displacement_per_force = m.answers[U_FORCE, right, contact]
        port.right.velocity_per_force = m.answers[V_FORCE, right, contact]
        port.right.velocity_per_impulse = m.answers[V_JUMP, right, contact]
        port.gap_per_force = m.answers[U_FORCE, right, contact] - m.answers[U_FORCE, left, contact]
        port.rate_per_force = m.answers[V_FORCE, right, contact] - m.answers[V_FORCE, left, contact]
        port.gap_per_impulse = m.answers[U_IMPULSE, right, contact] - m.answers[U_IMPULSE, left, contact]
        port.rate_per_impulse = m.answers[V_JUMP, right, contact] - m.answers[V_JUMP, left, contact]


def begin_step(m: Memory, end: float) -> None:
    """Take what must be known of the state at the start of a step: messengers, dashpots, snapshots."""
    clock = m.clock[0]
    first_reading = 2 * len(m.faces)
    for number in range(len(m.messengers)):
        value = row_times_state(m, first_reading + number)
        for contact in range(len(m.contacts)):
            value += m.left_out[number, contact] * m.contacts[contact].force
        messenger = m.messengers[number]
        m.ports[messenger.contact].readings[messenger.slot] = value
    for number in range(len(m.dampers)):
        m.dampers[number].old = m.state[m.dampers[number].index]
    for number in range(clock.n_snapshots, len(m.snapshots)):
        if m.snapshots[number].time > end + LATE * (end - clock.time):
            break
        m.snapshots[number].before = clock.time
        for i in range(m.state.size):
            m.snapshot_state[number, 0, i] = m.state[i]


def free_step(m: Memory) -> None:
    """Move all bodies by a step without contact and read the faces at its end."""
    for number in range(len(m.bodies)):
        body = m.bodies[number]
        parameters = m.parameters[body.parameter_start : body.parameter_end]
        call(body.free, parameters, m.state[body.state_start : body.state_end])
    n_faces = len(m.faces)
    for number in range(n_faces):
        m.faces[number].free_u = row_times_state(m, number)
        m.faces[number].free_v = row_times_state(m, n_faces + number)


def answer(m: Memory, time: float, dt: float) -> bool:
    """Ask the laws until their coupled answers agree; False where a law failed or they do not."""
    n_contacts = len(m.contacts)
    for number in range(n_contacts):
        m.contacts[number].force = 0.0
        m.contacts[number].impulse = 0.0
    answered, change, largest = True, 0.0, 0.0
    for _ in range(SWEEPS if n_contacts > 1 else 1):
        change, largest = 0.0, 0.0
        for number in range(n_contacts):
            contact, port, reply = m.contacts[number], m.ports[number], m.replies[number]
            left, right = m.faces[2 * number], m.faces[2 * number + 1]
            left_u, right_u, left_v, right_v = left.free_u, right.free_u, left.free_v, right.free_v
            others_rate = 0.0
            for other in range(n_contacts):
                force, impulse = m.contacts[other].force, m.contacts[other].impulse
                if other != number and (force != 0.0 or impulse != 0.0):
                    a, b = 2 * number, 2 * number + 1
                    left_u += m.answers[U_FORCE, a, other] * force + m.answers[U_IMPULSE, a, other] * impulse
                    right_u += m.answers[U_FORCE, b, other] * force + m.answers[U_IMPULSE, b, other] * impulse
                    left_v += m.answers[V_FORCE, a, other] * force + m.answers[V_IMPULSE, a, other] * impulse
                    right_v += m.answers[V_FORCE, b, other] * force + m.answers[V_IMPULSE, b, other] * impulse
                    others_rate += (m.answers[V_JUMP, b, other] - m.answers[V_JUMP, a, other]) * impulse
            port.time, port.dt = time, dt
            port.left.displacement, port.right.displacement = left.u, right.u
            port.left.velocity, port.right.velocity = left.v, right.v
            port.left.free_displacement, port.right.free_displacement = left_u, right_u
            port.left.free_velocity, port.right.free_velocity = left_v, right_v
            port.gap = contact.initial_gap + right.u - left.u
            if contact.touching != 0.0 and port.gap > 0.0:
                port.gap = 0.0
            port.gap_rate, port.others_rate = right.v - left.v, others_rate
            port.free_gap = contact.initial_gap + right_u - left_u
            port.free_gap_rate = right_v - left_v
            reply.force, reply.impulse, reply.trial = 0.0, 0.0, 0.0
            reply.stored, reply.dissipated, reply.in_contact, reply.failed = 0.0, 0.0, 0.0, 0.0
            for k in range(MEMORY):
                reply.memory[k] = port.memory[k]
            call(contact.law, port, reply)
            answered = answered and reply.failed == 0.0
            change = max(change, abs(reply.force - contact.force) * dt, abs(reply.impulse - contact.impulse))
            contact.force, contact.impulse = reply.force, reply.impulse
            largest = max(largest, abs(reply.force) * dt + abs(reply.impulse))
        if change <= 1e-15 * largest or not answered:
            break
    return answered and (n_contacts == 1 or change <= AGREED * largest)


def correct(m: Memory) -> None:
    """Add what the forces and impulses of the step do to its end."""
    for number in range(len(m.faces)):
        contact, face = m.contacts[number // 2], m.faces[number]
        body = m.bodies[face.body]
        size = body.state_end - body.state_start
        if contact.force != 0.0:
            push, start = face.sign * contact.force, body.force_start + face.place * size
            for part in range(3):
                for i in range(face.low[part], face.high[part]):
                    m.state[body.state_start + i] += push * m.responses[start + i]
        if contact.impulse != 0.0:
            kick, start = face.sign * contact.impulse, body.impulse_start + face.place * size
            for i in range(size):
                m.state[body.state_start + i] += kick * m.responses[start + i]
    n_contacts = len(m.contacts)
    for number in range(len(m.faces)):
        u, v = m.faces[number].free_u, m.faces[number].free_v
        for other in range(n_contacts):
            force, impulse = m.contacts[other].force, m.contacts[other].impulse
            u += m.answers[U_FORCE, number, other] * force + m.answers[U_IMPULSE, number, other] * impulse
            v += m.answers[V_FORCE, number, other] * force + m.answers[V_IMPULSE, number, other] * impulse
        m.faces[number].u, m.faces[number].v = u, v


@PART
def note(m: Memory, time: float, number: int, kind: int, impulse: float) -> None:
    """Write one event; times of one contact never run backwards."""
    contact, event = m.contacts[number], m.events[m.clock[0].n_events]
    contact.last_event = max(time, contact.last_event)
    event.time, event.contact, event.kind, event.impulse = contact.last_event, number, kind, impulse
    event.span_impulse, event.span_peak = contact.span_impulse, contact.span_peak
    m.clock[0].n_events += 1


def close_time(contact: Any, port: Any, reply: Any, time: float, dt: float) -> float:
    """Return when a contact began: the root of the gap, or of the trial force where the faces already overlapped."""
    if port.gap > 0.0 and port.free_gap < 0.0:
        return float(time + dt * port.gap / (port.gap - port.free_gap))
    if port.gap < 0.0 and contact.old_gap >= 0.0:
        return float(max(0.0, time - dt * port.gap / (port.gap - contact.old_gap)))
    if port.gap < 0.0 and contact.old_trial < 0.0 and reply.trial > 0.0:
        share = contact.trial_point - reply.trial / (reply.trial - contact.old_trial)
        return float(max(0.0, time + dt * share))
    return time


def open_time(contact: Any, port: Any, reply: Any, time: float, dt: float) -> float:
    """Return when a contact ended: the root of the trial force, or of the gap under a law without a signed trial."""
    if contact.old_trial > 0.0 and reply.trial < 0.0:
        return float(time + dt * (contact.trial_point + reply.trial / (contact.old_trial - reply.trial)))
    if port.gap > 0.0 and contact.old_gap < 0.0:
        return float(time - dt * port.gap / (port.gap - contact.old_gap))
    if port.gap < 0.0 and port.free_gap > 0.0:
        return float(time - dt * port.gap / (port.free_gap - port.gap))
    return time


close_time, open_time = map(PART, (close_time, open_time))


def date(m: Memory, time: float, dt: float, located: bool) -> None:
    """Date the events of an accepted step, and carry each contact's phase and memory on.

    Roots are linear between the instants of a value; where events are located, steps begin at them.
    """
    for number in range(len(m.contacts)):
        contact, port, reply = m.contacts[number], m.ports[number], m.replies[number]
        was_closed, is_closed = port.in_contact > 0.0, reply.in_contact > 0.0
        if contact.dates != 0:
            if is_closed and not was_closed:
                contact.span_impulse, contact.span_peak = 0.0, 0.0
                note(m, time if located else close_time(contact, port, reply, time, dt), number, CLOSE, 0.0)
            contact.span_impulse += contact.force * dt + contact.impulse
            contact.span_peak = max(contact.span_peak, contact.force)
            if was_closed and not is_closed:
                note(m, time if located else open_time(contact, port, reply, time, dt), number, OPEN, 0.0)
        if contact.impulse != 0.0:
            note(m, time, number, IMPULSE, contact.impulse)
        contact.old_gap, contact.old_trial, contact.touching = port.gap, reply.trial, 0.0
        contact.sum_force += contact.force * dt
        contact.total += contact.force * dt + contact.impulse
        port.in_contact = reply.in_contact
        for k in range(MEMORY):
            port.memory[k] = reply.memory[k]
        m.clock[0].lost_contact += reply.dissipated


def settle(m: Memory, dt: float, end: float) -> None:
    """Book the losses of an accepted step, take snapshots, move the clock."""
    clock = m.clock[0]
    for number in range(len(m.dampers)):
        damper = m.dampers[number]
        moved = m.state[damper.index] - damper.old
        felt = 0.5 * (moved + damper.before) if damper.straddles != 0.0 else moved
        clock.lost_ends += damper.damping * felt * felt / dt
        damper.before = moved
    for number in range(clock.n_snapshots, len(m.snapshots)):
        if m.snapshots[number].time > end + LATE * dt:
            break
        m.snapshots[number].after = end
        for i in range(m.state.size):
            m.snapshot_state[number, 1, i] = m.state[i]
        clock.n_snapshots = number + 1
    clock.time = end


def sample(m: Memory) -> bool:
    """Take energies and momenta; False where one is not finite."""
    clock = m.clock[0]
    n = clock.n_samples
    finite = True
    for number in range(len(m.bodies)):
        body = m.bodies[number]
        parameters = m.parameters[body.parameter_start : body.parameter_end]
        m.scratch[2] = 0.0
        call(body.measure, parameters, m.state[body.state_start : body.state_end], m.scratch)
        momentum = m.scratch[2]
        for i in range(body.state_start + body.n_dof, body.state_start + 2 * body.n_dof):
            momentum += m.momentum[i] * m.state[i]
        m.sample[n, 4 + 3 * number] = m.scratch[0]
        m.sample[n, 5 + 3 * number] = m.scratch[1]
        m.sample[n, 6 + 3 * number] = momentum
        total = m.scratch[0] + momentum
        finite = finite and total - total == 0.0
    stored = 0.0
    for number in range(len(m.contacts)):
        stored += m.replies[number].stored
    m.sample[n, 0], m.sample[n, 1], m.sample[n, 2], m.sample[n, 3] = (
        clock.time,
        stored,
        clock.lost_contact,
        clock.lost_ends,
    )
    clock.n_samples = n + 1
    return finite


def keep(m: Memory) -> None:
    """Write one record at the end of a step."""
    clock, n_contacts = m.clock[0], len(m.contacts)
    n = clock.n_records
    elapsed = clock.time - clock.recorded
    m.record[n, 0] = clock.time
    for number in range(n_contacts):
        contact, left, right = m.contacts[number], m.faces[2 * number], m.faces[2 * number + 1]
        at = 1 + 6 * number
        m.record[n, at] = contact.sum_force / elapsed if elapsed > 0.0 else 0.0
        m.record[n, at + 1] = contact.initial_gap + right.u - left.u
        m.record[n, at + 2], m.record[n, at + 3] = left.u, left.v
        m.record[n, at + 4], m.record[n, at + 5] = right.u, right.v
        contact.sum_force = 0.0
    first_column = 1 + 6 * n_contacts
    first_probe = 2 * len(m.faces) + len(m.messengers)
    for probe in range(m.record.shape[1] - first_column):
        m.record[n, first_column + probe] = row_times_state(m, first_probe + probe)
    clock.recorded = clock.time
    clock.n_records = n + 1


# A call copies all of `Memory`: the step that is taken most has its parts copied into it, the located step calls them.
here_begin_step, here_free_step, here_answer, here_correct = map(INLINE, (begin_step, free_step, answer, correct))
here_date, here_settle, here_sample, here_keep = map(INLINE, (date, settle, sample, keep))


@ENTRY
def advance_dated(m: Memory, dt: float, last_step: int, stride: int, sample_stride: int) -> int:
    """Take whole steps up to ``last_step`` or until something must be handled outside; return why it came back.

    The clock carries everything that goes on from one call to the next, so that no bit depends on where the calls are
    cut.
    """
    clock = m.clock[0]
    while clock.step < last_step:
        if clock.n_records + 2 >= m.record.shape[0] or clock.n_samples + 2 >= m.sample.shape[0]:
            return RECORDS_FULL
        if clock.n_events + 6 * len(m.contacts) >= len(m.events):
            return EVENTS_FULL
        time, end = clock.time, (clock.step + 1) * dt
        here_begin_step(m, end)
        here_free_step(m)
        if not here_answer(m, time, dt):
            return LAW_FAILED
        here_correct(m)
        here_date(m, time, dt, False)
        here_settle(m, dt, end)
        clock.step += 1
        if clock.step % stride == 0 or clock.step == clock.steps:
            here_keep(m)
        if (clock.step % sample_stride == 0 or clock.step == clock.steps) and not here_sample(m):
            return NOT_FINITE
    return DONE


begin_step, free_step, answer, correct = map(PART, (begin_step, free_step, answer, correct))
date, settle, sample, keep = map(PART, (date, settle, sample, keep))


@ENTRY
def start(m: Memory) -> None:
    """Fill the compliances and write the state at t = 0."""
    compliances(m)
    n_faces = len(m.faces)
    for number in range(n_faces):
        m.faces[number].u = row_times_state(m, number)
        m.faces[number].v = row_times_state(m, n_faces + number)
    keep(m)
    sample(m)
