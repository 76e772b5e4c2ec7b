"""Influence coefficients: effects of contacts on faces and pushed rows within a step."""

from __future__ import annotations

from impactlab.numerics.compiling import MERGED, PART
from impactlab.numerics.windows import window
from impactlab.simulate.stepping.arrays import (
    FEW,
    LAYERS,
    U_FORCE,
    U_IMPULSE,
    U_PROJECTION,
    U_PUSH,
    V_FORCE,
    V_JUMP,
    V_PUSH,
    StepArrays,
)
from impactlab.types import Array, Ints

NO_EFFECT = 1e-20  # of a contact's effect on its own faces


@PART
def sum_of_row(index: Ints, value: Array, state: Array, begin: int, end: int) -> float:
    """Return a sparse row times the state; ``begin`` and ``end`` are those of its entries.

    Contiguous entries, as of modes, are read without an index.
    """
    total, size = 0.0, end - begin
    if size > 0 and index[end - 1] - index[begin] == size - 1:
        part, factors = window(state, index[begin], size), window(value, begin, size)
        for i in range(size):
            total += factors[i] * part[i]
        return total
    for entry in range(begin, end):
        total += value[entry] * state[index[entry]]
    return total


@MERGED
def row_times_state(m: StepArrays, row: int) -> float:
    """Return a sparse row times the state."""
    begin, end = m.row_start[row], m.row_start[row + 1]
    if end - begin == 1:
        return float(m.row_value[begin] * m.state[m.row_index[begin]])
    return sum_of_row(m.row_index, m.row_value, m.state, begin, end)


@PART
def row_times(m: StepArrays, row: int, values: Array, shift: int) -> float:
    """Return a sparse row times values with the layout of the state, shifted."""
    total = 0.0
    for entry in range(m.row_start[row], m.row_start[row + 1]):
        total += m.row_value[entry] * values[shift + m.row_index[entry]]
    return total


@PART
def add_effects(
    m: StepArrays, out: Array, other: int, place: int, u_row: int, v_row: int, weight: float, at: int
) -> None:
    """Add a contact's effects on a row and its rate to its influence coefficients.

    The row is a left or right face (place 0 or 1) or one that is pushed (2), of body ``at``; the rate has the row
    v_row, -1 if there is none.
    """
    body = m.bodies[at]
    size = body.state_end - body.state_start
    for number in range(2 * other, 2 * other + 2):
        face = m.faces[number]
        if face.body != at:
            continue
        scale = weight * face.sign
        for kind in range(3):  # forces, impulses, projections
            column = body.response_start + (kind * body.n_ports + face.place) * size - body.state_start
            out[place, 2 * kind] += scale * row_times(m, u_row, m.responses, column)
            if v_row >= 0:
                out[place, 2 * kind + 1] += scale * row_times(m, v_row, m.responses, column)
        if v_row >= 0:
            jump = body.jump_start + face.place * body.n_dof - body.state_start - body.n_dof
            out[place, V_JUMP] += scale * row_times(m, v_row, m.jump, jump)
    for number in range(len(m.pushes)):
        push = m.pushes[number]
        if push.body == at and push.contact == other:
            scale, start = weight * push.weight, body.response_start + push.place * size - body.state_start
            out[place, U_PUSH] += scale * row_times(m, u_row, m.responses, start)
            if v_row >= 0:
                out[place, V_PUSH] += scale * row_times(m, v_row, m.responses, start)


@PART
def write_effects(m: StepArrays, out: Array, number: int, other: int) -> None:
    """Write the influence coefficients of a contact on another's faces and pushed row."""
    for place in range(3):
        for layer in range(LAYERS):
            out[place, layer] = 0.0
    n_faces, first_push = len(m.faces), len(m.row_start) - 1 - len(m.pushes)
    for place in range(2):
        face = 2 * number + place
        if m.faces[face].moves != 0:
            add_effects(m, out, other, place, face, n_faces + face, 1.0, m.faces[face].body)
    for at in range(len(m.pushes)):
        push = m.pushes[at]
        if push.contact == number:
            add_effects(m, out, other, 2, first_push + at, -1, push.weight, push.body)


@PART
def find_coupled(m: StepArrays, number: int) -> None:
    """Write the contacts that act on one within a step, and their effects.

    The contact itself is among them. Effects below rounding are taken for none: those of far faces under an implicit
    scheme.
    """
    contact = m.contacts[number]
    found = contact.first_pair
    for pair in range(contact.first_pair, contact.last_pair):
        other = m.candidates[pair]
        effects = m.influence[found]
        write_effects(m, effects, number, other)
        acts = other == number
        for place in range(3):
            for layer in range(LAYERS):
                acts = acts or abs(effects[place, layer]) > NO_EFFECT * abs(m.own_influence[place, layer])
        if acts:
            m.coupled[found] = other
            found += 1
    contact.coupled = found - contact.first_pair


@PART
def find_sparse_response(m: StepArrays, number: int) -> None:
    """Write the few entries of the state that a force on a face changes.

    Responses with many entries are marked instead.
    """
    face = m.faces[number]
    body = m.bodies[face.body]
    start = body.response_start + face.place * (body.state_end - body.state_start)
    face.few, entries = 0, 0
    if face.moves == 0:
        return
    for part in range(3):
        entries += face.high[part] - face.low[part]
    if entries > FEW:
        face.few = -1
        return
    for part in range(3):
        for i in range(face.low[part], face.high[part]):
            face.index[face.few] = body.state_start + i
            face.per_force[face.few] = m.responses[start + i]
            face.few += 1


@PART
def fill_influence(m: StepArrays) -> None:
    """Fill the influence coefficients of all contacts, and the compliances of the ports."""
    for number in range(len(m.faces)):
        find_sparse_response(m, number)
    for contact in range(len(m.contacts)):
        port, own = m.ports[contact], m.own_influence
        write_effects(m, own, contact, contact)
        port.left.displacement_per_force = -own[0, U_FORCE]
        port.left.velocity_per_force = -own[0, V_FORCE]
        port.left.velocity_per_impulse = -own[0, V_JUMP]
        port.right.displacement_per_force = own[1, U_FORCE]
        port.right.velocity_per_force = own[1, V_FORCE]
        port.right.velocity_per_impulse = own[1, V_JUMP]
        port.gap_per_force = own[1, U_FORCE] - own[0, U_FORCE]
        port.rate_per_force = own[1, V_FORCE] - own[0, V_FORCE]
        port.gap_per_impulse = own[1, U_IMPULSE] - own[0, U_IMPULSE]
        port.rate_per_impulse = own[1, V_JUMP] - own[0, V_JUMP]
        port.gap_per_projection = own[1, U_PROJECTION] - own[0, U_PROJECTION]
        port.gap_per_push = own[1, U_PUSH] - own[0, U_PUSH]
        port.pushed_per_force = own[2, U_FORCE]
        port.pushed_per_push = own[2, U_PUSH]
        find_coupled(m, contact)


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
