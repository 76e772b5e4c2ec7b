"""Pieces of the step loop that few scenes need.

They are compiled where a scene needs them, and called by address.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import types

from impactlab.numerics.addresses import COMPILED, call, kernel_address, type_of
from impactlab.numerics.ahead import Kernel, ahead
from impactlab.numerics.compiling import plain
from impactlab.simulate.stepping import contact_solve, phases
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
    SAMPLE_ROWS,
    SHOW_ROWS,
    SOLVE_SEVERAL,
    STEP_ROWS,
    ClockRecord,
    StepArrays,
)
from impactlab.simulate.stepping.bead_records import record_beads, sample_beads, show_beads
from impactlab.simulate.stepping.beads import bead_arrays, march_beads, read_beads, step_beads
from impactlab.simulate.stepping.dashpots import book_dashpots, read_lengths
from impactlab.simulate.stepping.end_loads import apply_loads, book_loads, read_loads
from impactlab.simulate.stepping.influence import fill_influence, pushed_values, row_times_state
from impactlab.simulate.stepping.loop import add_responses

WHOLE, NUMBER = types.int64, types.float64


def read_readings(m: StepArrays) -> None:
    """Read the readings of laws at the start of a step."""
    first_reading = 2 * len(m.faces)
    for number in range(len(m.readings)):
        value = row_times_state(m, first_reading + number)
        for contact in range(len(m.contacts)):
            value += m.left_out[number, contact] * m.contacts[contact].force
        messenger = m.readings[number]
        m.ports[messenger.contact].readings[messenger.slot] = value


def read_pushed(m: StepArrays, free: int) -> None:
    """Read the rows that laws may push along.

    They are read at the start of a step (0) or at the end of the free one (1).
    """
    pushed_values(m, free != 0)


def rewrite_columns(m: StepArrays) -> None:
    """Rewrite the columns of bodies that change with their state, after their free steps."""
    for number in range(len(m.bodies)):
        body = m.bodies[number]
        if body.columns != 0:
            length = 3 * body.n_ports * (body.state_end - body.state_start)
            call(
                body.columns,
                m.parameters[body.parameter_start : body.parameter_end],
                m.state[body.state_start : body.state_end],
                m.jump[body.jump_start : body.jump_end],
                m.responses[body.response_start : body.response_start + length],
            )
    fill_influence(m)


def read_again(m: StepArrays) -> None:
    """Derive the readings of such bodies again at the end of a step.

    Their faces are read with them.
    """
    for number in range(len(m.bodies)):
        body = m.bodies[number]
        if body.columns != 0:
            parameters = m.parameters[body.parameter_start : body.parameter_end]
            call(body.derive, parameters, m.state[body.state_start : body.state_end])
    for number in range(len(m.faces)):
        if m.bodies[m.faces[number].body].columns != 0:
            m.faces[number].u = row_times_state(m, number)
            m.faces[number].v = row_times_state(m, len(m.faces) + number)


def push_rows(m: StepArrays) -> None:
    """Add the responses to the pushes of laws to the state of their bodies."""
    for number in range(len(m.pushes)):
        record = m.pushes[number]
        body = m.bodies[record.body]
        start = body.response_start + record.place * (body.state_end - body.state_start)
        push = record.weight * m.contacts[record.contact].push
        for part in range(3):
            add_responses(m, body.state_start, start, push, record.low[part], record.high[part])


def step_rows(m: StepArrays, dt: float) -> None:
    """Take the step of all rows of beads."""
    step_beads(bead_arrays(m), dt)


def march_rows(m: StepArrays, dt: float, steps: int) -> None:
    """Take steps of all rows of beads; in `scratch` how many were taken."""
    m.scratch[0] = march_beads(bead_arrays(m), dt, steps)


def read_rows(m: StepArrays) -> None:
    """Read the motion of beads that something else moves, too."""
    read_beads(bead_arrays(m))


def show_rows(m: StepArrays) -> None:
    """Write the motion of all beads into the state of the whole scene."""
    show_beads(bead_arrays(m))


def record_rows(m: StepArrays, first: int, steps: float) -> None:
    """Write the columns of rows of beads, from ``first`` on, to a record.

    Forces are means over ``steps``.
    """
    record_beads(bead_arrays(m), first, steps)


def sample_rows(m: StepArrays, dt: float) -> None:
    """Sample the energies of beads.

    `scratch` holds the energy stored between them [J], and whether all are finite.
    """
    stored, finite = sample_beads(bead_arrays(m), dt)
    m.scratch[0], m.scratch[1] = stored, 1.0 if finite else 0.0


KINDS: dict[int, tuple[Callable[..., None], tuple[Any, ...]]] = {
    SOLVE_SEVERAL: (plain(contact_solve.solve_several), (NUMBER, NUMBER)),
    CHANGE_PHASES: (plain(phases.change_phases), ()),
    REWRITE_COLUMNS: (rewrite_columns, ()),
    READ_AGAIN: (read_again, ()),
    STEP_ROWS: (step_rows, (NUMBER,)),
    MARCH_ROWS: (march_rows, (NUMBER, WHOLE)),
    READ_ROWS: (read_rows, ()),
    SHOW_ROWS: (show_rows, ()),
    RECORD_ROWS: (record_rows, (WHOLE, NUMBER)),
    SAMPLE_ROWS: (sample_rows, (NUMBER,)),
    READ_READINGS: (read_readings, ()),
    READ_PUSHED: (read_pushed, (WHOLE,)),
    PUSH_ROWS: (push_rows, ()),
    READ_LOADS: (plain(read_loads), ()),
    APPLY_LOADS: (plain(apply_loads), (NUMBER, NUMBER)),
    BOOK_LOADS: (plain(book_loads), (NUMBER,)),
    READ_LENGTHS: (plain(read_lengths), ()),
    BOOK_DASHPOTS: (plain(book_dashpots), (NUMBER,)),
}
"""Functions of the pieces, and the types of their arguments after the arrays."""
_addresses: dict[int, int] = {}  # of pieces that were needed


def kernel_of(piece: int, arrays: Any) -> Kernel:
    """Return the kernel of a piece, by the type of the arrays of the loop."""
    function, given = KINDS[piece]
    return Kernel(function, types.void(arrays, *given), allocates=False)


def address_of(piece: int, m: StepArrays) -> int:
    """Return the address of a piece, compiled when a scene first needs it."""
    if piece not in _addresses:
        kernel = kernel_of(piece, type_of(m)) if COMPILED else Kernel(KINDS[piece][0], None)
        _addresses[piece] = kernel_address(*kernel)
    return _addresses[piece]


def fill_pieces(m: StepArrays, clock: ClockRecord) -> None:
    """Write the addresses of all pieces that a scene needs.

    The flags of its clock must have been set.
    """
    of_rows = (STEP_ROWS, MARCH_ROWS, READ_ROWS, SHOW_ROWS, RECORD_ROWS, SAMPLE_ROWS)
    by_need = (
        ((SOLVE_SEVERAL,), len(m.contacts) > 1),
        ((CHANGE_PHASES,), len(m.phases) > 0),
        ((REWRITE_COLUMNS, READ_AGAIN), clock.changes != 0),
        (of_rows, len(m.bead_rows) > 0),
        ((READ_READINGS,), len(m.readings) > 0),
        ((READ_LOADS, APPLY_LOADS, BOOK_LOADS), len(m.loads) > 0),
        ((READ_LENGTHS, BOOK_DASHPOTS), len(m.dampers) > 0),
        ((READ_PUSHED, PUSH_ROWS), len(m.pushes) > 0),
    )
    needed = [piece for pieces, are_needed in by_need if are_needed for piece in pieces]
    with ahead(lambda: [kernel_of(piece, type_of(m)) for piece in needed]):
        for piece in needed:
            m.pieces[piece] = address_of(piece, m)
