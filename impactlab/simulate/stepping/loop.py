"""The step loop: free step, contact solve, correction, events, energies.

It is compiled; the same code runs as plain Python. Bodies are linear steppers and laws are `respond`, both called by
address. All arrays are allocated before the run (`arrays`, `assembly`); a step allocates nothing, so the loop is
compiled without numba's runtime for objects. Pieces that few scenes need are called by address, too (`pieces`): a plain
scene does not wait until they are compiled.
"""

from __future__ import annotations

from impactlab.numerics.addresses import call
from impactlab.numerics.compiling import ENTRY, INLINE, MERGED, PART
from impactlab.numerics.windows import window
from impactlab.simulate.stepping.arrays import (
    APPLY_LOADS,
    BOOK_DASHPOTS,
    BOOK_LOADS,
    CHANGE_PHASES,
    MARCH_ROWS,
    PUSH_ROWS,
    READ_AGAIN,
    READ_LENGTHS,
    READ_LOADS,
    READ_PUSHED,
    READ_READINGS,
    READ_ROWS,
    RECORD_ROWS,
    REWRITE_COLUMNS,
    SHOW_ROWS,
    STEP_ROWS,
    StepArrays,
)
from impactlab.simulate.stepping.contact_solve import effect_of, evaluate, solve_contacts
from impactlab.simulate.stepping.event_times import write_events
from impactlab.simulate.stepping.influence import fill_influence, row_times_state
from impactlab.simulate.stepping.samples import sample_energies
from impactlab.types import MEMORY, Array

# Status that `advance_dated` returns.
DONE, LAW_FAILED, NOT_FINITE, RECORDS_FULL, EVENTS_FULL = 0, 1, 2, 3, 4
TWO = 2  # entries of the state that a force changes: a displacement and a velocity
MIN_VECTOR = 8  # entries: in shorter ranges, setting up vector registers costs more than it saves
SNAPSHOT_TOL = 1e-9  # of a step: a snapshot this little after its end is taken at its end (a multiple of dt is rounded)


@INLINE
def closed_phases(m: StepArrays) -> int:
    """Return which phases are closed, as bits."""
    bits = 0
    for number in range(len(m.phases)):
        bits |= m.phases[number].closed << number
    return bits


@PART
def take_before(m: StepArrays, end: float) -> None:
    """Take the snapshots of a step at its start."""
    clock = m.clock[0]
    for number in range(clock.n_snapshots, len(m.snapshots)):
        if m.snapshots[number].time > end + SNAPSHOT_TOL * (end - clock.time):
            break
        m.snapshots[number].before = clock.time
        m.snapshots[number].closed_before = closed_phases(m)
        if len(m.bead_rows) > 0:
            call(m.pieces[SHOW_ROWS], m)
        for i in range(m.state.size):
            m.snapshot_state[number, 0, i] = m.state[i]


@PART
def take_after(m: StepArrays, dt: float, end: float) -> None:
    """Take the snapshots of a step at its end."""
    clock = m.clock[0]
    for number in range(clock.n_snapshots, len(m.snapshots)):
        if m.snapshots[number].time > end + SNAPSHOT_TOL * dt:
            break
        m.snapshots[number].after = end
        m.snapshots[number].closed_after = closed_phases(m)
        if len(m.bead_rows) > 0:
            call(m.pieces[SHOW_ROWS], m)
        for i in range(m.state.size):
            m.snapshot_state[number, 1, i] = m.state[i]
        clock.n_snapshots = number + 1


@INLINE
def begin_step(m: StepArrays, end: float) -> None:
    """Read the state at the start of a step, beside the faces, and take snapshots."""
    clock = m.clock[0]
    if clock.rare != 0:
        if len(m.readings) > 0:
            call(m.pieces[READ_READINGS], m)
        if len(m.pushes) > 0:
            call(m.pieces[READ_PUSHED], m, 0)
        if len(m.loads) > 0:
            call(m.pieces[READ_LOADS], m)
        if len(m.dampers) > 0:
            call(m.pieces[READ_LENGTHS], m)
    if clock.n_snapshots < len(m.snapshots):
        take_before(m, end)


