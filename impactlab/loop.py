"""The one loop: free step, contact answer, correction, events, bookkeeping; compiled, and the same as plain Python.

It knows bodies only as linear steppers behind addresses and laws only as `respond` behind addresses. All its memory
is made before the run (`impactlab.assembly`); a step allocates nothing.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
from numpy import float64, int64
from numpy.typing import NDArray

from impactlab.pointers import FAST, call
from impactlab.types import MEMORY

Floats = NDArray[float64]
Ints = NDArray[int64]

# Why `advance` came back.
DONE, LAW_FAILED, NOT_FINITE, RECORDS_FULL, EVENTS_FULL = 0, 1, 2, 3, 4
CLOSE, OPEN, IMPULSE = 0.0, 1.0, 2.0
# Entries of `clock`.
TIME, STEP, N_RECORDS, N_SAMPLES, N_EVENTS, N_SNAPSHOTS, STORED, LOST_CONTACT, LOST_ENDS, TIMED, N_CUTS, LAST_TIME = range(12)
SWEEPS = 200  # of the coupled answers of several contacts
CUTS = 100  # events located inside one nominal step before the rest of it is taken whole


class Bodies(NamedTuple):
    """All bodies: their steppers' addresses, and flat arrays cut by offsets."""

    free: Ints  # (n_bodies,) addresses
    measure: Ints
    retime: Ints
    parameters: Floats  # flat, cut by parameter_start
    parameter_start: Ints  # (n_bodies + 1,)
    state: Floats  # flat, cut by state_start
    state_start: Ints
    n_dof: Ints  # (n_bodies,) the state holds displacements, then velocities, then what is the scheme's own
    backup: Floats  # (n_state,) room for a step to be taken again
    momentum: Floats  # (n_state,) row over the state
    damper_index: Ints  # (n_dampers,) into state: displacements of dashpot ends
    damper_value: Floats  # N s/m
    damper_old: Floats  # (n_dampers,)


class Rows(NamedTuple):
    """Sparse rows over the state: row i holds entries start[i] to start[i + 1]."""

    start: Ints
    index: Ints
    value: Floats


class Contacts(NamedTuple):
    """All contacts: laws, ports (two to a contact, left then right) and how each answers each force."""

    law: Ints  # (n_contacts,) addresses
    ports: Any  # (n_contacts,) of Port
    replies: Any  # (n_contacts,) of Reply
    body: Ints  # (2 n_contacts,)
    sign: Floats  # (2 n_contacts,) -1 left, +1 right: direction of the push
    initial_gap: Floats  # (n_contacts,)
    displacement: Rows  # (2 n_contacts) rows
    velocity: Rows
    readings: Rows
    reading_port: Ints  # (n_readings,)
    reading_slot: Ints
    reading_left_out: Floats  # (n_readings, n_contacts) per force of the step before
    force_low: Ints  # (2 n_contacts,) non-zero range of each response, in the body's own state
    force_high: Ints
    jump: Floats  # flat: velocities per impulse of each port, for retime
    jump_start: Ints  # (n_bodies + 1,)
    responses: Floats  # flat: force responses of each body's ports, then impulse responses
    force_start: Ints  # (n_bodies + 1,)
    impulse_start: Ints
    port_in_body: Ints  # (2 n_contacts,) which of its body's ports
    ports_of_body: Ints  # (n_bodies,)
    u_force: Floats  # (2 n_contacts, n_contacts) displacement of a port per force of a contact, at the end
    v_force: Floats
    u_impulse: Floats
    v_impulse: Floats
    v_jump: Floats  # (2 n_contacts, n_contacts) velocity per impulse, at once
    u: Floats  # (2 n_contacts,) at the start of the step
    v: Floats
    free_u: Floats
    free_v: Floats
    force: Floats  # (n_contacts,) of the last step
    impulse: Floats
    old_gap: Floats  # (n_contacts,) one step before
    old_trial: Floats
    touching: Floats  # (n_contacts,) 1 where a located touch begins this step
    span: Floats  # (n_contacts, 2) impulse and peak of the contact under way
    last_event: Floats  # (n_contacts,)
    dates: Ints  # (n_contacts,) 1 where the law has a force: closings and openings are dated


