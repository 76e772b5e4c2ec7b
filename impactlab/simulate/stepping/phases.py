"""Exchange of coordinates of bodies that have two sets: contact open and contact closed."""

from __future__ import annotations

from impactlab.integrators.columns import exchange
from impactlab.numerics.addresses import call
from impactlab.numerics.compiling import PART
from impactlab.simulate.stepping.arrays import StepArrays
from impactlab.simulate.stepping.influence import fill_influence, row_times_state


@PART
def energy_of(m: StepArrays, number: int) -> float:
    """Return the energy of a body less the work of its loads [J]."""
    body = m.bodies[number]
    m.scratch[2] = 0.0
    call(
        body.measure,
        m.parameters[body.parameter_start : body.parameter_end],
        m.state[body.state_start : body.state_end],
        m.scratch,
    )
    return float(m.scratch[0] - m.scratch[1])


@PART
def change_coordinates(m: StepArrays, number: int) -> None:
    """Exchange the coordinates of a body and book the energy lost.

    The loss is that of the map between both sets.
    """
    phase = m.phases[number]
    body = m.bodies[phase.body]
    before = energy_of(m, phase.body)
    n, first = body.n_dof, body.state_start
    for part in range(2):
        start = phase.map_start + (2 * phase.closed + part) * n * n
        for i in range(n):
            total = 0.0  # a sum in memory would be reordered by how far its place is from what it reads: other bits
            for j in range(n):
                total += m.maps[start + i * n + j] * m.state[first + part * n + j]
            m.backup[first + i] = total
        for i in range(n):
            m.state[first + part * n + i] = m.backup[first + i]
    size, n_rows, shift = body.state_end - body.state_start, m.row_value.size, 0
    exchange(m.parameters, body.parameter_start, m.other_state[body.parameter_start : body.parameter_end])
    shift += m.parameters.size
    exchange(m.momentum, body.state_start, m.other_state[shift + body.state_start : shift + body.state_end])
    shift += m.momentum.size
    exchange(m.jump, body.jump_start, m.other_state[shift + body.jump_start : shift + body.loads_end])
    shift += m.jump.size
    start = shift + body.response_start
    exchange(m.responses, body.response_start, m.other_state[start : start + 3 * body.n_ports * size])
    shift += m.responses.size
    for entry in range(n_rows):
        if body.state_start <= m.row_index[entry] < body.state_end:
            exchange(m.row_value, entry, m.other_state[shift + entry : shift + entry + 1])
    shift += n_rows
    for reading in range(len(m.readings)):
        if m.readings[reading].body == phase.body:
            for contact in range(len(m.contacts)):
                at = shift + reading * len(m.contacts) + contact
                m.left_out[reading, contact], m.other_state[at] = m.other_state[at], m.left_out[reading, contact]
    if body.derive != 0:
        parameters = m.parameters[body.parameter_start : body.parameter_end]
        call(body.derive, parameters, m.state[body.state_start : body.state_end])
    phase.closed = 1 - phase.closed
    dropped = max(0.0, before - energy_of(m, phase.body))
    m.clock[0].lost_unresolved += dropped
    m.clock[0].lost_in_maps += dropped
    m.clock[0].n_maps += 1


@PART
def change_phases(m: StepArrays) -> None:
    """Give every body the coordinates for the present state of its contact.

    Faces that have met and approach are closed already, so that the law closes them in the coordinates of that phase.
    The map may move a face; the gap is then counted from its new place.
    """
    n_faces, changed = len(m.faces), False
    for number in range(len(m.phases)):
        phase = m.phases[number]
        contact, port = m.contacts[phase.contact], m.ports[phase.contact]
        left, right = m.faces[2 * phase.contact], m.faces[2 * phase.contact + 1]
        gap = contact.initial_gap + right.u - left.u
        closed = port.in_contact > 0.0 or (gap + port.offset <= 0.0 and right.v < left.v)
        if closed != (phase.closed != 0):
            change_coordinates(m, number)
            changed = True
            for face in range(n_faces):
                m.faces[face].u = row_times_state(m, face)
                m.faces[face].v = row_times_state(m, n_faces + face)
            contact.initial_gap = gap - (right.u - left.u)
    if changed:
        m.clock[0].timed = -1.0  # the other coordinates were prepared for the nominal step
        fill_influence(m)
