"""March of the modes and rigid coordinates of a run, under forces at its contacts.

In a step a force is constant, or rises along a line that is zero in its middle.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from impactlab.integrators.exact_modal import LOAD
from impactlab.numerics.compiling import PART
from impactlab.simulate.stepping.arrays import StepArrays
from impactlab.types import Array, Ints

MAX_SERIES = 0.3  # rad, turn of a mode in a step up to which a series is exact to 1e-6
COSINE, SINE, TURN, LIFT, PUSH, LIFT_OF_RAMP, PUSH_OF_RAMP = range(7)  # rows of the constants of the coordinates


class Coordinates(NamedTuple):
    """All modes and rigid coordinates of a run, and its faces as sums."""

    constants: Array  # (7, n): cosine, sine, turn, displacement and velocity by a force, and by a force ramp, in a step
    rows: Array  # (2 n_contacts, n), left then right
    ranges: Ints  # (2 n_contacts, 2): coordinates of the body of a face


@PART
def write_constants(mass: float, frequency: float, dt: float, own: Array) -> None:
    """Write the constants of a mode's motion in a step.

    They are as in `ExactModal`, and under the force s (t - h/2), divided by s. A frequency below zero is minus the rate
    at which an unstable mode grows.
    """
    angle = frequency * dt
    square = angle * abs(angle)
    if angle > 0.0:
        half = math.sin(0.5 * angle)
        own[COSINE], own[SINE], own[LIFT] = math.cos(angle), math.sin(angle) / frequency, 2.0 * (half / frequency) ** 2
    elif angle < 0.0:
        half = math.sinh(0.5 * angle)
        own[COSINE], own[SINE], own[LIFT] = (
            math.cosh(angle),
            math.sinh(angle) / frequency,
            2.0 * (half / frequency) ** 2,
        )
    else:
        own[COSINE], own[SINE], own[LIFT] = 1.0, dt, 0.5 * dt * dt
    if angle > MAX_SERIES:
        own[LIFT_OF_RAMP] = dt**3 / square * (0.5 * (1.0 + own[COSINE]) - math.sin(angle) / angle)
    else:
        own[LIFT_OF_RAMP] = dt**3 * (-1.0 / 12.0 + square * (1.0 / 80.0 - square / 2016.0))
    own[TURN], own[PUSH] = frequency * abs(frequency) * own[SINE], own[SINE]
    own[PUSH_OF_RAMP] = own[LIFT] - 0.5 * dt * own[PUSH]
    for row in range(LIFT, PUSH_OF_RAMP + 1):
        own[row] /= mass


@PART
def write_coordinates(m: StepArrays, dt: float, at: Coordinates) -> None:
    """Write the coordinates of a run whose bodies are stepped by `ExactModal`."""
    for number in range(len(m.bodies)):
        body = m.bodies[number]
        n, first, start = body.n_dof, body.state_start // 2, body.parameter_start + LOAD
        for i in range(n):
            mass, frequency = m.parameters[start + n + i], m.parameters[start + 2 * n + i]
            write_constants(mass, frequency, dt, at.constants[:, first + i])
    for face in range(len(m.faces)):
        at.ranges[face, 0] = at.ranges[face, 1] = 0
        for i in range(at.rows.shape[1]):
            at.rows[face, i] = 0.0
        if m.faces[face].moves != 0:
            body = m.bodies[m.faces[face].body]
            first = body.state_start // 2
            at.ranges[face, 0], at.ranges[face, 1] = first, first + body.n_dof
            for entry in range(m.row_start[face], m.row_start[face + 1]):
                at.rows[face, m.row_index[entry] - body.state_start + first] = m.row_value[entry]


@PART
def moved(at: Coordinates, face: int, u: Array) -> float:
    """Return the displacement of a face."""
    total = 0.0
    for i in range(at.ranges[face, 0], at.ranges[face, 1]):
        total += at.rows[face, i] * u[i]
    return total


@PART
def push(at: Coordinates, contact: int, by_u: int, by_v: int, force: float, state: Array) -> None:
    """Add the response to a contact force by two rows of constants."""
    for face in range(2 * contact, 2 * contact + 2):
        signed = -force if face == 2 * contact else force
        for i in range(at.ranges[face, 0], at.ranges[face, 1]):
            state[0, i] += signed * at.constants[by_u, i] * at.rows[face, i]
            state[1, i] += signed * at.constants[by_v, i] * at.rows[face, i]


@PART
def swing(at: Coordinates, state: Array) -> None:
    """Move all coordinates by a step without forces."""
    for i in range(state.shape[1]):
        u = state[0, i]
        state[0, i] = at.constants[COSINE, i] * u + at.constants[SINE, i] * state[1, i]
        state[1, i] = at.constants[COSINE, i] * state[1, i] - at.constants[TURN, i] * u


@PART
def write_compliances(at: Coordinates, out: Array) -> None:
    """Write the overlaps that unit forces take away in a step, (contacts, contacts)."""
    for one in range(len(out)):
        for other in range(len(out)):
            total = 0.0
            for i in range(at.rows.shape[1]):
                total += (
                    (at.rows[2 * one, i] - at.rows[2 * one + 1, i])
                    * at.constants[LIFT, i]
                    * (at.rows[2 * other, i] - at.rows[2 * other + 1, i])
                )
            out[one, other] = total