@INLINE
def free_step(m: StepArrays, time: float, dt: float) -> None:
    """Take the free step of all bodies under their loads; read the faces."""
    if len(m.bead_rows) > 0:
        call(m.pieces[STEP_ROWS], m, dt)
    for number in range(len(m.called)):
        body = m.bodies[m.called[number]]
        parameters = window(m.parameters, body.parameter_start, body.parameter_end - body.parameter_start)
        call(body.free, parameters, window(m.state, body.state_start, body.state_end - body.state_start))
    rare = m.clock[0].rare != 0
    if rare and len(m.loads) > 0:
        call(m.pieces[APPLY_LOADS], m, time, dt)
    if m.clock[0].changes != 0:
        call(m.pieces[REWRITE_COLUMNS], m)
    n_faces = len(m.faces)
    for number in range(n_faces):
        face = m.faces[number]
        if face.u_at >= 0:
            face.free_u, face.free_v = window(m.state, face.u_at, 1)[0], window(m.state, face.v_at, 1)[0]
        elif face.moves != 0:
            face.free_u, face.free_v = row_times_state(m, number), row_times_state(m, n_faces + number)
    if rare and len(m.pushes) > 0:
        call(m.pieces[READ_PUSHED], m, 1)


@PART
def add_range(state: Array, response: Array, factor: float) -> None:
    """Add a factor times a response to a state, in vector registers."""
    for i in range(state.size):
        state[i] += factor * response[i]


@MERGED
def add_responses(m: StepArrays, state_start: int, start: int, factor: float, low: int, high: int) -> None:
    """Add a factor times a range of a response to a body's state."""
    if high - low > MIN_VECTOR:
        size = high - low
        add_range(window(m.state, state_start + low, size), window(m.responses, start + low, size), factor)
        return
    for i in range(low, high):
        m.state[state_start + i] += factor * m.responses[start + i]


@PART
def respond_to(m: StepArrays, number: int, kind: int, given: float) -> None:
    """Add the response to a force, impulse or projection at a face.

    These are the kinds 0, 1 and 2.
    """
    face = m.faces[number]
    body = m.bodies[face.body]
    start = body.response_start + (kind * body.n_ports + face.place) * (body.state_end - body.state_start)
    for part in range(3 * kind, 3 * kind + 3):
        add_responses(m, body.state_start, start, face.sign * given, face.low[part], face.high[part])


@PART
def correct_coupled(m: StepArrays, number: int) -> None:
    """Add the responses to an impulse and a projection; read the coupled faces."""
    contact, left, right = m.contacts[number], m.faces[2 * number], m.faces[2 * number + 1]
    if contact.impulse != 0.0 or contact.projection != 0.0:
        for face in range(2 * number, 2 * number + 2):
            if m.faces[face].moves != 0:
                respond_to(m, face, 1, contact.impulse)
                respond_to(m, face, 2, contact.projection)
    left_u, left_v, right_u, right_v = left.free_u, left.free_v, right.free_u, right.free_v
    for pair in range(contact.first_pair, contact.first_pair + contact.coupled):
        other = m.contacts[m.coupled[pair]]
        left_u += effect_of(m, pair, 0, 0, other)
        left_v += effect_of(m, pair, 0, 1, other)
        right_u += effect_of(m, pair, 1, 0, other)
        right_v += effect_of(m, pair, 1, 1, other)
    left.u, left.v, right.u, right.v = left_u, left_v, right_u, right_v


