"""March of the modes and rigid coordinates of a run, under forces at its contacts.

In a step a force is constant, or rises along a line that is zero in its middle.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from impactlab.integrators.exact_modal import LOAD
from impactlab.numerics.compiling import PART
from impactlab.numerics.lanes import LANES, all_lanes, lanes_at, put_lanes, sum_of_lanes
from impactlab.simulate.stepping.arrays import StepArrays
from impactlab.types import Array, Ints

MAX_SERIES = 0.3  # rad, turn of a mode in a step up to which a series is exact to 1e-6
COSINE, SINE, TURN, LIFT, PUSH, LIFT_OF_RAMP, PUSH_OF_RAMP = range(7)  # rows of the constants of the coordinates


class Coordinates(NamedTuple):
    """All modes and rigid coordinates of a run, and its faces as sums.

    Their number n is rounded up to whole registers of `LANES`: coordinates that are filled in stay zero.
    """

    constants: Array  # (7 n,): cosine, sine, turn, displacement and velocity by a force, and by a force ramp, in a step
    rows: Array  # (2 n_contacts n,), left then right
    ranges: Ints  # (2 n_contacts, 2): coordinates of the body of a face, in whole registers


def room_for(n: int, contacts: int) -> tuple[Coordinates, Array]:
    """Return room for the coordinates of a run, and their displacements and velocities at rest, (2 n,)."""
    n = -(-n // LANES) * LANES
    ranges = np.zeros((2 * contacts, 2), dtype=np.int64)
    return Coordinates(np.zeros(7 * n), np.zeros(2 * contacts * n), ranges), np.zeros(2 * n)


@PART
def write_constants(mass: float, frequency: float, dt: float, constants: Array, number: int) -> None:
    """Write the constants of a mode's motion in a step, of the coordinate with a number.

    They are as in `ExactModal`, and under the force s (t - h/2), divided by s. A frequency below zero is minus the rate
    at which an unstable mode grows.
    """
    angle = frequency * dt
    square = angle * abs(angle)
    if angle > 0.0:
        half = math.sin(0.5 * angle)
        cosine, sine, lift = math.cos(angle), math.sin(angle) / frequency, 2.0 * (half / frequency) ** 2
    elif angle < 0.0:
        half = math.sinh(0.5 * angle)
        cosine, sine, lift = math.cosh(angle), math.sinh(angle) / frequency, 2.0 * (half / frequency) ** 2
    else:
        cosine, sine, lift = 1.0, dt, 0.5 * dt * dt
    if angle > MAX_SERIES:
        lift_of_ramp = dt**3 / square * (0.5 * (1.0 + cosine) - math.sin(angle) / angle)
    else:
        lift_of_ramp = dt**3 * (-1.0 / 12.0 + square * (1.0 / 80.0 - square / 2016.0))
    n = constants.size // 7
    constants[COSINE * n + number], constants[SINE * n + number] = cosine, sine
    constants[TURN * n + number] = frequency * abs(frequency) * sine
    constants[LIFT * n + number], constants[PUSH * n + number] = lift / mass, sine / mass
    constants[LIFT_OF_RAMP * n + number] = lift_of_ramp / mass
    constants[PUSH_OF_RAMP * n + number] = (lift - 0.5 * dt * sine) / mass


@PART
def write_coordinates(m: StepArrays, dt: float, at: Coordinates) -> None:
    """Write the coordinates of a run whose bodies are stepped by `ExactModal`."""
    n = at.constants.size // 7
    for number in range(len(m.bodies)):
        body = m.bodies[number]
        first, start = body.state_start // 2, body.parameter_start + LOAD
        for i in range(body.n_dof):
            mass, frequency = m.parameters[start + body.n_dof + i], m.parameters[start + 2 * body.n_dof + i]
            write_constants(mass, frequency, dt, at.constants, first + i)
    for face in range(len(m.faces)):
        if m.faces[face].moves != 0:
            body = m.bodies[m.faces[face].body]
            first = body.state_start // 2
            at.ranges[face, 0] = first // LANES * LANES
            at.ranges[face, 1] = -(-(first + body.n_dof) // LANES) * LANES
            for entry in range(m.row_start[face], m.row_start[face + 1]):
                at.rows[face * n + m.row_index[entry] - body.state_start + first] = m.row_value[entry]


@PART
def moved(at: Coordinates, face: int, state: Array) -> tuple[float, float]:
    """Return the displacement and the velocity of a face."""
    n = state.size // 2
    displacement, velocity = all_lanes(0.0), all_lanes(0.0)
    for i in range(at.ranges[face, 0], at.ranges[face, 1], LANES):
        row = lanes_at(at.rows, face * n + i)
        displacement = row * lanes_at(state, i) + displacement
        velocity = row * lanes_at(state, n + i) + velocity
    return sum_of_lanes(displacement), sum_of_lanes(velocity)


@PART
def push(at: Coordinates, contact: int, by_u: int, by_v: int, force: float, state: Array) -> None:
    """Add the response to a contact force by two rows of constants."""
    n = state.size // 2
    for face in range(2 * contact, 2 * contact + 2):
        signed = all_lanes(-force if face == 2 * contact else force)
        for i in range(at.ranges[face, 0], at.ranges[face, 1], LANES):
            pushed = signed * lanes_at(at.rows, face * n + i)
            put_lanes(state, i, pushed * lanes_at(at.constants, by_u * n + i) + lanes_at(state, i))
            put_lanes(state, n + i, pushed * lanes_at(at.constants, by_v * n + i) + lanes_at(state, n + i))


@PART
def swing(at: Coordinates, state: Array) -> None:
    """Move all coordinates by a step without forces."""
    n = state.size // 2
    for i in range(0, n, LANES):
        u, v, cosine = lanes_at(state, i), lanes_at(state, n + i), lanes_at(at.constants, COSINE * n + i)
        put_lanes(state, i, cosine * u + lanes_at(at.constants, SINE * n + i) * v)
        put_lanes(state, n + i, cosine * v - lanes_at(at.constants, TURN * n + i) * u)


@PART
def write_compliances(at: Coordinates, out: Array) -> None:
    """Write the overlaps that unit forces take away in a step, (contacts, contacts)."""
    n = at.constants.size // 7
    for one in range(len(out)):
        for other in range(len(out)):
            total = 0.0
            for i in range(n):
                total += (
                    (at.rows[2 * one * n + i] - at.rows[(2 * one + 1) * n + i])
                    * at.constants[LIFT * n + i]
                    * (at.rows[2 * other * n + i] - at.rows[(2 * other + 1) * n + i])
                )
            out[one, other] = total
