"""Kernel of the Timoshenko beam by characteristics.

Waves are shifted exactly on two grids; shear and rotation are coupled implicitly.

Parameters: the header below; then four ends (left and right for the deflection, left and right for the rotation) of
five entries: 1 where the beam goes on, mean velocity per force, spring, 2 m/dt, load; then kind, cell or node, and
share of each coordinate; then of each shear cell the first bending cell it meets and its row of the coupling, of each
bending cell the first shear cell and its row of the transpose, and the factors (`timoshenko_grids`). Rows are padded
with zeros to blocks of eight.

State: coordinates, their velocities; displacement and velocity of each of the four ends; energy and momentum gone to
infinity; waves to the right and to the left in each shear cell, the same in each bending cell; room for B and for the
shear forces, each with the zeros behind it that a padded row may meet.
"""

from __future__ import annotations

from impactlab.numerics.banded_kernels import solve_by_rows, solve_narrow
from impactlab.numerics.compiling import HELPER
from impactlab.numerics.lanes import LANES, lanes_at, put_lanes, sum_of_lanes
from impactlab.numerics.windows import window
from impactlab.types import Array

# Places in the header: numbers of cells (shear, bending), blocks of a row of the coupling and of its transpose, bands
# of the factors, dt, impedances Z2 and Z1, the factors of the rotations B = b_old + b_new in V (dt kGA/2) and of V in
# them (dt h2/(rho I h1)), number of coordinates, velocity that comes in from infinity.
CELLS, BENT, BLOCKS, BACK, BANDS, DT, Z2, Z1, TURNED, GIVEN, COORDINATES, INCOMING = range(12)
ENDS_AT = 12
COORDINATES_AT = ENDS_AT + 20
ENDS = 10  # entries of the state: four ends, energy and momentum gone
DEFLECTION, ROTATION, MOMENT, SHEAR = 0, 1, 2, 3  # kinds of coordinates
NARROW = 4  # bands of factors that are solved with in registers


@HELPER
def row_times(rows: Array, row: int, blocks: int, values: Array, begin: int) -> float:
    """Return a row of the coupling times the values from one on."""
    at, total = LANES * blocks * row, lanes_at(rows, LANES * blocks * row) * lanes_at(values, begin)
    for block in range(1, blocks):
        total = lanes_at(rows, at + LANES * block) * lanes_at(values, begin + LANES * block) + total
    return sum_of_lanes(total)


@HELPER
def couple_shear_and_rotation(parameters: Array, first: Array, back: Array, state: Array) -> None:
    """Couple shear and rotation over a step, implicitly.

    (1 + a P* P) B = 2 b + dt P* V/(rho I). ``first`` are the parameters from the coupling on, ``back`` those from its
    transpose on.
    """
    n2, n1 = int(parameters[CELLS]), int(parameters[BENT])
    blocks, back_blocks = int(parameters[BLOCKS]), int(parameters[BACK])
    at = 2 * int(parameters[COORDINATES]) + ENDS
    right, left = window(state, at, n2), window(state, at + n2, n2)
    turned_right, turned_left = window(state, at + 2 * n2, n1), window(state, at + 2 * n2 + n1, n1)
    room = at + 2 * (n2 + n1)
    turn = window(state, room, n1 + LANES * blocks)
    force = window(state, room + n1 + LANES * blocks, n2 + LANES * back_blocks)
    rows, back_rows = window(first, n2, LANES * blocks * n2), window(back, n1, LANES * back_blocks * n1)
    given, taken = parameters[GIVEN] * parameters[Z2], 0.5 * parameters[TURNED] / parameters[Z2]
    for i in range(n2):
        force[i] = given * (left[i] - right[i])
    for j in range(n1):
        pushed = row_times(back_rows, j, back_blocks, force, int(back[j]))
        turn[j] = 2.0 * (turned_right[j] + turned_left[j]) + pushed
    done = n1 + LANES * back_blocks * n1
    factors, bands = window(back, done, back.size - done), int(parameters[BANDS])
    if bands <= NARROW:
        below, above = window(factors, 0, NARROW * n1), window(factors, NARROW * n1, NARROW * n1)
        solve_narrow(n1, below, above, window(factors, 2 * NARROW * n1, n1), turn)
    else:
        solve_by_rows(n1, bands, factors, turn)
    for i in range(n2):
        change = taken * row_times(rows, i, blocks, turn, int(first[i]))
        right[i] += change
        left[i] -= change
    for j in range(n1):
        half = 0.5 * turn[j] - turned_right[j] - turned_left[j]
        turned_right[j] += half
        turned_left[j] += half


