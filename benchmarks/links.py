"""Steps of a blow on a pile against a hand-written compiled program.

The same scene is computed by both; the growth with links is shown.

Ram, cushion, helmet, cushion, a pile of lumped elements, a shaft of Smith's soil in pieces and a toe that never pulls,
by leapfrog at half of the largest step. The hand-written program keeps everything in its own arrays: one pass over the
nodes, soil forces in a loop, the same output as the package keeps in a record (force, gap and motion of both faces of
each contact). Beside it the pile as a delay line with steps of the same length. Times are minima of interleaved runs,
in time of the processor.

    python benchmarks/links.py [--elements 160] [--pieces 15 50 100 200] [--repeats 7]
"""

from __future__ import annotations

import argparse
import math
import time
from typing import Any

import numpy as np
from numba import njit
from step_loop import time_loop

import impactlab as il
from impactlab.simulate import prepare

DURATION = 0.1  # s
RAM, HELMET, SPEED = 5000.0, 1000.0, 4.5  # kg, kg, m/s
LENGTH, AREA, YOUNG, DENSITY = 20.0, 0.16, 40e9, 2500.0
CUSHIONS = ((1e9, 0.8), (6e8, 0.5))  # N/m, restitution
SHAFT = (600e3, 2.5e-3, 0.2)  # N, m, s/m
TOE = (900e3, 3e-3, 0.5)
FIRST = 5.0  # m, from the head to the soil


def pile(elements: int, pieces: int) -> il.Case:
    """Return the blow."""

    def soil(numbers: tuple[float, float, float], **others: Any) -> dict[str, Any]:
        return {"kind": "smith", "capacity": numbers[0], "quake": numbers[1], "damping": numbers[2], **others}

    cushions = [{"kind": "bilinear", "stiffness": k, "restitution": e} for k, e in CUSHIONS]
    return il.Case(
        bodies={
            "ram": il.Mass(RAM, velocity=SPEED),
            "helmet": il.Mass(HELMET),
            "pile": il.Rod(length=LENGTH, area=AREA, material={"young": YOUNG, "density": DENSITY}),
            "ground": il.Wall(),
            "base": il.Wall(),
        },
        contacts=[
            il.Contact("ram", "helmet", cushions[0]),
            il.Contact("helmet", "pile.left", cushions[1]),
            il.Contact(f"pile.along({FIRST}, {LENGTH})", "ground", soil(SHAFT), pieces=pieces, name="shaft"),
            il.Contact("pile.right", "base", soil(TOE, tension=False), name="toe"),
        ],
        solve={
            "duration": DURATION,
            "model": {"kind": "finite_element", "elements": elements, "mass": "lumped"},
            "integrator": {"kind": "central_difference"},
            "step": {"courant": 0.5},
        },
    )


@njit(cache=True, fastmath={"reassoc", "contract"})  # type: ignore[untyped-decorator] # numba has no types
def by_hand(
    elements: int, pieces: int, steps: int, dt: float, numbers: np.ndarray, at: np.ndarray, record: np.ndarray
) -> float:
    """March the blow; return the set of the toe [m]."""
    stiffness, node_mass = numbers[0], numbers[1]
    n = elements + 1
    u, v = np.zeros(n), np.zeros(n)
    force = np.zeros(n)
    slid, deepest = np.zeros(pieces + 1), np.zeros(2)
    ram_u, ram_v, helmet_u, helmet_v = 0.0, numbers[2], 0.0, 0.0
    for step in range(steps):
        for i in range(n):
            force[i] = 0.0
        for i in range(elements):
            pull = stiffness * (u[i + 1] - u[i])
            force[i] += pull
            force[i + 1] -= pull
        pushes = np.empty(2)
        for number in range(2):
            overlap = ram_u - helmet_u if number == 0 else helmet_u - u[0]
            k, unloading = numbers[3 + 2 * number], numbers[4 + 2 * number]
            deepest[number] = max(deepest[number], overlap)
            pushes[number] = max(0.0, k * deepest[number] - unloading * (deepest[number] - overlap))
            record[step, 6 * number] = pushes[number]
            record[step, 6 * number + 1] = -overlap
        ram_v -= pushes[0] / numbers[7] * dt
        helmet_v += (pushes[0] - pushes[1]) / numbers[8] * dt
        force[0] += pushes[1]
        for piece in range(pieces + 1):
            toe = piece == pieces
            first = 12 if toe else 9
            node = at[piece]
            capacity, spring, damping = numbers[first], numbers[first + 1], numbers[first + 2]
            static = spring * (u[node] - slid[piece])
            if static > capacity:
                slid[piece] += (static - capacity) / spring
                static = capacity
            elif toe and static < 0.0:
                static = 0.0
            elif static < -capacity:
                slid[piece] += (static + capacity) / spring
                static = -capacity
            mass = node_mass if node < elements else 0.5 * node_mass
            dash = damping * abs(static)
            rate = v[node] + 0.5 * dt / mass * force[node]
            total = (static + dash * rate) / (1.0 + 0.5 * dt / mass * dash)
            if toe:
                total = max(0.0, total)
            force[node] -= total
            column = 6 * (piece + 2)
            record[step, column] = total
            record[step, column + 1] = -u[node]
            record[step, column + 2] = u[node]
            record[step, column + 3] = v[node]
        for i in range(n):
            mass = node_mass if 0 < i < elements else 0.5 * node_mass
            v[i] += force[i] / mass * dt
            u[i] += v[i] * dt
        ram_u += ram_v * dt
        helmet_u += helmet_v * dt
        for number in range(2):
            record[step, 6 * number + 2] = ram_u if number == 0 else helmet_u
            record[step, 6 * number + 3] = ram_v if number == 0 else helmet_v
            record[step, 6 * number + 4] = helmet_u if number == 0 else u[0]
            record[step, 6 * number + 5] = helmet_v if number == 0 else v[0]
    return slid[pieces]


