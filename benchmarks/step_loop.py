"""The step loop against hand-written compiled loops of the same schemes with the same recorded output.

Paper's case, lumped bars, constraint addition-deletion, 3 T, by central difference and by Newmark's method. The
hand-written loops keep, at every step, what the package records (time, force, gap, displacement and velocity of both
faces, those of the mass) and take the energies and momenta as often; per-element coefficients in both. Newmark's is
factorised before its first step, so are its answers to a unit of force and of impulse. Times are minima of interleaved
runs, in time of the processor, for others may use it too. A line through the meshes tells what a step costs on any
mesh, and what it costs per coordinate.

    python benchmarks/step_loop.py [--elements 400] [--repeats 40] [--scheme newmark]
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
from impactlab.integrators.base import AbstractIntegrator, AbstractScheme
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.scene import Contact, End, Mass, Point, Rod, Segment
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import Plan, prepare
from impactlab.simulate.stepping.assembly import SAMPLES, Assembly
from impactlab.simulate.stepping.loop import advance_dated, start
from impactlab.testing.scenes import simulation

SCHEMES = {"central_difference": CentralDifference(), "newmark": Newmark()}


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


@numba.njit(fastmath={"reassoc", "contract"})  # type: ignore[untyped-decorator]
def newmark_by_hand(
    stiffness: Any,
    mass: Any,
    striker: float,
    pivot: Any,
    lower: Any,
    force_answer: Any,
    impulse_answer: Any,
    state: Any,
    out: Any,
    energies: Any,
    dt: float,
    steps: int,
    stride: int,
) -> None:
    """Newmark's method with average acceleration, clamped right end, factorised M + dt^2 K/4 = L D L^T.

    ``pivot`` holds 1/D, ``lower`` the band of L; the answers hold u, v, a after a step, per force over it and per
    impulse at its start, as far as they are not zero, shape (3, reach). The multiplier closes the gap at the end of a
    step; an impulse on touch takes the approach away. One row of ``out`` per step.
    """
    u, v, a = state[0], state[1], state[2]
    n = u.size
    early, half = 0.25 * dt * dt, 0.5 * dt
    um, vm, closed = 0.0, 1.0, False
    gap, rate = u[0] - um, v[0] - vm
    per_force = force_answer[0, 0] + 0.5 * dt * dt / striker
    per_impulse = impulse_answer[0, 0] + dt / striker
    sample = 0
    for step in range(steps):
        for i in range(n):
            u[i] += dt * v[i] + early * a[i]
            v[i] += half * a[i]
        a[0] = -stiffness[0] * (u[0] - u[1])
        for i in range(1, n - 1):
            a[i] = stiffness[i - 1] * (u[i - 1] - u[i]) - stiffness[i] * (u[i] - u[i + 1])
        a[n - 1] = stiffness[n - 2] * (u[n - 2] - u[n - 1]) - stiffness[n - 1] * u[n - 1]
        found = a[0]
        for i in range(1, n):
            found = a[i] - lower[i - 1] * found
            a[i] = found
        found = 0.0
        for i in range(n - 1, -1, -1):
            found = a[i] * pivot[i] - lower[i] * found
            a[i] = found
        for i in range(n):
            u[i] += early * a[i]
            v[i] += half * a[i]
        um += dt * vm
        force, impulse, free_gap = 0.0, 0.0, u[0] - um
        if not closed and gap <= 0.0 and rate < 0.0:
            closed = True
            impulse = -rate / (1.0 / striker + 1.0 / mass[0])
            free_gap += per_impulse * impulse
        if closed:
            force = max(0.0, -free_gap / per_force)
            closed = force > 0.0 or impulse > 0.0
            for i in range(force_answer.shape[1]):
                u[i] += force * force_answer[0, i] + impulse * impulse_answer[0, i]
                v[i] += force * force_answer[1, i] + impulse * impulse_answer[1, i]
                a[i] += force * force_answer[2, i] + impulse * impulse_answer[2, i]
            um -= (0.5 * dt * force + impulse) * dt / striker
            vm -= (dt * force + impulse) / striker
        gap, rate = u[0] - um, v[0] - vm
        row = out[step]
        row[0], row[1], row[2] = (step + 1) * dt, force, gap
        row[3], row[4], row[5], row[6], row[7], row[8] = um, vm, u[0], v[0], um, vm
        if (step + 1) % stride == 0:
            energy, momentum = 0.0, 0.0
            for i in range(n):
                energy += mass[i] * v[i] * v[i]
                momentum += mass[i] * v[i]
            for i in range(n - 1):
                energy += stiffness[i] * (u[i] - u[i + 1]) * (u[i] - u[i + 1])
            energy += stiffness[n - 1] * u[n - 1] * u[n - 1]
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
) -> Simulation:
    """Return the paper's case, on a lumped mesh unless a model is given."""
    segment = Segment(0.3, 9e-4, 2.1e11, 7900.0)
    model = FiniteElement(elements, "lumped") if model is None else model
    rod = Rod("rod", (segment,), End("free"), End("clamped"))
    contact = Contact(Point("hammer", 0.0, "hammer"), Point("rod", 0.0, "rod.left"), 0.0)
    bodies = {"hammer": Mass("hammer", 2.133, 1.0), "rod": rod}
    return simulation(
        "step_loop",
        bodies,
        (contact,),
        round_trips * rod.round_trip,
        integrator,
        StepRule(courant=courant),
        model=model,
        law=law,
    )