@HELPER
def shift(right: Array, left: Array, sent_right: float, sent_left: float) -> None:
    """Move all waves of a family by a cell, with those that its ends send."""
    at = right.size
    while at > LANES:
        put_lanes(right, at - LANES, lanes_at(right, at - LANES - 1))
        at -= LANES
    for i in range(at - 1, 0, -1):
        right[i] = right[i - 1]
    at = 0
    while at + LANES < left.size:
        put_lanes(left, at, lanes_at(left, at + 1))
        at += LANES
    for i in range(at, left.size - 1):
        left[i] = left[i + 1]
    right[0], left[left.size - 1] = sent_right, sent_left


@HELPER
def meet(state: Array, coordinates: Array, family: float, right: Array, left: Array) -> None:
    """Write mean velocities over the step at inner places, from waves that meet there."""
    n, cells = coordinates.size // 3, right.size
    for c in range(n):
        if coordinates[3 * c] != family:
            continue
        index, share, velocity = int(coordinates[3 * c + 1]), coordinates[3 * c + 2], 0.0
        if 0 < index < cells:
            velocity += (1.0 - share) * (right[index - 1] + left[index])
        if share != 0.0 and index + 1 < cells:
            velocity += share * (right[index] + left[index + 1])
        state[n + c] = velocity


@HELPER
def reflect(parameters: Array, state: Array, coordinates: Array, end: int, arrived: float) -> float:
    """Return the wave that an end sends under an arriving one.

    Ends 0 and 1 are those of the deflection. An end with mass m, spring k, dashpot d and force F moves with the mean
    velocity V of (Z + d + k dt/2 + 2 m/dt) V = 2 Z w - k u + (2 m/dt) v + F under an arriving wave w, and sends V - w.
    """
    n, at, family = coordinates.size // 3, ENDS_AT + 5 * end, end // 2
    dt, impedance = parameters[DT], parameters[Z2 + family]
    if parameters[at] > 0.0:
        sent = parameters[INCOMING] if family == 0 else 0.0
        state[2 * n + 8] += impedance * dt * (arrived * arrived - sent * sent)
        if family == 0:
            state[2 * n + 9] += impedance * dt * (arrived - sent)
        return sent
    u, v = state[2 * n + 2 * end], state[2 * n + 2 * end + 1]
    push = 2.0 * impedance * arrived + parameters[at + 4] - parameters[at + 2] * u
    mean = parameters[at + 1] * (push + parameters[at + 3] * v)
    state[2 * n + 2 * end] = u + dt * mean
    state[2 * n + 2 * end + 1] = 2.0 * mean - v
    node = 0 if end % 2 == 0 else int(parameters[family])
    for c in range(n):
        if coordinates[3 * c] == family:
            index, share = int(coordinates[3 * c + 1]), coordinates[3 * c + 2]
            if index == node:
                state[n + c] += (1.0 - share) * mean
            elif index + 1 == node:
                state[n + c] += share * mean
    reply: float = mean - arrived
    return reply


