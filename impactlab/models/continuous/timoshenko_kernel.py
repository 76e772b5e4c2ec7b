"""Kernel of the Timoshenko beam by characteristics: exact shifts on two grids, shear and rotation coupled implicitly.

Parameters: numbers of cells n2 (shear) and n1 (bending), width of the coupling, bandwidth of the factor, dt, impedances
Z2 and Z1, the factors of the rotations B = b_old + b_new in V (dt kGA/2) and of V in them (dt h2/(rho I h1)), number of
coordinates, velocity that comes in from infinity; then four ends (left and right for the deflection, left and right for
the rotation) of five entries: 1 where the beam goes on, mean velocity per force, spring, 2 m/dt, load; then kind, cell
or node, and share of each coordinate; then of each shear cell the first bending cell it meets, the coupling
(n2, width), and the factor (n1, bandwidth + 1).

State: coordinates, their velocities; displacement and velocity of each of the four ends; energy and momentum gone to
infinity; waves to the right and to the left in each shear cell, the same in each bending cell; room for B.
"""

from __future__ import annotations

from impactlab.numerics.banded_kernels import solve_by_rows
from impactlab.numerics.compiling import HELPER
from impactlab.types import Array

ENDS = 10  # entries of the state: four ends, energy and momentum gone
DEFLECTION, ROTATION, MOMENT, SHEAR = 0, 1, 2, 3  # kinds of coordinates


@HELPER
def turn_both(parameters: Array, first: Array, coupling: Array, shear: Array, bend: Array, turn: Array) -> None:
    """Couple shear and rotation over a step: (1 + a P* P) B = 2 b + dt P* V/(rho I)."""
    width, z2 = int(parameters[2]), parameters[5]
    taken, given = 0.5 * parameters[7] / z2, parameters[8] * z2
    for j in range(turn.size):
        turn[j] = 2.0 * (bend[2 * j] + bend[2 * j + 1])
    for i in range(first.size):
        force = given * (shear[2 * i + 1] - shear[2 * i])
        begin = int(first[i])
        for k in range(width):
            turn[begin + k] += coupling[i * width + k] * force
    solve_by_rows(turn.size, int(parameters[3]), parameters[parameters.size - turn.size * width :], turn)
    for i in range(first.size):
        mean, begin = 0.0, int(first[i])
        for k in range(width):
            mean += coupling[i * width + k] * turn[begin + k]
        shear[2 * i] += taken * mean
        shear[2 * i + 1] -= taken * mean
    for j in range(turn.size):
        half = 0.5 * turn[j] - bend[2 * j] - bend[2 * j + 1]
        bend[2 * j] += half
        bend[2 * j + 1] += half


@HELPER
def shift(waves: Array, sent_right: float, sent_left: float) -> None:
    """Move all waves of a family by a cell; the waves that its ends send come in."""
    cells = waves.size // 2
    for i in range(cells - 1, 0, -1):
        waves[2 * i] = waves[2 * i - 2]
    for i in range(cells - 1):
        waves[2 * i + 1] = waves[2 * i + 3]
    waves[0], waves[2 * cells - 1] = sent_right, sent_left


@HELPER
def meet(state: Array, coordinates: Array, family: float, waves: Array) -> None:
    """Write the mean velocities over the step at inner places: sums of the waves that meet there."""
    n, cells = coordinates.size // 3, waves.size // 2
    for c in range(n):
        if coordinates[3 * c] != family:
            continue
        index, share, velocity = int(coordinates[3 * c + 1]), coordinates[3 * c + 2], 0.0
        if 0 < index < cells:
            velocity += (1.0 - share) * (waves[2 * index - 2] + waves[2 * index + 1])
        if share != 0.0 and index + 1 < cells:
            velocity += share * (waves[2 * index] + waves[2 * index + 3])
        state[n + c] = velocity


