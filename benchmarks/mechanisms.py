"""The step of mechanisms against a hand-written compiled loop with the same terms and factor.

The two-link arm (a rigid and a flexible link, a stop along y at its tip, Hertz contact) by the midpoint rule, for some
numbers of bending shapes. The hand-written loop takes the terms at the middle of each step, factors M + dt^2 K/4 once,
solves for the free acceleration and for the response to the contact force, finds the mean force of the step by Newton's
method, and reads the tip again at the end. It keeps the records of the package and takes the energy as often. Times are
minima of interleaved runs, in time of the processor.

    python benchmarks/mechanisms.py [--modes 6 12 20 30] [--repeats 7]
"""

from __future__ import annotations

import argparse
import math
import time
from typing import Any

import numpy as np
from step_loop import time_loop

import impactlab as il
from impactlab.mechanisms.model import MechanismModel
from impactlab.mechanisms.steps import STIFFNESS_AT, Middle, factorise, solve
from impactlab.mechanisms.terms import chain_terms
from impactlab.numerics.compiling import ENTRY
from impactlab.simulate import Plan, prepare
from impactlab.simulate.stepping.arrays import SAMPLES

STIFFNESS, DT, DURATION = 1.0e9, 1.0e-6, 1.0e-2  # N/m^1.5, s, s
TURNS = 50  # of Newton's method, at most


def arm(modes: int) -> il.Case:
    """Return the two-link arm."""
    section, material = {"width": 0.02, "height": 0.01}, {"young": 7.0e10, "density": 2700.0}
    fore = {"kind": "beam", "length": 0.8, "section": section, "material": material}
    links = [
        {"body": "upper", "angle": math.pi / 3.0, "rate": 1.0},
        {"body": "fore", "rate": 1.0, "end_mass": 0.1, "axial_modes": 6},
    ]
    law = {"kind": "hertz", "stiffness": STIFFNESS}
    return il.Case.from_dict(
        {
            "schema_version": 1,
            "bodies": {
                "upper": {"kind": "link", "length": 0.5, "mass": 0.5}, "fore": fore, "stop": {"kind": "wall"}
            },
            "mechanisms": {"arm": {"links": links}},
            "contacts": [{"between": ["fore.right", "stop"], "along": "y", "law": law}],
            "solve": {
                "duration": DURATION,
                "model": {"kind": "modal", "elements": 160, "modes": modes},
                "integrator": {"kind": "midpoint"},
                "step": {"dt": DT},
            },
        }
    )  # fmt: skip