@HELPER
def shear_at(parameters: Array, first: Array, state: Array, cell: int) -> float:
    """Return the shear force in a cell at the end of the step [N].

    It includes half of the coupling over the step.
    """
    n2, n1, blocks = int(parameters[CELLS]), int(parameters[BENT]), int(parameters[BLOCKS])
    at, turned = 2 * int(parameters[COORDINATES]) + ENDS, 0.0
    right, left = window(state, at + 2 * n2, n1), window(state, at + 2 * n2 + n1, n1)
    begin, row = int(first[cell]), n2 + LANES * blocks * cell
    for k in range(min(LANES * blocks, n1 - begin)):
        turned += first[row + k] * (right[begin + k] + left[begin + k])
    force: float = parameters[Z2] * (state[at + n2 + cell] - state[at + cell]) - parameters[TURNED] * turned
    return force


def free(parameters: Array, state: Array) -> None:
    """Step without contact: shear and rotation are coupled, then all waves move by a cell."""
    n2, n1, n = int(parameters[CELLS]), int(parameters[BENT]), int(parameters[COORDINATES])
    blocks, coordinates = int(parameters[BLOCKS]), window(parameters, COORDINATES_AT, 3 * n)
    begins = COORDINATES_AT + 3 * n
    first = window(parameters, begins, parameters.size - begins)
    done = n2 + LANES * blocks * n2
    couple_shear_and_rotation(parameters, first, window(first, done, first.size - done), state)
    at = 2 * n + ENDS
    right, left = window(state, at, n2), window(state, at + n2, n2)
    turned_right, turned_left = window(state, at + 2 * n2, n1), window(state, at + 2 * n2 + n1, n1)
    meet(state, coordinates, 0.0, right, left)
    meet(state, coordinates, 1.0, turned_right, turned_left)
    from_left = reflect(parameters, state, coordinates, 0, left[0])
    from_right = reflect(parameters, state, coordinates, 1, right[n2 - 1])
    shift(right, left, from_left, from_right)
    from_left = reflect(parameters, state, coordinates, 2, turned_left[0])
    from_right = reflect(parameters, state, coordinates, 3, turned_right[n1 - 1])
    shift(turned_right, turned_left, from_left, from_right)
    for c in range(n):
        kind, index, share = coordinates[3 * c], int(coordinates[3 * c + 1]), coordinates[3 * c + 2]
        if kind < 2.0:
            state[c] += parameters[DT] * state[n + c]
        elif kind == 2.0:
            low, high = turned_left[index] - turned_right[index], turned_left[index + 1] - turned_right[index + 1]
            state[c] = parameters[Z1] * ((1.0 - share) * low + share * high)
        else:
            low, high = shear_at(parameters, first, state, index), shear_at(parameters, first, state, index + 1)
            state[c] = (1.0 - share) * low + share * high


def measure(parameters: Array, state: Array, out: Array) -> None:
    """Write energy [J], work of the loads [J] and momentum [N s].

    The energy is that of all waves and ends, and of waves gone to infinity.
    """
    n2, n1, n = int(parameters[CELLS]), int(parameters[BENT]), int(parameters[COORDINATES])
    dt, z2, z1 = parameters[DT], parameters[Z2], parameters[Z1]
    shear, bend = window(state, 2 * n + ENDS, 2 * n2), window(state, 2 * n + ENDS + 2 * n2, 2 * n1)
    sheared, moved, bent = 0.0, 0.0, 0.0
    for i in range(2 * n2):
        sheared += shear[i] * shear[i]
        moved += shear[i]
    for j in range(2 * n1):
        bent += bend[j] * bend[j]
    energy, work = dt * (z2 * sheared + z1 * bent) + state[2 * n + 8], 0.0
    momentum = dt * z2 * moved + state[2 * n + 9]
    for end in range(4):
        at = ENDS_AT + 5 * end
        u, v, inertia = state[2 * n + 2 * end], state[2 * n + 2 * end + 1], 0.5 * dt * parameters[at + 3]
        energy += 0.5 * (parameters[at + 2] * u * u + inertia * v * v)
        work += parameters[at + 4] * u
        momentum += inertia * v if end < 2 else 0.0
    out[0], out[1], out[2] = energy, work, momentum
