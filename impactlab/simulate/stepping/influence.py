"""Influence coefficients: effect of each contact on faces and pushed rows at the end of a step."""

from __future__ import annotations

from impactlab.numerics.compiling import INLINE, PART
from impactlab.simulate.stepping.arrays import (
    LAYERS,
    U_FORCE,
    U_IMPULSE,
    U_PROJECTION,
    U_PUSH,
    V_FORCE,
    V_JUMP,
    V_PUSH,
    Floats,
    StepArrays,
)

NO_EFFECT = 1e-20  # of a contact's effect on its own faces


@INLINE
def row_times_state(m: StepArrays, row: int) -> float:
    """Return a sparse row times the state; contiguous entries, as of modes, are read without an index."""
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
    """Return a sparse row times values with the layout of the state, shifted."""
    total = 0.0
    for entry in range(m.row_start[row], m.row_start[row + 1]):
        total += m.row_value[entry] * values[shift + m.row_index[entry]]
    return total


@PART
def add_influence(m: StepArrays, target: int, u_row: int, v_row: int, weight: float, body_number: int) -> None:
    """Add the influence of contacts on one row of a body, and on its rate.

    The rate has the row v_row, -1 if there is none.
    """
    body = m.bodies[body_number]
    size = body.state_end - body.state_start
    for other in range(len(m.faces)):
        face, contact = m.faces[other], other // 2
        if face.body != body_number:
            continue
        scale = weight * face.sign
        for kind in range(3):  # forces, impulses, projections
            column = body.response_start + (kind * body.n_ports + face.place) * size - body.state_start
            m.influence[2 * kind, target, contact] += scale * row_times(m, u_row, m.responses, column)
            if v_row >= 0:
                m.influence[2 * kind + 1, target, contact] += scale * row_times(m, v_row, m.responses, column)
        if v_row >= 0:
            jump = body.jump_start + face.place * body.n_dof - body.state_start - body.n_dof
            m.influence[V_JUMP, target, contact] += scale * row_times(m, v_row, m.jump, jump)
    for other in range(len(m.pushes)):
        push = m.pushes[other]
        if push.body != body_number:
            continue
        scale, start = weight * push.weight, body.response_start + push.place * size - body.state_start
        m.influence[U_PUSH, target, push.contact] += scale * row_times(m, u_row, m.responses, start)
        if v_row >= 0:
            m.influence[V_PUSH, target, push.contact] += scale * row_times(m, v_row, m.responses, start)


@PART
def find_coupled(m: StepArrays, number: int) -> None:
    """Write which contacts act on the faces or the pushed row of one within a step; itself is always among them.

    Effects below rounding are taken for none: those of far faces under an implicit scheme.
    """
    n_contacts, found = len(m.contacts), 0
    for other in range(n_contacts):
        acts = other == number
        for layer in range(LAYERS):
            for row in range(3):
                target = 2 * n_contacts + number if row == 2 else 2 * number + row
                effect, own = abs(m.influence[layer, target, other]), abs(m.influence[layer, target, number])
                acts = acts or effect > NO_EFFECT * own
        if acts:
            found += 1
            m.coupled[number, found] = other
    m.coupled[number, 0] = found


@PART
def fill_influence(m: StepArrays) -> None:
    """Fill the influence of each contact on each face and pushed row, and the compliances of the ports."""
    n_contacts, n_faces = len(m.contacts), len(m.faces)
    for layer in range(LAYERS):
        for target in range(3 * n_contacts):
            for contact in range(n_contacts):
                m.influence[layer, target, contact] = 0.0
    for number in range(n_faces):
        add_influence(m, number, number, n_faces + number, 1.0, m.faces[number].body)
    first_push = len(m.row_start) - 1 - len(m.pushes)
    for number in range(len(m.pushes)):
        push = m.pushes[number]
        add_influence(m, n_faces + push.contact, first_push + number, -1, push.weight, push.body)
    for contact in range(n_contacts):
        find_coupled(m, contact)
        left, right, pushed = 2 * contact, 2 * contact + 1, n_faces + contact
        port = m.ports[contact]
        port.left.displacement_per_force = -m.influence[U_FORCE, left, contact]
        port.left.velocity_per_force = -m.influence[V_FORCE, left, contact]
        port.left.velocity_per_impulse = -m.influence[V_JUMP, left, contact]
        port.right.displacement_per_force = m.influence[U_FORCE, right, contact]
        port.right.velocity_per_force = m.influence[V_FORCE, right, contact]
        port.right.velocity_per_impulse = m.influence[V_JUMP, right, contact]
        port.gap_per_force = m.influence[U_FORCE, right, contact] - m.influence[U_FORCE, left, contact]
        port.rate_per_force = m.influence[V_FORCE, right, contact] - m.influence[V_FORCE, left, contact]
        port.gap_per_impulse = m.influence[U_IMPULSE, right, contact] - m.influence[U_IMPULSE, left, contact]
        port.rate_per_impulse = m.influence[V_JUMP, right, contact] - m.influence[V_JUMP, left, contact]
        port.gap_per_projection = m.influence[U_PROJECTION, right, contact] - m.influence[U_PROJECTION, left, contact]
        port.gap_per_push = m.influence[U_PUSH, right, contact] - m.influence[U_PUSH, left, contact]
        port.pushed_per_force = m.influence[U_FORCE, pushed, contact]
        port.pushed_per_push = m.influence[U_PUSH, pushed, contact]


@PART
def pushed_values(m: StepArrays, free: bool) -> None:
    """Read the rows that laws may push along.

    They are read at the start of a step or at the end of the free one.
    """
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
