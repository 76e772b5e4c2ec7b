"""The step loop against a hand-written compiled loop of the same scheme with the same recorded output.

Paper's case, lumped bars, central difference, constraint addition-deletion, 3 T. The hand-written loop keeps, at every
step, what the package records (time, force, gap, displacement and velocity of both faces, those of the mass) and takes
the energies and momenta as often; per-element coefficients in both. Times are minima of interleaved runs, in time of
the processor, for others may use it too.

    python benchmarks/step_loop.py [--elements 400] [--repeats 40]
"""

from __future__ import annotations

import argparse
import math
import time
from typing import Any

import numba
import numpy as np

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.integrators.base import AbstractScheme
from impactlab.integrators.central_difference import CentralDifference
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.scene import Contact, End, Mass, Point, Rod, Scene, Segment, StepRule
from impactlab.simulate import Plan, prepare
from impactlab.stepping.assembly import SAMPLES, Assembly
from impactlab.stepping.loop import advance_dated, start


@numba.njit(fastmath={"reassoc", "contract"})  # type: ignore[untyped-decorator]
def by_hand(
    stiffness: Any,
    mass: Any,
    striker: float,
    u: Any,
    v: Any,
    out: Any,
    energies: Any,
    dt: float,
    steps: int,
    stride: int,
) -> None:
    """Leapfrog, clamped right end; the multiplier keeps the mass off the first node; one row of ``out`` per step."""
    n = u.size
    gain = dt / mass
    um, vm = 0.0, 1.0
    pliancy = dt * dt * (1.0 / striker + 1.0 / mass[0])
    sample = 0
    for step in range(steps):
        v[0] += gain[0] * -stiffness[0] * (u[0] - u[1])
        for i in range(1, n - 1):
            v[i] += gain[i] * (stiffness[i - 1] * (u[i - 1] - u[i]) - stiffness[i] * (u[i] - u[i + 1]))
        v[n - 1] += gain[n - 1] * (stiffness[n - 2] * (u[n - 2] - u[n - 1]) - stiffness[n - 1] * u[n - 1])
        for i in range(n):
            u[i] += dt * v[i]
        um += dt * vm
        force = max(0.0, (um - u[0]) / pliancy)
        um -= dt * dt * force / striker
        vm -= dt * force / striker
        u[0] += dt * dt * force / mass[0]
        v[0] += dt * force / mass[0]
        row = out[step]
        row[0], row[1], row[2] = (step + 1) * dt, force, u[0] - um
        row[3], row[4], row[5], row[6], row[7], row[8] = um, vm, u[0], v[0], um, vm
        if (step + 1) % stride == 0:
            energy, momentum = 0.0, 0.0
            for i in range(n):
                energy += mass[i] * v[i] * v[i]
                momentum += mass[i] * v[i]
            for i in range(n - 1):
                old, new = u[i] - dt * v[i] - u[i + 1] + dt * v[i + 1], u[i] - u[i + 1]
                energy += stiffness[i] * old * new
            energy += stiffness[n - 1] * u[n - 1] * (u[n - 1] - dt * v[n - 1])
            energies[sample, 0], energies[sample, 1] = 0.5 * energy, momentum
            energies[sample, 2], energies[sample, 3] = 0.5 * striker * vm * vm, striker * vm
            sample += 1


def scene_of(
    elements: int,
    law: AbstractContactLaw = AdditionDeletion(),  # noqa: B008 - frozen
    integrator: AbstractScheme = CentralDifference(),  # noqa: B008
    model: AbstractRodModel | None = None,
    courant: float = 1.0,
    round_trips: float = 3.0,
) -> Scene:
    """Return the paper's case, on a lumped mesh unless a model is given."""
    segment = Segment(0.3, 9e-4, 2.1e11, 7900.0)
    model = FiniteElement(elements, "lumped") if model is None else model
    rod = Rod("rod", (segment,), End("free"), End("clamped"), model=model)
    contact = Contact(Point("hammer", 0.0, "hammer"), Point("rod", 0.0, "rod.left"), 0.0, law)
    bodies = {"hammer": Mass("hammer", 2.133, 1.0), "rod": rod}
    return Scene("step_loop", bodies, (contact,), round_trips * rod.round_trip, integrator, StepRule(courant=courant))


def time_loop(plan: Plan) -> tuple[float, Assembly]:
    """Return what all steps of a plan take [s], and the memory they were written into."""
    assert plan.dt is not None
    assert plan.integrator is not None
    assembly = Assembly(plan.scene, plan.built, plan.steppers, plan.starts, plan.integrator, plan.dt, plan.steps)
    start(assembly.memory)
    # The kernel's page faults on fresh pages are no part of the time: touch them first, here and below.
    assembly.memory.record.fill(0.0)
    began = time.thread_time()
    advance_dated(assembly.memory, plan.dt, plan.steps, assembly.stride, assembly.sample_stride)
    spent = time.thread_time() - began
    return spent if assembly.clock.step == plan.steps else math.nan, assembly


def time_by_hand(plan: Plan) -> tuple[float, Any]:
    """Return what the same steps take in the hand-written loop [s], and what it recorded."""
    system, steps = plan.built["rod"].system, plan.steps
    mass, stiffness = system.mass[0], np.append(-system.stiffness[1, :-1], -system.stiffness[1, 0])
    u, v, out, energies = np.zeros(mass.size), np.zeros(mass.size), np.zeros((steps, 9)), np.zeros((SAMPLES + 1, 4))
    out.fill(0.0)
    began = time.thread_time()
    by_hand(stiffness, mass, 2.133, u, v, out, energies, plan.dt, steps, -(-steps // SAMPLES))
    return time.thread_time() - began, out


def measure(elements: int, repeats: int) -> dict[str, float]:
    """Return steps, the least times [s] of both loops, their ratio, and how far their forces differ."""
    plan = prepare(scene_of(elements))
    ours, theirs, difference = [], [], 0.0
    for _ in range(repeats + 1):
        spent, assembly = time_loop(plan)
        ours.append(spent)
        spent, out = time_by_hand(plan)
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


def main() -> None:
    """Print one row per mesh."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--elements", type=int, nargs="+", default=[100, 400, 1600])
    parser.add_argument("--repeats", type=int, default=40)
    arguments = parser.parse_args()
    print("elements   steps   loop us/step   by hand us/step   ratio   largest difference of force")
    for elements in arguments.elements:
        row = measure(elements, arguments.repeats)
        ours, theirs = (1e6 * row[name] / row["steps"] for name in ("loop_s", "by_hand_s"))
        costs = f"{ours:14.3f} {theirs:17.3f} {row['ratio']:7.2f}"
        print(f"{elements:8d} {row['steps']:7.0f} {costs} {row['difference']:12.1e}")


if __name__ == "__main__":
    main()