@INLINE
def push_face(m: StepArrays, number: int, force: float) -> None:
    """Add the response to a force at a face to the state of its body."""
    face = m.faces[number]
    push = face.sign * force
    if face.few == TWO:
        first, second = face.index[0], face.index[1]
        if first >= 0 and second >= 0:  # always; known, it spares a check at each
            m.state[first] += push * face.per_force[0]
            m.state[second] += push * face.per_force[1]
    elif face.few >= 0:
        for entry in range(face.few):
            m.state[face.index[entry]] += push * face.per_force[entry]
    elif force != 0.0:
        respond_to(m, number, 0, force)


@INLINE
def correct(m: StepArrays) -> None:
    """Add the responses to the replies of the step; read the faces.

    Faces are free values and influence, as a law reckons: read from the state, a gap that a law has closed would be a
    rounding.
    """
    for number in range(len(m.contacts)):
        contact, left, right = m.contacts[number], m.faces[2 * number], m.faces[2 * number + 1]
        force = contact.force
        push_face(m, 2 * number, force)
        push_face(m, 2 * number + 1, force)
        if contact.coupled == 1 and contact.impulse == 0.0 and contact.projection == 0.0 and contact.push == 0.0:
            port = m.ports[number]
            left.u = left.free_u - port.left.displacement_per_force * force
            left.v = left.free_v - port.left.velocity_per_force * force
            right.u = right.free_u + port.right.displacement_per_force * force
            right.v = right.free_v + port.right.velocity_per_force * force
        else:
            correct_coupled(m, number)
    if m.clock[0].rare != 0 and len(m.pushes) > 0:
        call(m.pieces[PUSH_ROWS], m)
    if m.clock[0].changes != 0:
        call(m.pieces[READ_AGAIN], m)


@INLINE
def book_step(m: StepArrays, dt: float, end: float) -> None:
    """Book the losses of an accepted step, take snapshots, advance the clock."""
    clock = m.clock[0]
    if clock.rare != 0:
        if len(m.loads) > 0:
            call(m.pieces[BOOK_LOADS], m, dt)
        if len(m.dampers) > 0:
            call(m.pieces[BOOK_DASHPOTS], m, dt)
    if clock.n_snapshots < len(m.snapshots):
        take_after(m, dt, end)
    clock.time = end


@MERGED
def write_record(m: StepArrays, dt: float) -> None:
    """Write one record at the end of a step."""
    clock, n_contacts = m.clock[0], len(m.contacts)
    row, elapsed = m.record[clock.n_records], clock.time - clock.recorded
    row[0] = clock.time
    for number in range(n_contacts):
        contact, left, right = m.contacts[number], m.faces[2 * number], m.faces[2 * number + 1]
        own, offset = window(row, 1 + 6 * number, 6), m.ports[number].offset
        own[0] = contact.sum_force / elapsed if elapsed > 0.0 else 0.0
        own[1] = contact.initial_gap + right.u - left.u + offset
        own[2], own[3] = left.u - contact.left_share * offset, left.v
        own[4], own[5] = right.u + (1.0 - contact.left_share) * offset, right.v
        contact.sum_force = 0.0
    first_column = 1 + 6 * n_contacts
    if len(m.bead_rows) > 0:
        call(m.pieces[RECORD_ROWS], m, first_column, elapsed / dt)
        first_column += m.clock[0].bead_columns
    first_probe, n_probes = 2 * len(m.faces) + len(m.readings), len(m.probe_at)
    probes = window(row, first_column, n_probes)
    for probe in range(n_probes):
        at = m.probe_at[probe]
        probes[probe] = window(m.state, at, 1)[0] if at >= 0 else row_times_state(m, first_probe + probe)
    clock.recorded = clock.time
    clock.n_records += 1


@INLINE
def steps_to_snapshot(m: StepArrays, dt: float, steps: int) -> int:
    """Return how many of some steps begin and end before the next snapshot."""
    clock = m.clock[0]
    if clock.n_snapshots < len(m.snapshots):
        return min(steps, int((m.snapshots[clock.n_snapshots].time - clock.time) / dt) - 1)
    return steps