def time_loop(plan: Plan) -> tuple[float, Assembly]:
    """Return what all steps of a plan take [s], and the memory they were written into."""
    assert plan.dt is not None
    assert plan.integrator is not None
    assembly = Assembly(plan, plan.integrator, plan.dt)
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
    out, energies = np.zeros((steps, 9)), np.zeros((SAMPLES + 1, 4))
    out.fill(0.0)
    stride = -(-steps // SAMPLES)
    if isinstance(plan.integrator, Newmark):
        loop, given = newmark_by_hand, (*factorised(plan), np.zeros((3, mass.size)))
    else:
        loop, given = by_hand, (np.zeros(mass.size), np.zeros(mass.size))
    began = time.thread_time()
    loop(stiffness, mass, 2.133, *given, out, energies, plan.dt, steps, stride)
    return time.thread_time() - began, out


def factorised(plan: Plan) -> tuple[Any, Any, Any, Any]:
    """Return 1/D and L of Newmark's matrix L D L^T, and the stepper's answers to force and impulse, (3, reach) each."""
    assert plan.dt is not None
    system, stepper = plan.built["rod"].system, plan.steppers["rod"]
    diagonal = system.mass[0] + 0.25 * plan.dt**2 * system.stiffness[0]
    band = 0.25 * plan.dt**2 * system.stiffness[1]
    pivot, lower = np.zeros_like(diagonal), np.zeros_like(diagonal)
    for i in range(diagonal.size):
        pivot[i] = 1.0 / (diagonal[i] - (lower[i - 1] * band[i - 1] if i > 0 else 0.0))
        lower[i] = band[i] * pivot[i]
    answers = [each[0].reshape(3, -1) for each in (stepper.force_response, stepper.impulse_response)]
    reach = 1 + max(int(np.flatnonzero(np.abs(row) > 1e-20 * np.abs(row).max())[-1]) for a in answers for row in a)
    return pivot, lower, *(np.ascontiguousarray(answer[:, :reach]) for answer in answers)


def measure(elements: int, repeats: int, integrator: AbstractIntegrator = CentralDifference()) -> dict[str, float]:  # noqa: B008
    """Return steps, the least times [s] of both loops, their ratio, and how far their forces differ."""
    plan = prepare(*scene_of(elements, integrator=integrator))
    ours, theirs, difference = [], [], 0.0
    for _ in range(repeats + 1):
        spent, assembly = time_loop(plan)
        ours.append(spent)
        spent, out = time_by_hand(plan)
        theirs.append(spent)
        kept = assembly.memory.record[1 : plan.steps + 1, 1]
        difference = float(np.abs(kept - out[:, 1]).max() / np.abs(out[:, 1]).max())
    return {
        "elements": elements,
        "steps": plan.steps,
        "loop_s": min(ours[1:]),
        "by_hand_s": min(theirs[1:]),
        "ratio": min(ours[1:]) / min(theirs[1:]),
        "difference": difference,
    }


def line(rows: list[dict[str, float]], name: str) -> tuple[float, float]:
    """Return what a step costs on any mesh [us], and what it costs per element [ns], from the two smallest meshes."""
    (first, low), (second, high) = [(row["elements"], 1e6 * row[name] / row["steps"]) for row in rows[:2]]
    slope = (high - low) / (second - first)
    return low - slope * first, 1e3 * slope


def main() -> None:
    """Print one row per mesh."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--elements", type=int, nargs="+", default=[100, 400, 1600])
    parser.add_argument("--repeats", type=int, default=40)
    parser.add_argument("--scheme", choices=SCHEMES, default="central_difference")
    arguments = parser.parse_args()
    print("elements   steps   loop us/step   by hand us/step   ratio   largest difference of force")
    rows = []
    for elements in arguments.elements:
        row = measure(elements, arguments.repeats, SCHEMES[arguments.scheme])
        rows.append(row)
        ours, theirs = (1e6 * row[name] / row["steps"] for name in ("loop_s", "by_hand_s"))
        costs = f"{ours:14.3f} {theirs:17.3f} {row['ratio']:7.2f}"
        print(f"{elements:8d} {row['steps']:7.0f} {costs} {row['difference']:12.1e}")
    if len(rows) > 1:
        for name in ("loop_s", "by_hand_s"):
            fixed, slope = line(rows, name)
            print(f"{name}: {fixed:.3f} us per step on any mesh, {slope:.3f} ns per element and step")


if __name__ == "__main__":
    main()
