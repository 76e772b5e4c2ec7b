"""An independent answer for rods in a row, struck by a mass or by a rod: delay lines on a lattice of tiny steps.

Transits are whole numbers of steps, so a wave front is exact on the lattice; a touch inside a step is spread over it,
which is of first order in the step. Nothing is shared with the solver but the wave equation.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Answer(NamedTuple):
    """The results of a run at n + 1 instants, for rods 0 ... m - 1 from left to right and joints between neighbours."""

    left: Array  # (m, n + 1) m, displacement of the left face of every rod
    right: Array  # (m, n + 1) m
    impulse: Array  # (m, n + 1) N s, of joint i at the left of rod i; of the striking mass at joint 0
    striker: Array  # (n + 1,) m, displacement of the striking mass


@numba.njit(cache=True)
def _run(
    steps: int,
    every: int,
    dt: float,
    delays: NDArray[np.int64],
    z: Array,
    v0: Array,
    gaps: Array,
    mass: float,
    mass_v0: float,
    left: Array,
    right: Array,
    impulse: Array,
    striker: Array,
) -> None:
    m = len(z)
    longest = delays.max()
    out_left, out_right = np.zeros((m, longest)), np.zeros((m, longest))
    for i in range(m):
        out_left[i, :] = 0.5 * v0[i]
        out_right[i, :] = 0.5 * v0[i]
    gap = gaps.copy()
    vm = mass_v0
    face_l, face_r = np.zeros(m), np.zeros(m)
    force, push = np.zeros(m), np.zeros(m)
    u_left, u_right, way = np.zeros(m), np.zeros(m), 0.0
    decay = np.exp(-z[0] * dt / mass) if mass > 0.0 else 0.0
    mean = (1.0 - decay) * mass / (z[0] * dt) if mass > 0.0 else 0.0
    for s in range(steps):
        at = s % longest
        for i in range(m):
            here = (s - delays[i]) % longest
            face_l[i] = 2.0 * out_right[i, here]  # arrives at the left end
            face_r[i] = 2.0 * out_left[i, here]
            force[i] = 0.0
        moved = vm * dt
        for i in range(m):
            if i == 0 and mass <= 0.0:
                continue
            if i == 0:
                speed = vm
                yielding = 1.0 / z[0]
            else:
                speed = face_r[i - 1]
                yielding = 1.0 / z[i - 1] + 1.0 / z[i]
            rate = face_l[i] - speed
            share = 0.0  # of the step in contact
            if rate < 0.0 and gap[i] + rate * dt < 0.0:
                share = 1.0 if gap[i] <= 0.0 else 1.0 + gap[i] / (rate * dt)
            pressed = -rate / yielding
            if i == 0 and share > 0.0:
                whole = -rate * z[0] * mean  # mean force over a step of full contact
                pressed = whole
                vm -= share * whole * dt / mass
                if share == 1.0:
                    moved = (face_l[0] - rate * mean) * dt
                else:
                    moved -= 0.5 * share**2 * whole / mass * dt * dt
            force[i] = share * pressed
            if i == 0:
                gap[0] += face_l[0] * dt + force[0] / z[0] * dt - moved
            else:
                gap[i] += (rate + force[i] * yielding) * dt
            if share > 0.0:  # together to the end of the step
                gap[i] = 0.0
        for i in range(m):
            vl = face_l[i] + force[i] / z[i]
            vr = face_r[i] - (force[i + 1] / z[i] if i + 1 < m else 0.0)
            out_left[i, at] = vl - 0.5 * face_l[i]
            out_right[i, at] = vr - 0.5 * face_r[i]
            u_left[i] += vl * dt
            u_right[i] += vr * dt
            push[i] += force[i] * dt
        way += moved
        if (s + 1) % every == 0:
            k = (s + 1) // every
            left[:, k], right[:, k], impulse[:, k], striker[k] = u_left, u_right, push, way


def run(
    steps: int,
    dt: float,
    delays: list[int],
    impedances: list[float],
    velocities: list[float],
    gaps: list[float],
    mass: float = 0.0,
    mass_velocity: float = 0.0,
    every: int = 1,
) -> Answer:
    """Return the answer of rods in a row with free outer ends after every so many steps; gaps[i] is left of rod i.

    A mass strikes rod 0 over gaps[0], where it is more than 0; without it gaps[0] is not used.
    """
    m, n = len(delays), steps // every + 1
    answer = Answer(np.zeros((m, n)), np.zeros((m, n)), np.zeros((m, n)), np.zeros(n))
    _run(
        steps, every, dt, np.array(delays, np.int64), np.array(impedances), np.array(velocities), np.array(gaps), mass,
        mass_velocity, *answer,
    )  # fmt: skip
    return answer
