"""Newmark's method written by hand for this one impact and compiled: what a general implicit loop is measured against.

The tridiagonal matrix is factored once, from both ends to its middle row, so that two chains run side by side. The
contact sits on the first node alone, so a dot product with the first row of the inverse tells its force before the
system is solved: no second solution, no correction afterwards. The force acts as a midpoint load and a touch takes an
impulse, as in `impactlab.integrators.newmark` with `addition_deletion`; the same is recorded as in
`benchmarks/step_loop.py`.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numba
import numpy as np
from scipy.linalg import solveh_banded

from benchmarks.peers.cases import Array
from benchmarks.step_loop import scene_of, time_loop
from impactlab.integrators.newmark import Newmark
from impactlab.simulate import Plan, prepare
from impactlab.simulate.stepping.assembly import SAMPLES

QUARTER = 0.25  # beta of the average acceleration


@numba.njit(fastmath={"reassoc", "contract"})  # type: ignore[untyped-decorator]
def newmark_by_hand(  # noqa: C901 - one loop, on purpose
    spring: Any,
    mass: Any,
    factors: Any,
    striker: float,
    velocity: float,
    state: Any,
    out: Any,
    energies: Any,
    dt: float,
    steps: int,
    stride: int,
) -> None:
    """Average acceleration, clamped far end; the multiplier keeps the mass off the first node; one row per step.

    ``factors`` (3, n): inverse pivots, multipliers between i and i + 1, first row of the inverse; ``state`` (4, n):
    displacement, velocity, acceleration, right-hand side. At least four elements.
    """
    pivot, lower, inverse = factors[0], factors[1], factors[2]
    u, v, a, y = state[0], state[1], state[2], state[3]
    n, middle = u.size, u.size // 2
    um, vm = 0.0, velocity
    quarter, half = QUARTER * dt * dt, 0.5 * dt
    push = 0.5 * dt * dt / mass[0]  # of a unit force on the face, before its acceleration
    turn = spring[0] * push * (inverse[1] - inverse[0])  # of a unit force on the face's acceleration
    pliancy = push + quarter * turn + 0.5 * dt * dt / striker
    closed = False
    sample = 0
    for step in range(steps):
        touch = False
        if not closed and um >= u[0] and vm > v[0]:
            impulse = (vm - v[0]) / (1.0 / striker + 1.0 / mass[0])
            v[0] += impulse / mass[0]
            vm -= impulse / striker
            closed = touch = True
        for i in range(n):
            u[i] += dt * v[i] + quarter * a[i]
        y[0] = spring[0] * (u[1] - u[0])
        for i in range(1, n - 1):
            y[i] = spring[i - 1] * (u[i - 1] - u[i]) - spring[i] * (u[i] - u[i + 1])
        y[n - 1] = spring[n - 2] * (u[n - 2] - u[n - 1]) - spring[n - 1] * u[n - 1]
        um += dt * vm
        force = 0.0
        if closed:
            free = 0.0
            for i in range(n):
                free += inverse[i] * y[i]
            force = max(0.0, (um - u[0] - quarter * free) / pliancy)
            closed = touch or force > 0.0
            um -= 0.5 * dt * dt * force / striker
            vm -= dt * force / striker
            u[0] += push * force
            v[0] += dt * force / mass[0]
            y[0] -= spring[0] * push * force
            y[1] += spring[0] * push * force
        down, up = y[0], y[n - 1]
        for i in range(1, n - 1 - middle):
            down = y[i] - lower[i - 1] * down
            up = y[n - 1 - i] - lower[n - 1 - i] * up
            y[i], y[n - 1 - i] = down, up
        if 2 * middle == n:
            down = y[middle - 1] - lower[middle - 2] * down
            y[middle - 1] = down
        down = (y[middle] - lower[middle - 1] * down - lower[middle] * up) * pivot[middle]
        up = y[middle] = down
        for i in range(1, n - middle):
            above, below = middle - i, middle + i
            down = y[above] * pivot[above] - lower[above] * down
            up = y[below] * pivot[below] - lower[below - 1] * up
            y[above], y[below] = down, up
        if 2 * middle == n:
            y[0] = y[0] * pivot[0] - lower[0] * down
        # Apart from the substitution, which hands values on, this runs in vectors.
        for i in range(n):
            u[i] += quarter * y[i]
            v[i] += half * (a[i] + y[i])
            a[i] = y[i]
        row = out[step]
        row[0], row[1], row[2] = (step + 1) * dt, force, u[0] - um
        row[3], row[4], row[5], row[6], row[7], row[8] = um, vm, u[0], v[0], um, vm
        if (step + 1) % stride == 0:
            energy, momentum = 0.0, 0.0
            for i in range(n):
                energy += mass[i] * v[i] * v[i]
                momentum += mass[i] * v[i]
            for i in range(n - 1):
                energy += spring[i] * (u[i] - u[i + 1]) ** 2
            energy += spring[n - 1] * u[n - 1] ** 2
            energies[sample, 0], energies[sample, 1] = 0.5 * energy, momentum
            energies[sample, 2], energies[sample, 3] = 0.5 * striker * vm * vm, striker * vm
            sample += 1


def factor(mass: Array, spring: Array, dt: float) -> Array:
    """Return inverse pivots, multipliers and first row of the inverse of M + dt^2 K/4, shape (3, n)."""
    n, quarter = mass.size, QUARTER * dt * dt
    pivot = mass + quarter * spring
    pivot[1:] += quarter * spring[:-1]
    beside = -quarter * spring[:-1]  # between i and i + 1
    inverse = solveh_banded(np.array((np.append(0.0, beside), pivot)), np.eye(n)[0])
    lower, middle = np.zeros(n), n // 2
    for i in range(middle):
        pivot[i] = 1.0 / pivot[i]
        lower[i] = beside[i] * pivot[i]
        pivot[i + 1] -= lower[i] * beside[i]
    for i in range(n - 1, middle, -1):
        pivot[i] = 1.0 / pivot[i]
        lower[i - 1] = beside[i - 1] * pivot[i]
        pivot[i - 1] -= lower[i - 1] * beside[i - 1]
    pivot[middle] = 1.0 / pivot[middle]
    return np.array((pivot, lower, inverse))


def time_newmark_by_hand(plan: Plan) -> tuple[float, Any]:
    """Return what the steps of a plan take in the hand-written loop [s], and what it recorded."""
    system, steps = plan.built["rod"].system, plan.steps
    mass, spring = system.mass[0], np.append(-system.stiffness[1, :-1], -system.stiffness[1, 0])
    assert plan.dt is not None
    factors, state = factor(mass, spring, plan.dt), np.zeros((4, mass.size))
    out, energies = np.zeros((steps, 9)), np.zeros((SAMPLES + 1, 4))
    out.fill(0.0)
    stride = -(-steps // SAMPLES)
    began = time.thread_time()
    newmark_by_hand(spring, mass, factors, 2.133, 1.0, state, out, energies, plan.dt, steps, stride)
    return time.thread_time() - began, out


def measure(elements: int, repeats: int) -> dict[str, float]:
    """Return steps, times [s] of both loops, their ratio, and how far their forces differ, as `step_loop.measure`."""
    plan = prepare(*scene_of(elements, integrator=Newmark()))
    ours, theirs, difference = [], [], math.nan
    for _ in range(repeats + 1):
        spent, assembly = time_loop(plan)
        ours.append(spent)
        spent, out = time_newmark_by_hand(plan)
        theirs.append(spent)
        kept = assembly.memory.record[1 : plan.steps + 1, 1]
        difference = float(np.abs(kept - out[:, 1]).max() / np.abs(out[:, 1]).max())
    return {
        "steps": plan.steps,
        "loop_s": min(ours[1:]),
        "by_hand_s": min(theirs[1:]),
        "ratio": min(ours[1:]) / min(theirs[1:]),
        "difference": difference,
    }