@INLINE
def steps_to_kept(m: StepArrays, regular: int) -> int:
    """Return how many steps it is to the next kept instant: the ``regular`` one, or an end of the last two steps."""
    clock = m.clock[0]
    return min(regular, max(1, clock.steps - 2 - clock.step))


@ENTRY
def advance_dated(m: StepArrays, dt: float, last_step: int, stride: int, sample_stride: int) -> int:
    """Take whole steps up to ``last_step``; return a status.

    They end earlier where an array is full or the run fails. The clock carries everything that continues from one call
    to the next, so that no bit depends on the chunks.
    """
    clock = m.clock[0]
    # Counted down: a division in every step takes as long as three nodes.
    to_record = steps_to_kept(m, stride - clock.step % stride)
    to_sample = steps_to_kept(m, sample_stride - clock.step % sample_stride)
    while clock.step < last_step:
        if clock.n_records + 2 >= m.record.shape[0] or clock.n_samples + 2 >= m.sample.shape[0]:
            return RECORDS_FULL
        if clock.n_events + 6 * len(m.contacts) + m.bead_contacts.shape[1] >= len(m.events):
            return EVENTS_FULL
        quiet = (
            steps_to_snapshot(m, dt, min(to_record, to_sample, last_step - clock.step)) if clock.only_beads != 0 else 0
        )
        if quiet > 0:
            call(m.pieces[MARCH_ROWS], m, dt, quiet)
            taken = int(m.scratch[0])
            clock.step += taken
            clock.time = clock.step * dt
            to_record -= taken
            to_sample -= taken
            if clock.failed_bead != 0:
                return LAW_FAILED
        else:
            time, end = clock.time, (clock.step + 1) * dt
            begin_step(m, end)
            free_step(m, time, dt)
            if clock.failed_bead != 0 or not solve_contacts(m, time, dt):
                return LAW_FAILED
            correct(m)
            if m.shared.size > 0:
                call(m.pieces[READ_ROWS], m)
            write_events(m, time, dt)
            book_step(m, dt, end)
            clock.step += 1
            to_record -= 1
            to_sample -= 1
        if to_record == 0:
            write_record(m, dt)
            to_record = steps_to_kept(m, stride)
        if to_sample == 0:
            if not sample_energies(m, dt):
                return NOT_FINITE
            to_sample = steps_to_kept(m, sample_stride)
    if len(m.bead_rows) > 0:
        call(m.pieces[SHOW_ROWS], m)
    return DONE


@ENTRY
def start(m: StepArrays, dt: float) -> None:
    """Fill the influence coefficients and write the state at t = 0."""
    n_faces = len(m.faces)
    for number in range(n_faces):
        face = m.faces[number]
        face.u = row_times_state(m, number)
        face.v = row_times_state(m, n_faces + number)
        face.free_u, face.free_v = face.u, face.v
    for number in range(len(m.contacts)):
        contact = m.contacts[number]
        gap = contact.initial_gap + m.faces[2 * number + 1].u - m.faces[2 * number].u  # with displacements at t = 0
        if (contact.compliant != 0 and gap < 0.0) or contact.joined != 0:
            # Overlapping faces and links may store energy at the start: the law is evaluated while all compliances are
            # still zero.
            load_point, contact.load_point = contact.load_point, 0.0
            if load_point == 0.0:  # leapfrog keeps the energy of both ends of a step: here of the one before the first
                for face in (m.faces[2 * number], m.faces[2 * number + 1]):
                    face.free_u = face.u - dt * face.v
            evaluate(m, number, 0.0, 1.0)
            contact.load_point = load_point
            for k in range(MEMORY):  # a contact that yields at t = 0 has yielded before; its stored energy may be lost
                m.ports[number].memory[k] = m.replies[number].memory[k]
    fill_influence(m)
    if len(m.phases) > 0:
        call(m.pieces[CHANGE_PHASES], m)
    write_record(m, dt)
    sample_energies(m, dt)
