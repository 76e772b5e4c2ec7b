"""Exchange of coordinates of bodies that have two sets: contact open and contact closed."""

from __future__ import annotations

from impactlab.numerics.addresses import call
from impactlab.numerics.compiling import PART
from impactlab.simulate.stepping.arrays import Floats, StepArrays
from impactlab.simulate.stepping.influence import fill_influence, row_times_state


@PART
def exchange(values: Floats, low: int, high: int, other: Floats, shift: int) -> None:
    """Exchange a range of values with those stored at a shift."""
    for i in range(low, high):
        values[i], other[shift + i] = other[shift + i], values[i]


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
    """Exchange the coordinates of a body and book the energy that the map between them loses."""
    phase = m.phases[number]
    body = m.bodies[phase.body]
    before = energy_of(m, phase.body)
    n, first = body.n_dof, body.state_start
    for part in range(2):
        start = phase.map_start + (2 * phase.closed + part) * n * n
        for i in range(n):
            m.backup[first + i] = 0.0
            for j in range(n):
                m.backup[first + i] += m.maps[start + i * n + j] * m.state[first + part * n + j]
        for i in range(n):
            m.state[first + part * n + i] = m.backup[first + i]
    size, shift = body.state_end - body.state_start, 0
    exchange(m.parameters, body.parameter_start, body.parameter_end, m.other_state, shift)
    shift += m.parameters.size
    exchange(m.momentum, body.state_start, body.state_end, m.other_state, shift)
    shift += m.momentum.size
    exchange(m.jump, body.jump_start, body.loads_end, m.other_state, shift)
    shift += m.jump.size
    exchange(m.responses, body.force_start, body.force_start + body.n_ports * size, m.other_state, shift)
    exchange(m.responses, body.impulse_start, body.impulse_start + body.n_ports * size, m.other_state, shift)
    exchange(m.responses, body.projection_start, body.projection_start + body.n_ports * size, m.other_state, shift)
    shift += m.responses.size
    for entry in range(m.row_value.size):
        if body.state_start <= m.row_index[entry] < body.state_end:
            exchange(m.row_value, entry, entry + 1, m.other_state, shift)
    shift += m.row_value.size
    for reading in range(len(m.readings)):
        if m.readings[reading].body == phase.body:
            for contact in range(len(m.contacts)):
                at = shift + reading * len(m.contacts) + contact
                m.left_out[reading, contact], m.other_state[at] = m.other_state[at], m.left_out[reading, contact]
    if body.derive != 0:
        parameters = m.parameters[body.parameter_start : body.parameter_end]
        call(body.derive, parameters, m.state[body.state_start : body.state_end])
    phase.closed = 1 - phase.closed
    m.clock[0].lost_unresolved += max(0.0, before - energy_of(m, phase.body))


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