def time_by_hand(elements: int, pieces: int, steps: int, dt: float) -> tuple[float, float]:
    """Return the time of all steps [s], and the set of the toe [m]."""
    h = LENGTH / elements
    soils = [share for values, count in ((SHAFT, pieces), (TOE, 1)) for share in scaled(values, count)]
    cushions = [value for k, e in CUSHIONS for value in (k, k / e**2)]
    numbers = np.array([YOUNG * AREA / h, DENSITY * AREA * h, SPEED, *cushions, RAM, HELMET, *soils])
    places = FIRST + (LENGTH - FIRST) * (np.arange(pieces) + 0.5) / pieces
    at = np.append(np.rint(places / h), elements).astype(np.int64)
    record = np.zeros((steps, 6 * (pieces + 3)))
    record.fill(0.0)
    began = time.thread_time()
    found = by_hand(elements, pieces, steps, dt, numbers, at, record)
    return time.thread_time() - began, found


def scaled(values: tuple[float, float, float], count: int) -> tuple[float, float, float]:
    """Return capacity [N], stiffness [N/m] and damping [s/m] of one of several pieces."""
    return values[0] / count, values[0] / count / values[1], values[2]


def waves(elements: int, pieces: int, dt: float) -> il.Case:
    """Return the blow on the pile as a delay line.

    Its steps are about ``dt`` [s].
    """
    case = pile(elements, pieces)
    return case.with_("solve", {"duration": DURATION, "model": {"kind": "continuous"}, "step": {"dt": dt}})


def main() -> None:
    """Print time per step of both programs and the delay line, with their ratio."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--elements", type=int, default=160)
    parser.add_argument("--pieces", type=int, nargs="+", default=[15, 50, 100, 200])
    parser.add_argument("--repeats", type=int, default=7)
    given = parser.parse_args()
    print("elements  pieces  package us  by hand us  ratio  per link ns  delay line us  per link ns  toe sets mm")
    for pieces in given.pieces:
        elements = max(given.elements, 4 * pieces)  # no two links on one node
        plan = prepare(*pile(elements, pieces).simulation())
        assert plan.dt is not None
        lines = prepare(*waves(elements, pieces, plan.dt).simulation())
        best, hand, line, sets = math.inf, math.inf, math.inf, (0.0, 0.0, 0.0)
        time_by_hand(elements, pieces, 10, plan.dt)
        for _ in range(given.repeats):
            spent, assembly = time_loop(plan)
            other, found = time_by_hand(elements, pieces, plan.steps, plan.dt)
            others, delays = time_loop(lines)
            best, hand, line = min(best, spent), min(hand, other), min(line, others)
            sets = (1e3 * assembly.ports[-1].memory[0], 1e3 * found, 1e3 * delays.ports[-1].memory[0])
        us, by, at = 1e6 * best / plan.steps, 1e6 * hand / plan.steps, 1e6 * line / lines.steps
        print(
            f"{elements:8d}  {pieces:6d}  {us:10.2f}  {by:10.2f}  {us / by:5.2f}  "
            f"{1e3 * us / (pieces + 3):11.0f}  {at:13.2f}  {1e3 * at / (pieces + 3):11.0f}  "
            f"{sets[0]:.5f} {sets[1]:.5f} {sets[2]:.5f}"
        )


if __name__ == "__main__":
    main()