@HELPER
def reflect(parameters: Array, state: Array, coordinates: Array, end: int, arrived: float) -> float:
    """Return the wave that an end sends under an arriving one; ends 0 and 1 are those of the deflection.

    An end with mass m, spring k, dashpot d and force F moves with the mean velocity V of
    (Z + d + k dt/2 + 2 m/dt) V = 2 Z w - k u + (2 m/dt) v + F under an arriving wave w, and sends V - w.
    """
    n, at, family = coordinates.size // 3, 11 + 5 * end, end // 2
    dt, impedance = parameters[4], parameters[5 + family]
    if parameters[at] > 0.0:
        sent = parameters[10] if family == 0 else 0.0
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
def shear_at(parameters: Array, first: Array, coupling: Array, shear: Array, bend: Array, cell: int) -> float:
    """Return the shear force in a cell at the end of the step [N]: half of the step's coupling is added."""
    width, turned, begin = int(parameters[2]), 0.0, int(first[cell])
    for k in range(width):
        turned += coupling[cell * width + k] * (bend[2 * (begin + k)] + bend[2 * (begin + k) + 1])
    force: float = parameters[5] * (shear[2 * cell + 1] - shear[2 * cell]) - parameters[7] * turned
    return force


def free(parameters: Array, state: Array) -> None:
    """Step without contact: shear and rotation are coupled, then all waves move by a cell."""
    n2, n1, width, n = int(parameters[0]), int(parameters[1]), int(parameters[2]), int(parameters[9])
    coordinates = parameters[31 : 31 + 3 * n]
    first = parameters[31 + 3 * n : 31 + 3 * n + n2]
    coupling = parameters[31 + 3 * n + n2 : 31 + 3 * n + n2 * (width + 1)]
    at = 2 * n + 10
    shear, bend = state[at : at + 2 * n2], state[at + 2 * n2 : at + 2 * n2 + 2 * n1]
    turn = state[at + 2 * n2 + 2 * n1 : at + 2 * n2 + 3 * n1]
    turn_both(parameters, first, coupling, shear, bend, turn)
    meet(state, coordinates, 0.0, shear)
    meet(state, coordinates, 1.0, bend)
    left = reflect(parameters, state, coordinates, 0, shear[1])
    right = reflect(parameters, state, coordinates, 1, shear[2 * n2 - 2])
    shift(shear, left, right)
    left = reflect(parameters, state, coordinates, 2, bend[1])
    right = reflect(parameters, state, coordinates, 3, bend[2 * n1 - 2])
    shift(bend, left, right)
    for c in range(n):
        kind, index, share = coordinates[3 * c], int(coordinates[3 * c + 1]), coordinates[3 * c + 2]
        if kind < 2.0:
            state[c] += parameters[4] * state[n + c]
        elif kind == 2.0:
            low, high = bend[2 * index + 1] - bend[2 * index], bend[2 * index + 3] - bend[2 * index + 2]
            state[c] = parameters[6] * ((1.0 - share) * low + share * high)
        else:
            low = shear_at(parameters, first, coupling, shear, bend, index)
            high = shear_at(parameters, first, coupling, shear, bend, index + 1)
            state[c] = (1.0 - share) * low + share * high


def measure(parameters: Array, state: Array, out: Array) -> None:
    """Write the energy [J] of all waves and ends, those gone to infinity included, work of the loads, momentum."""
    n2, n1, n = int(parameters[0]), int(parameters[1]), int(parameters[9])
    dt, z2, z1 = parameters[4], parameters[5], parameters[6]
    at = 2 * n + 10
    shear, bend = state[at : at + 2 * n2], state[at + 2 * n2 : at + 2 * n2 + 2 * n1]
    sheared, moved, bent = 0.0, 0.0, 0.0
    for i in range(2 * n2):
        sheared += shear[i] * shear[i]
        moved += shear[i]
    for j in range(2 * n1):
        bent += bend[j] * bend[j]
    energy, work = dt * (z2 * sheared + z1 * bent) + state[2 * n + 8], 0.0
    momentum = dt * z2 * moved + state[2 * n + 9]
    for end in range(4):
        at = 11 + 5 * end
        u, v, inertia = state[2 * n + 2 * end], state[2 * n + 2 * end + 1], 0.5 * dt * parameters[at + 3]
        energy += 0.5 * (parameters[at + 2] * u * u + inertia * v * v)
        work += parameters[at + 4] * u
        momentum += inertia * v if end < 2 else 0.0
    out[0], out[1], out[2] = energy, work, momentum