class Record(NamedTuple):
    """What is kept."""

    probes: Rows
    time: Floats  # (capacity,) end of the recorded step
    contact: Floats  # (capacity, n_contacts, 2) mean force over the recorded step, gap at its end
    port: Floats  # (capacity, 2 n_contacts, 2) displacement and velocity
    probe: Floats  # (capacity, n_probes)
    sum_force: Floats  # (n_contacts,)
    sample_time: Floats  # (samples,)
    sample_body: Floats  # (samples, n_bodies, 3) energy, work of the load, momentum
    sample_book: Floats  # (samples, 3) stored, lost in contacts, lost at ends
    event: Floats  # (events, 6) time, contact, kind, impulse, span impulse, span peak
    snapshot_time: Floats  # (n_snapshots,) asked for
    snapshot_at: Floats  # (n_snapshots, 2) the two instants around it
    snapshot_state: Floats  # (n_snapshots, 2, n_state)
    scratch: Floats  # (4,)


@numba.njit(inline="always", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def dot(rows: Rows, row: int, state: Floats) -> float:
    """Return a sparse row times the state."""
    total = 0.0
    for entry in range(rows.start[row], rows.start[row + 1]):
        total += rows.value[entry] * state[rows.index[entry]]
    return total


@numba.njit(cache=True, _nrt=False, fastmath=FAST, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def retime(bodies: Bodies, contacts: Contacts, clock: Floats, dt: float) -> None:
    """Prepare all steppers for another step length and rebuild the compliances."""
    if clock[TIMED] == dt:
        return
    clock[TIMED] = dt
    for body in range(bodies.free.size):
        n_ports = contacts.ports_of_body[body]
        size = bodies.state_start[body + 1] - bodies.state_start[body]
        n_dof = 0 if n_ports == 0 else (contacts.jump_start[body + 1] - contacts.jump_start[body]) // n_ports
        jump = contacts.jump[contacts.jump_start[body] : contacts.jump_start[body + 1]].reshape((n_ports, n_dof))
        begin, middle = contacts.force_start[body], contacts.impulse_start[body]
        force = contacts.responses[begin : begin + n_ports * size].reshape((n_ports, size))
        impulse = contacts.responses[middle : middle + n_ports * size].reshape((n_ports, size))
        parameters = bodies.parameters[bodies.parameter_start[body] : bodies.parameter_start[body + 1]]
        call(bodies.retime[body], parameters, dt, jump, force, impulse)
    compliances(bodies, contacts)


@numba.njit(cache=True, _nrt=False, fastmath=FAST)  # type: ignore[untyped-decorator]
def compliances(bodies: Bodies, contacts: Contacts) -> None:
    """Fill the answers of each port to each contact from the responses of the bodies."""
    n_contacts = contacts.law.size
    for port in range(2 * n_contacts):
        body = contacts.body[port]
        shift = bodies.state_start[body]
        size = bodies.state_start[body + 1] - shift
        for contact in range(n_contacts):
            u_force, v_force, u_impulse, v_impulse, v_jump = 0.0, 0.0, 0.0, 0.0, 0.0
            for other in (2 * contact, 2 * contact + 1):
                if contacts.body[other] != body:
                    continue
                sign = contacts.sign[other]
                begin = contacts.force_start[body] + contacts.port_in_body[other] * size - shift
                middle = contacts.impulse_start[body] + contacts.port_in_body[other] * size - shift
                rows = contacts.displacement
                for entry in range(rows.start[port], rows.start[port + 1]):
                    u_force += sign * rows.value[entry] * contacts.responses[begin + rows.index[entry]]
                    u_impulse += sign * rows.value[entry] * contacts.responses[middle + rows.index[entry]]
                rows = contacts.velocity
                n_dof = (contacts.jump_start[body + 1] - contacts.jump_start[body]) // contacts.ports_of_body[body]
                first = contacts.jump_start[body] + contacts.port_in_body[other] * n_dof - shift - n_dof
                for entry in range(rows.start[port], rows.start[port + 1]):
                    v_force += sign * rows.value[entry] * contacts.responses[begin + rows.index[entry]]
                    v_impulse += sign * rows.value[entry] * contacts.responses[middle + rows.index[entry]]
                    v_jump += sign * rows.value[entry] * contacts.jump[first + rows.index[entry]]
            contacts.u_force[port, contact], contacts.v_force[port, contact] = u_force, v_force
            contacts.u_impulse[port, contact], contacts.v_impulse[port, contact] = u_impulse, v_impulse
            contacts.v_jump[port, contact] = v_jump
    for contact in range(n_contacts):
        left, right = 2 * contact, 2 * contact + 1
        port = contacts.ports[contact]
        port.left.displacement_per_force = -contacts.u_force[left, contact]
        port.left.velocity_per_force = -contacts.v_force[left, contact]
        port.left.velocity_per_impulse = -contacts.v_jump[left, contact]
        port.right.displacement_per_force = contacts.u_force[right, contact]
        port.right.velocity_per_force = contacts.v_force[right, contact]
        port.right.velocity_per_impulse = contacts.v_jump[right, contact]
        port.gap_per_force = contacts.u_force[right, contact] - contacts.u_force[left, contact]
        port.rate_per_force = contacts.v_force[right, contact] - contacts.v_force[left, contact]
        port.gap_per_impulse = contacts.u_impulse[right, contact] - contacts.u_impulse[left, contact]
        port.rate_per_impulse = contacts.v_jump[right, contact] - contacts.v_jump[left, contact]


@numba.njit(inline="always", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def read_ports(bodies: Bodies, contacts: Contacts) -> None:
    """Read displacement and velocity of all ports in the present state."""
    for port in range(contacts.body.size):
        contacts.u[port] = dot(contacts.displacement, port, bodies.state)
        contacts.v[port] = dot(contacts.velocity, port, bodies.state)


@numba.njit(inline="always", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def begin_step(bodies: Bodies, contacts: Contacts, record: Record, clock: Floats, end: float) -> None:
    """Take what must be known of the state at the start of a step: messengers, dashpots, snapshots."""
    for reading in range(contacts.reading_port.size):
        value = dot(contacts.readings, reading, bodies.state)
        for contact in range(contacts.law.size):
            value += contacts.reading_left_out[reading, contact] * contacts.force[contact]
        contacts.ports[contacts.reading_port[reading] // 2].readings[contacts.reading_slot[reading]] = value
    for damper in range(bodies.damper_index.size):
        bodies.damper_old[damper] = bodies.state[bodies.damper_index[damper]]
    for snapshot in range(int(clock[N_SNAPSHOTS]), record.snapshot_time.size):
        if record.snapshot_time[snapshot] > end:
            break
        record.snapshot_at[snapshot, 0] = clock[TIME]
        for i in range(bodies.state.size):
            record.snapshot_state[snapshot, 0, i] = bodies.state[i]


@numba.njit(inline="always", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def answer(contacts: Contacts, time: float, dt: float) -> bool:
    """Ask the laws until their coupled answers agree; False where a law failed. Reads free_u, free_v, u, v."""
    n_contacts = contacts.law.size
    for contact in range(n_contacts):
        contacts.force[contact] = 0.0
        contacts.impulse[contact] = 0.0
    for _ in range(SWEEPS if n_contacts > 1 else 1):
        change, largest = 0.0, 0.0
        for contact in range(n_contacts):
            left, right = 2 * contact, 2 * contact + 1
            left_u, right_u = contacts.free_u[left], contacts.free_u[right]
            left_v, right_v = contacts.free_v[left], contacts.free_v[right]
            left_now, right_now = contacts.v[left], contacts.v[right]
            for other in range(n_contacts):
                force, impulse = contacts.force[other], contacts.impulse[other]
                if other != contact and (force != 0.0 or impulse != 0.0):
                    left_u += contacts.u_force[left, other] * force + contacts.u_impulse[left, other] * impulse
                    right_u += contacts.u_force[right, other] * force + contacts.u_impulse[right, other] * impulse
                    left_v += contacts.v_force[left, other] * force + contacts.v_impulse[left, other] * impulse
                    right_v += contacts.v_force[right, other] * force + contacts.v_impulse[right, other] * impulse
                    left_now += contacts.v_jump[left, other] * impulse
                    right_now += contacts.v_jump[right, other] * impulse
            port, reply = contacts.ports[contact], contacts.replies[contact]
            port.time, port.dt = time, dt
            port.left.displacement, port.right.displacement = contacts.u[left], contacts.u[right]
            port.left.velocity, port.right.velocity = left_now, right_now
            port.left.free_displacement, port.right.free_displacement = left_u, right_u
            port.left.free_velocity, port.right.free_velocity = left_v, right_v
            port.gap = contacts.initial_gap[contact] + contacts.u[right] - contacts.u[left]
            if contacts.touching[contact] != 0.0 and port.gap > 0.0:
                port.gap = 0.0
            port.gap_rate = right_now - left_now
            port.free_gap = contacts.initial_gap[contact] + right_u - left_u
            port.free_gap_rate = right_v - left_v
            reply.force, reply.impulse, reply.trial = 0.0, 0.0, 0.0
            reply.stored, reply.dissipated, reply.in_contact, reply.failed = 0.0, 0.0, 0.0, 0.0
            for k in range(MEMORY):
                reply.memory[k] = port.memory[k]
            call(contacts.law[contact], port, reply)
            if reply.failed != 0.0:
                return False
            change = max(change, abs(reply.force - contacts.force[contact]) * dt)
            change = max(change, abs(reply.impulse - contacts.impulse[contact]))
            contacts.force[contact], contacts.impulse[contact] = reply.force, reply.impulse
            largest = max(largest, abs(reply.force) * dt + abs(reply.impulse))
        if n_contacts == 1 or change <= 1e-15 * largest:
            break
    return True


@numba.njit(inline="always", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def free_step(bodies: Bodies, contacts: Contacts) -> None:
    """Move all bodies by a step without contact and read the ports at its end."""
    for body in range(bodies.free.size):
        call(
            bodies.free[body],
            bodies.parameters[bodies.parameter_start[body] : bodies.parameter_start[body + 1]],
            bodies.state[bodies.state_start[body] : bodies.state_start[body + 1]],
        )
    for port in range(contacts.body.size):
        contacts.free_u[port] = dot(contacts.displacement, port, bodies.state)
        contacts.free_v[port] = dot(contacts.velocity, port, bodies.state)


@numba.njit(inline="always", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def correct(bodies: Bodies, contacts: Contacts) -> None:
    """Add what the forces and impulses of the step do to its end."""
    for port in range(contacts.body.size):
        contact = port // 2
        force, impulse = contacts.force[contact], contacts.impulse[contact]
        if force == 0.0 and impulse == 0.0:
            continue
        body, sign = contacts.body[port], contacts.sign[port]
        shift = bodies.state_start[body]
        size = bodies.state_start[body + 1] - shift
        begin = contacts.force_start[body] + contacts.port_in_body[port] * size
        middle = contacts.impulse_start[body] + contacts.port_in_body[port] * size
        push, kick = sign * force, sign * impulse
        if force != 0.0:
            for i in range(contacts.force_low[port], contacts.force_high[port]):
                bodies.state[shift + i] += push * contacts.responses[begin + i]
        if impulse != 0.0:
            for i in range(size):
                bodies.state[shift + i] += kick * contacts.responses[middle + i]


@numba.njit(cache=True, _nrt=False, fastmath=FAST, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def attempt(bodies: Bodies, contacts: Contacts, clock: Floats, time: float, dt: float, watched: int, opening: bool) -> float:
    """Take the saved step again with another length; return the watched contact's gap at its end, or its trial force."""
    for i in range(bodies.state.size):
        bodies.state[i] = bodies.backup[i]
    retime(bodies, contacts, clock, dt)
    free_step(bodies, contacts)
    answer(contacts, time, dt)
    if opening:
        return contacts.replies[watched].trial
    left, right = 2 * watched, 2 * watched + 1
    gap = contacts.initial_gap[watched] + contacts.free_u[right] - contacts.free_u[left]
    for other in range(contacts.law.size):
        gap += (contacts.u_force[right, other] - contacts.u_force[left, other]) * contacts.force[other]
        gap += (contacts.u_impulse[right, other] - contacts.u_impulse[left, other]) * contacts.impulse[other]
    return gap


@numba.njit(cache=True, _nrt=False, fastmath=FAST, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def root(
    bodies: Bodies, contacts: Contacts, clock: Floats, time: float, dt: float, watched: int, opening: bool, at_dt: float
) -> float:
    """Return the step length at which the watched value falls through zero (bisection, then regula falsi), at most dt."""
    low, high, at_low, at_high = 0.0, dt, 1.0, at_dt
    known = False
    for turn in range(80):
        if known and turn % 3 != 2:
            middle = low + (high - low) * at_low / (at_low - at_high)
            margin = 1e-3 * (high - low)
            middle = min(max(middle, low + margin), high - margin)
        else:
            middle = 0.5 * (low + high)
        value = attempt(bodies, contacts, clock, time, middle, watched, opening)
        if value > 0.0:
            low, at_low, known = middle, value, True
        else:
            high, at_high = middle, value
        if high - low <= 1e-13 * dt:
            break
    return 0.5 * (low + high)


@numba.njit(inline="always", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def note(contacts: Contacts, record: Record, clock: Floats, time: float, contact: int, kind: float, impulse: float) -> None:
    """Write one event; times of one contact never run backwards."""
    n = int(clock[N_EVENTS])
    time = max(time, contacts.last_event[contact])
    contacts.last_event[contact] = time
    event = record.event[n]
    event[0], event[1], event[2], event[3] = time, float(contact), kind, impulse
    event[4], event[5] = contacts.span[contact, 0], contacts.span[contact, 1]
    clock[N_EVENTS] = n + 1


@numba.njit(inline="always", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def date(contacts: Contacts, record: Record, clock: Floats, time: float, dt: float, located: bool) -> None:
    """Date the events of an accepted step, and carry each contact's phase and memory on."""
    for contact in range(contacts.law.size):
        port, reply = contacts.ports[contact], contacts.replies[contact]
        force, impulse = contacts.force[contact], contacts.impulse[contact]
        was_closed, is_closed = port.in_contact > 0.0, reply.in_contact > 0.0
        if contacts.dates[contact] != 0:
            if is_closed and not was_closed:
                contacts.span[contact, 0], contacts.span[contact, 1] = 0.0, 0.0
                old = contacts.old_gap[contact]
                if located:
                    when = time
                elif port.gap > 0.0:
                    when = time + dt * port.gap / (port.gap - port.free_gap) if port.free_gap < 0.0 else time
                elif port.gap < 0.0 and old > 0.0:
                    when = time - dt * port.gap / (port.gap - old)
                elif contacts.old_trial[contact] < 0.0 and reply.trial > 0.0:
                    back = reply.trial / (reply.trial - contacts.old_trial[contact])
                    when = time + port.load_point * dt - dt * back
                else:
                    when = time
                note(contacts, record, clock, max(0.0, when), contact, CLOSE, 0.0)
            if was_closed and not is_closed:
                before = contacts.old_trial[contact]
                when = time
                if not located and before > 0.0 and reply.trial < 0.0:
                    when = time + port.load_point * dt + dt * reply.trial / (before - reply.trial)
                note(contacts, record, clock, when, contact, OPEN, 0.0)
            contacts.span[contact, 0] += force * dt + impulse
            contacts.span[contact, 1] = max(contacts.span[contact, 1], force)
        if impulse != 0.0:
            note(contacts, record, clock, time, contact, IMPULSE, impulse)
        contacts.old_gap[contact] = port.gap
        contacts.old_trial[contact] = reply.trial
        contacts.touching[contact] = 0.0
        port.in_contact = reply.in_contact
        for k in range(MEMORY):
            port.memory[k] = reply.memory[k]
        clock[LOST_CONTACT] += reply.dissipated
        record.sum_force[contact] += force * dt


@numba.njit(inline="always", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def sample(bodies: Bodies, contacts: Contacts, record: Record, clock: Floats) -> bool:
    """Take energies and momenta; False where one is not finite."""
    n = int(clock[N_SAMPLES])
    record.sample_time[n] = clock[TIME]
    finite = True
    for body in range(bodies.free.size):
        first, last = bodies.state_start[body], bodies.state_start[body + 1]
        parameters = bodies.parameters[bodies.parameter_start[body] : bodies.parameter_start[body + 1]]
        call(bodies.measure[body], parameters, bodies.state[first:last], record.scratch)
        momentum = 0.0
        for i in range(first + bodies.n_dof[body], first + 2 * bodies.n_dof[body]):
            momentum += bodies.momentum[i] * bodies.state[i]
        record.sample_body[n, body, 0] = record.scratch[0]
        record.sample_body[n, body, 1] = record.scratch[1]
        record.sample_body[n, body, 2] = momentum
        total = record.scratch[0] + momentum
        finite = finite and total - total == 0.0
    stored = 0.0
    for contact in range(contacts.law.size):
        stored += contacts.replies[contact].stored
    record.sample_book[n, 0] = stored
    record.sample_book[n, 1] = clock[LOST_CONTACT]
    record.sample_book[n, 2] = clock[LOST_ENDS]
    clock[N_SAMPLES] = n + 1
    return finite


@numba.njit(inline="always", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def keep(bodies: Bodies, contacts: Contacts, record: Record, clock: Floats) -> None:
    """Write one record at the end of a step."""
    n = int(clock[N_RECORDS])
    elapsed = clock[TIME] - clock[LAST_TIME]
    record.time[n] = clock[TIME]
    for contact in range(contacts.law.size):
        left, right = 2 * contact, 2 * contact + 1
        record.contact[n, contact, 0] = record.sum_force[contact] / elapsed if elapsed > 0.0 else 0.0
        record.contact[n, contact, 1] = contacts.initial_gap[contact] + contacts.u[right] - contacts.u[left]
        record.sum_force[contact] = 0.0
    for port in range(contacts.body.size):
        record.port[n, port, 0], record.port[n, port, 1] = contacts.u[port], contacts.v[port]
    for probe in range(record.probe.shape[1]):
        record.probe[n, probe] = dot(record.probes, probe, bodies.state)
    clock[LAST_TIME] = clock[TIME]
    clock[N_RECORDS] = n + 1


@numba.njit(inline="always", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def settle(
    bodies: Bodies, contacts: Contacts, record: Record, clock: Floats, time: float, dt: float, end: float, located: bool
) -> None:
    """Accept the answered step: correct the state, read the ports at its end, date events, book losses."""
    correct(bodies, contacts)
    n_contacts = contacts.law.size
    for port in range(contacts.body.size):
        u, v = contacts.free_u[port], contacts.free_v[port]
        for contact in range(n_contacts):
            force, impulse = contacts.force[contact], contacts.impulse[contact]
            u += contacts.u_force[port, contact] * force + contacts.u_impulse[port, contact] * impulse
            v += contacts.v_force[port, contact] * force + contacts.v_impulse[port, contact] * impulse
        contacts.u[port], contacts.v[port] = u, v
    for damper in range(bodies.damper_index.size):
        moved = bodies.state[bodies.damper_index[damper]] - bodies.damper_old[damper]
        clock[LOST_ENDS] += bodies.damper_value[damper] * moved * moved / dt
    date(contacts, record, clock, time, dt, located)
    for snapshot in range(int(clock[N_SNAPSHOTS]), record.snapshot_time.size):
        if record.snapshot_time[snapshot] > end:
            break
        record.snapshot_at[snapshot, 1] = end
        for i in range(bodies.state.size):
            record.snapshot_state[snapshot, 1, i] = bodies.state[i]
        clock[N_SNAPSHOTS] = snapshot + 1
    clock[TIME] = end


@numba.njit(cache=True, _nrt=False, fastmath=FAST, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def located_step(bodies: Bodies, contacts: Contacts, record: Record, clock: Floats, dt: float, step_end: float) -> bool:
    """Take one nominal step, cut at every event found inside it; False where a law failed."""
    cuts = 0
    while True:
        time = clock[TIME]
        h = dt if cuts == 0 else step_end - time
        if h <= 1e-12 * dt:
            clock[TIME] = step_end
            return True
        begin_step(bodies, contacts, record, clock, step_end)
        for i in range(bodies.state.size):
            bodies.backup[i] = bodies.state[i]
        retime(bodies, contacts, clock, h)
        free_step(bodies, contacts)
        if not answer(contacts, time, h):
            return False
        earliest, which, opens, searched = h, -1, False, False
        if cuts < CUTS:
            for contact in range(contacts.law.size):
                attempt(bodies, contacts, clock, time, h, contact, False)
                port, reply = contacts.ports[contact], contacts.replies[contact]
                if port.in_contact > 0.0 and reply.in_contact == 0.0 and reply.trial < 0.0:
                    searched = True
                    # The mean force of a step falls to zero at twice the time at which the force does.
                    tau = 0.5 * root(bodies, contacts, clock, time, h, contact, True, reply.trial)
                    if tau < earliest:
                        earliest, which, opens = tau, contact, True
                elif port.in_contact == 0.0 and port.gap > 0.0:
                    at_end = attempt(bodies, contacts, clock, time, h, contact, False)
                    if at_end < 0.0:
                        searched = True
                        tau = root(bodies, contacts, clock, time, h, contact, False, at_end)
                        if tau < earliest:
                            earliest, which, opens = tau, contact, False
        if which >= 0:
            cuts += 1
            clock[N_CUTS] += 1.0
            if earliest <= 1e-12 * dt:  # now: change the phase and take the step again
                for i in range(bodies.state.size):
                    bodies.state[i] = bodies.backup[i]
                earliest = 0.0
            else:
                attempt(bodies, contacts, clock, time, earliest, 0, False)
                settle(bodies, contacts, record, clock, time, earliest, time + earliest, True)
                keep(bodies, contacts, record, clock)
            if opens:
                note(contacts, record, clock, time + earliest, which, OPEN, 0.0)
                contacts.ports[which].in_contact = 0.0
            else:
                contacts.touching[which] = 1.0
            continue
        if searched:
            attempt(bodies, contacts, clock, time, h, 0, False)
        settle(bodies, contacts, record, clock, time, h, step_end, True)
        return True


@numba.njit(cache=True, _nrt=False, fastmath=FAST)  # type: ignore[untyped-decorator]
def advance_dated(
    bodies: Bodies,
    contacts: Contacts,
    record: Record,
    clock: Floats,
    dt: float,
    last_step: int,
    stride: int,
    sample_stride: int,
) -> int:
    """Take steps up to ``last_step`` or until something must be handled outside; return why it came back.

    ``clock`` carries everything that goes on from one call to the next, so that the answer does not depend on where the
    calls are cut.
    """
    while clock[STEP] < last_step:
        if clock[N_RECORDS] + 2 >= record.time.size or clock[N_SAMPLES] + 2 >= record.sample_time.size:
            return RECORDS_FULL
        if clock[N_EVENTS] + 6 * contacts.law.size >= record.event.shape[0]:
            return EVENTS_FULL
        step = int(clock[STEP])
        end = (step + 1) * dt
        time = clock[TIME]
        begin_step(bodies, contacts, record, clock, end)
        free_step(bodies, contacts)
        if not answer(contacts, time, dt):
            return LAW_FAILED
        settle(bodies, contacts, record, clock, time, dt, end, False)
        clock[STEP] = step + 1
        if (step + 1) % stride == 0 or step + 1 == last_step:
            keep(bodies, contacts, record, clock)
        if (step + 1) % sample_stride == 0 and not sample(bodies, contacts, record, clock):
            return NOT_FINITE
    return DONE


@numba.njit(cache=True, _nrt=False, fastmath=FAST)  # type: ignore[untyped-decorator]
def advance_located(
    bodies: Bodies,
    contacts: Contacts,
    record: Record,
    clock: Floats,
    dt: float,
    last_step: int,
    stride: int,
    sample_stride: int,
) -> int:
    """Take steps up to ``last_step`` or until something must be handled outside; return why it came back.

    ``clock`` carries everything that goes on from one call to the next, so that the answer does not depend on where the
    calls are cut.
    """
    while clock[STEP] < last_step:
        if clock[N_RECORDS] + CUTS + 4 >= record.time.size or clock[N_SAMPLES] + 2 >= record.sample_time.size:
            return RECORDS_FULL
        if clock[N_EVENTS] + 3 * (CUTS + 4) * contacts.law.size >= record.event.shape[0]:
            return EVENTS_FULL
        step = int(clock[STEP])
        end = (step + 1) * dt
        if not located_step(bodies, contacts, record, clock, dt, end):
            return LAW_FAILED
        clock[STEP] = step + 1
        if (step + 1) % stride == 0 or step + 1 == last_step:
            keep(bodies, contacts, record, clock)
        if (step + 1) % sample_stride == 0 and not sample(bodies, contacts, record, clock):
            return NOT_FINITE
    return DONE


@numba.njit(cache=True, _nrt=False, fastmath=FAST)  # type: ignore[untyped-decorator]
def start(bodies: Bodies, contacts: Contacts, record: Record, clock: Floats) -> None:
    """Write the state at t = 0."""
    read_ports(bodies, contacts)
    keep(bodies, contacts, record, clock)
    sample(bodies, contacts, record, clock)