@ENTRY
def by_hand(
    own: Any, p: Any, v: Any, stiffness: Any, mass: Any, factor: Any, force: Any, rows: Any, values: Any, rates: Any,
    work: Any, empty: Any, out: Any, energies: Any, dt: float, steps: int, stride: int,
) -> None:  # fmt: skip
    """Midpoint rule of a mechanism on a stop, one row of ``out`` per step.

    The stop is where the first reading is at t = 0.
    """
    n, weight = p.size, 0.25 * dt * dt
    last, older, middle, rate, free, response = work[0], work[1], work[2], work[3], work[4], work[5]
    before, onwards = work[6], work[7]  # of the middle: on a line through the accelerations of two steps
    m = Middle(empty, stiffness, onwards, mass, force, rows, values, rates, factor, factor, free, response, before)
    chain_terms(own, 0.0, p, v, empty, force, rows, values, rates)
    stop, place, sample = values[0], values[0], 0
    for step in range(steps):
        for i in range(n):
            before[i] = last[i] + onwards[i] * (last[i] - older[i]) if step > 1 else last[i]
            middle[i] = p[i] + 0.5 * dt * v[i] + weight * before[i]
            rate[i] = v[i] + 0.5 * dt * before[i]
        chain_terms(own, (step + 0.5) * dt, middle, rate, mass, force, rows, values, rates)
        for i in range(n):
            pull = 0.0
            for j in range(n):
                pull += stiffness[i * n + j] * before[j]
            free[i], response[i] = force[i] + weight * pull, rows[i]
        factorise(m, factor, weight)
        solve(factor, free)
        solve(factor, response)
        moved, compliance = 0.0, 0.0
        for i in range(n):
            moved += rows[i] * (dt * v[i] + 0.5 * dt * dt * free[i])
            compliance += 0.5 * dt * dt * rows[i] * response[i]
        push, y, overlap = 0.0, moved, max(0.0, place - stop)
        energy = overlap**2.5
        for _ in range(TURNS):
            after = max(0.0, place + y - stop)
            if overlap + after == 0.0:
                break
            push = STIFFNESS * (after**2.5 - energy) / (2.5 * y)
            change = (y - moved + compliance * push) / (1.0 + compliance * (STIFFNESS * after**1.5 - push) / y)
            y -= change
            if abs(change) <= 1e-13 * abs(moved):
                break
        for i in range(n):
            older[i], last[i] = last[i], free[i] - push * response[i]
            p[i] += dt * v[i] + 0.5 * dt * dt * last[i]
            v[i] += dt * last[i]
        chain_terms(own, (step + 1) * dt, p, v, empty, force, rows, values, rates)
        place = values[0]
        row = out[step]
        row[0], row[1], row[2] = (step + 1) * dt, push, stop - place
        for i in range(rates.size):
            row[3 + 2 * i], row[4 + 2 * i] = values[i], rates[i]
        if (step + 1) % stride == 0:
            chain_terms(own, (step + 1) * dt, p, v, mass, force, rows, values, rates)
            total = 0.0
            for i in range(n):
                for j in range(n):
                    total += 0.5 * (v[i] * mass[i * n + j] * v[j] + p[i] * stiffness[i * n + j] * p[j])
            energies[sample] = total
            sample += 1


def time_by_hand(plan: Plan) -> tuple[float, Any]:
    """Return the time of the steps in the hand-written loop [s], and its records."""
    model = plan.built["arm"].model
    assert isinstance(model, MechanismModel)
    assert plan.dt is not None
    n, r, motion = model.count, model.readings, model.packed
    out, energies = np.zeros((plan.steps, 3 + 2 * r)), np.zeros(SAMPLES + 1)
    out.fill(0.0)
    square, values, rates, work = np.zeros(n * n), np.zeros(r + 1), np.zeros(r), np.zeros((8, n))
    work[0] = plan.steppers["arm"].state[2 * (n + r) : 2 * (n + r) + n]  # acceleration at t = 0
    numbers = plan.steppers["arm"].parameters
    quarter = plan.dt**2 * numbers[int(numbers[STIFFNESS_AT]) + n * n :][:n]
    work[7] = (1.0 - quarter) / (1.0 + quarter)
    given = (
        motion.parameters.copy(), motion.position.copy(), motion.velocity.copy(), motion.stiffness.ravel(), square,
        np.zeros(n * n), np.zeros(n), np.zeros(r * n), values, rates, work, np.zeros(0), out, energies,
    )  # fmt: skip
    began = time.thread_time()
    by_hand(*given, plan.dt, plan.steps, -(-plan.steps // SAMPLES))
    return time.thread_time() - began, out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--modes", type=int, nargs="+", default=[6, 12, 20, 30])
    parser.add_argument("--repeats", type=int, default=7)
    given = parser.parse_args()
    print("coordinates  package us/step  by hand us/step  ratio  largest difference of the force")
    for modes in given.modes:
        plan = prepare(*arm(modes).simulation())
        model = plan.built["arm"].model
        assert isinstance(model, MechanismModel)
        ours, hand, difference = [], [], math.nan
        for _ in range(given.repeats + 1):  # the first compiles
            spent, assembly = time_loop(plan)
            ours.append(spent)
            spent, out = time_by_hand(plan)
            hand.append(spent)
            total = float(assembly.contacts[0].total)
            difference = float(np.sum(out[:, 1]) * DT / total - 1.0)
        package, by = (1e6 * min(times[1:]) / plan.steps for times in (ours, hand))
        print(f"{model.count:11d}  {package:15.2f}  {by:15.2f}  {package / by:5.2f}  {difference:.1e}")


if __name__ == "__main__":
    main()
