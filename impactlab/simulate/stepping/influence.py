"""What contacts do to faces and pushed rows at the end of a step: the answers that laws divide by."""

from __future__ import annotations

from impactlab.numerics.compiling import INLINE, PART
from impactlab.simulate.stepping.arrays import (
    LAYERS,
    U_FORCE,
    U_IMPULSE,
    U_PROJECTION,
    U_PUSH,
    V_FORCE,
    V_IMPULSE,
    V_JUMP,
    V_PROJECTION,
    V_PUSH,
    Floats,
    StepArrays,
)


@INLINE
def row_times_state(m: StepArrays, row: int) -> float:
    """Return a sparse row times the state; where its entries lie side by side, as in modes, without looking them up."""
    begin, end = m.row_start[row], m.row_start[row + 1]
    total = 0.0
    if end - begin > 1 and m.row_index[end - 1] - m.row_index[begin] == end - begin - 1:
        first = m.row_index[begin]
        values, state = m.row_value[begin:end], m.state[first : first + end - begin]
        for i in range(values.size):
            total += values[i] * state[i]
        return total
    for entry in range(begin, end):
        total += m.row_value[entry] * m.state[m.row_index[entry]]
    return total


@PART
def row_times(m: StepArrays, row: int, values: Floats, shift: int) -> float:
    """Return a sparse row times values that lie as the state does, but for a shift."""
    total = 0.0
    for entry in range(m.row_start[row], m.row_start[row + 1]):
        total += m.row_value[entry] * values[shift + m.row_index[entry]]
    return total


@PART
def add_answers(m: StepArrays, target: int, u_row: int, v_row: int, weight: float, body_number: int) -> None:
    """Add what contacts do to one row of a body, and to its rate where there is a row for it (else v_row is -1)."""
    body = m.bodies[body_number]
    size = body.state_end - body.state_start
    for other in range(len(m.faces)):
        face, contact = m.faces[other], other // 2
        if face.body != body_number:
            continue
        scale, at = weight * face.sign, face.place * size - body.state_start
        force, impulse, projection = body.force_start + at, body.impulse_start + at, body.projection_start + at
        jump = body.jump_start + face.place * body.n_dof - body.state_start - body.n_dof
        m.answers[U_FORCE, target, contact] += scale * row_times(m, u_row, m.responses, force)
        m.answers[U_IMPULSE, target, contact] += scale * row_times(m, u_row, m.responses, impulse)
        m.answers[U_PROJECTION, target, contact] += scale * row_times(m, u_row, m.responses, projection)
        if v_row >= 0:
            m.answers[V_FORCE, target, contact] += scale * row_times(m, v_row, m.responses, force)
            m.answers[V_IMPULSE, target, contact] += scale * row_times(m, v_row, m.responses, impulse)
            m.answers[V_PROJECTION, target, contact] += scale * row_times(m, v_row, m.responses, projection)
            m.answers[V_JUMP, target, contact] += scale * row_times(m, v_row, m.jump, jump)
    for other in range(len(m.pushes)):
        push = m.pushes[other]
        if push.body != body_number:
            continue
        scale, start = weight * push.weight, body.force_start + push.place * size - body.state_start
        m.answers[U_PUSH, target, push.contact] += scale * row_times(m, u_row, m.responses, start)
        if v_row >= 0:
            m.answers[V_PUSH, target, push.contact] += scale * row_times(m, v_row, m.responses, start)


@PART
def compliances(m: StepArrays) -> None:
    """Fill the answers of each face and each pushed row to each contact from the responses of the bodies."""
    n_contacts, n_faces = len(m.contacts), len(m.faces)
    for layer in range(LAYERS):
        for target in range(3 * n_contacts):
            for contact in range(n_contacts):
                m.answers[layer, target, contact] = 0.0
    for number in range(n_faces):
        add_answers(m, number, number, n_faces + number, 1.0, m.faces[number].body)
    first_push = len(m.row_start) - 1 - len(m.pushes)
    for number in range(len(m.pushes)):
        push = m.pushes[number]
        add_answers(m, n_faces + push.contact, first_push + number, -1, push.weight, push.body)
    for contact in range(n_contacts):
        left, right, pushed = 2 * contact, 2 * contact + 1, n_faces + contact
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
        port.gap_per_projection = m.answers[U_PROJECTION, right, contact] - m.answers[U_PROJECTION, left, contact]
        port.gap_per_push = m.answers[U_PUSH, right, contact] - m.answers[U_PUSH, left, contact]
        port.pushed_per_force = m.answers[U_FORCE, pushed, contact]
        port.pushed_per_push = m.answers[U_PUSH, pushed, contact]


@PART
def pushed_values(m: StepArrays, free: bool) -> None:
    """Read the rows that laws may push along, at the start of a step or at the end of the free one."""
    first_push = len(m.row_start) - 1 - len(m.pushes)
    for number in range(len(m.pushes)):
        port = m.ports[m.pushes[number].contact]
        if free:
            port.free_pushed = 0.0
        else:
            port.pushed = 0.0
    for number in range(len(m.pushes)):
        push = m.pushes[number]
        value = push.weight * row_times_state(m, first_push + number)
        if free:
            m.ports[push.contact].free_pushed += value
        else:
            m.ports[push.contact].pushed += value
