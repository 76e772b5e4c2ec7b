"""Response columns of a scheme, derived from its free step in compiled code.

They are used in set-up and in the loop.

A scheme is linear in the load, and the load stands in its parameters. So a step from rest under a load is the column
of that force, and a step that begins with a jump of the velocities is the column of an impulse.
"""

from __future__ import annotations

from impactlab.numerics.addresses import call
from impactlab.numerics.compiling import ENTRY, PART
from impactlab.numerics.windows import window
from impactlab.types import Array


@PART
def exchange(values: Array, start: int, others: Array) -> None:
    """Exchange the values from an index on with others."""
    for i in range(others.size):
        values[start + i], others[i] = others[i], values[start + i]


@ENTRY
def apply_to_each(kernel: int, parameters: Array, states: Array) -> None:
    """Apply the kernel at an address to each of some states, (n_states, n_state), in place."""
    for i in range(states.shape[0]):
        call(kernel, parameters, states[i])


@ENTRY
def write_columns(
    free: int,
    derive: int,
    parameters: Array,
    load_at: int,
    n: int,
    loads: Array,
    jump: Array,
    force: Array,
    impulse: Array,
) -> None:
    """Write the columns of unit forces and unit impulses, flat, port by port.

    An empty ``force`` is not written. ``loads`` holds the entries at the load in the parameters: for each port, then
    for none; ``jump`` the velocities per impulse; ``n`` is the number of displacements.
    """
    n_ports = jump.size // n
    size, length = impulse.size // n_ports, loads.size // (n_ports + 1)
    for port in range(force.size // size):
        load, column = window(loads, port * length, length), window(force, port * size, size)
        for i in range(size):
            column[i] = 0.0
        exchange(parameters, load_at, load)
        call(free, parameters, column)
        exchange(parameters, load_at, load)
    nothing = window(loads, n_ports * length, length)
    exchange(parameters, load_at, nothing)
    for port in range(n_ports):
        column = window(impulse, port * size, size)
        for i in range(size):
            column[i] = 0.0
        for i in range(n):
            column[n + i] = jump[port * n + i]
        if derive != 0:
            call(derive, parameters, column)
        call(free, parameters, column)
    exchange(parameters, load_at, nothing)
