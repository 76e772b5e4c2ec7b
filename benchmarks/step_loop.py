"""The step loop against hand-written compiled loops.

Both have the same schemes and the same recorded output.

Paper's case, lumped bars, constraint addition-deletion, 3 T, by central difference and by Newmark's method. The
hand-written loops keep, at every step, the records of the package (time, force, gap, displacement and velocity of both
faces, those of the mass) and take the energies and momenta as often; per-element coefficients in both. Of leapfrog the
best loop that we could write stands beside it: displacement form, one pass, two arrays that change places, one factor
for all elements, no energies. Newmark's matrix
is factored once, from both ends to its middle row, so that two chains run side by side. Its contact is on the first
node alone, so a dot product with the first row of the inverse gives the force before the system is solved: no second
solution, no correction afterwards. Times are minima of interleaved runs, in time of the processor. A line through the
meshes gives the cost of a step on any mesh, and the cost per coordinate.

    python benchmarks/step_loop.py [--elements 400] [--repeats 40] [--scheme newmark]
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Iterable
from typing import Any

import numba
import numpy as np
from scipy.linalg import solveh_banded

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.integrators.base import AbstractIntegrator, AbstractScheme
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.numerics.addresses import entered_with_table
from impactlab.scene import Contact, End, Mass, Point, Rod, Segment
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import Plan, prepare
from impactlab.simulate.stepping.arrays import SAMPLES
from impactlab.simulate.stepping.loop import advance_dated, start
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.simulate.stepping.setup.layout import steps_per_sample
from impactlab.testing.scenes import simulation

STRIKER = 2.133  # kg
QUARTER = 0.25  # beta of the average acceleration
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
    """Leapfrog with a multiplier at the first node, one row of ``out`` per step.

    The right end is clamped; the multiplier keeps the mass off the node.
    """
    n = u.size
    gain = dt / mass
    um, vm = 0.0, 1.0
    compliance = dt * dt * (1.0 / striker + 1.0 / mass[0])
    sample = 0
    for step in range(steps):
        v[0] += gain[0] * -stiffness[0] * (u[0] - u[1])
        for i in range(1, n - 1):
            v[i] += gain[i] * (stiffness[i - 1] * (u[i - 1] - u[i]) - stiffness[i] * (u[i] - u[i + 1]))
        v[n - 1] += gain[n - 1] * (stiffness[n - 2] * (u[n - 2] - u[n - 1]) - stiffness[n - 1] * u[n - 1])
        for i in range(n):
            u[i] += dt * v[i]
        um += dt * vm
        force = max(0.0, (um - u[0]) / compliance)
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
def best_by_hand(
    factor: float,
    mass: float,
    spring: float,
    striker: float,
    velocity: float,
    now: Any,
    before: Any,
    out: Any,
    dt: float,
    steps: int,
) -> None:
    """Leapfrog of the same case in displacement form, in one pass.

    Two arrays change places, and all nodes share one factor. ``factor`` is dt^2 k/m of a whole node, ``mass`` that of
    the first one, half of it; no energies are taken. One row of ``out`` per step.
    """
    n = now.size
    per_force, per_striker, rate = dt * dt / mass, dt * dt / striker, 1.0 / dt
    compliance = 1.0 / (per_force + per_striker)
    first = dt * dt * spring / mass
    um, um_before = 0.0, -dt * velocity
    for step in range(steps):
        free = 2.0 * now[0] - before[0] + first * (now[1] - now[0])
        for i in range(1, n - 1):
            before[i] = 2.0 * now[i] - before[i] + factor * ((now[i - 1] - now[i]) + (now[i + 1] - now[i]))
        last = n - 1
        before[last] = 2.0 * now[last] - before[last] + factor * (now[last - 1] - 2.0 * now[last])
        ahead = 2.0 * um - um_before
        force = max(0.0, (ahead - free) * compliance)
        um_before, um = um, ahead - per_striker * force
        before[0] = free + per_force * force
        row = out[step]
        row[0], row[1], row[2], row[3] = (step + 1) * dt, force, before[0] - um, um
        row[4], row[5], row[6] = (um - um_before) * rate, before[0], (before[0] - now[0]) * rate
        now, before = before, now


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
    """Average acceleration with a multiplier at the first node, one row per step.

    The far end is clamped; the multiplier keeps the mass off the node. ``factors`` (3, n): inverse pivots, multipliers
    between i and i + 1, first row of the inverse; ``state`` (4, n): displacement, velocity, acceleration, right-hand
    side. At least four elements.
    """
    pivot, lower, inverse = factors[0], factors[1], factors[2]
    u, v, a, y = state[0], state[1], state[2], state[3]
    n, middle = u.size, u.size // 2
    um, vm = 0.0, velocity
    quarter, half = QUARTER * dt * dt, 0.5 * dt
    push = 0.5 * dt * dt / mass[0]  # of a unit force on the face, before its acceleration
    turn = spring[0] * push * (inverse[1] - inverse[0])  # of a unit force on the face's acceleration
    compliance = push + quarter * turn + 0.5 * dt * dt / striker
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
            force = max(0.0, (um - u[0] - quarter * free) / compliance)
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


def factor(mass: Any, spring: Any, dt: float) -> Any:
    """Return inverse pivots, multipliers and first inverse row of M + dt^2 K/4.

    Shape (3, n).
    """
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
    bodies = {"hammer": Mass("hammer", STRIKER, 1.0), "rod": rod}
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
    """Return the time of all steps of a plan [s], and their memory."""
    assert plan.dt is not None
    assert plan.integrator is not None
    assembly = Assembly(plan, plan.integrator, plan.dt)
    entered_with_table(start, assembly.memory, plan.dt)
    # The kernel's page faults on fresh pages are no part of the time: touch them first, here and below.
    assembly.memory.record.fill(0.0)
    began, before = time.thread_time(), -1
    while before < assembly.clock.step < plan.steps:  # it returns early where a contact that chatters fills the events
        before = assembly.clock.step
        given = assembly.memory, plan.dt, plan.steps, assembly.stride, assembly.sample_stride
        entered_with_table(advance_dated, *given)
        assembly.clock.n_events = 0
    spent = time.thread_time() - began
    return spent if assembly.clock.step == plan.steps else math.nan, assembly


def time_by_hand(plan: Plan) -> tuple[float, Any]:
    """Return the time of the same steps in the hand-written loop [s], and its records."""
    assert plan.dt is not None
    system, steps = plan.built["rod"].system, plan.steps
    mass, spring = system.mass[0], np.append(-system.stiffness[1, :-1], -system.stiffness[1, 0])
    out, energies = np.zeros((steps, 9)), np.zeros((SAMPLES + 1, 4))
    out.fill(0.0)
    stride = steps_per_sample(steps, 2)
    if isinstance(plan.integrator, Newmark):
        loop: Any = newmark_by_hand
        given = (spring, mass, factor(mass, spring, plan.dt), STRIKER, 1.0, np.zeros((4, mass.size)))
    else:
        loop, given = by_hand, (spring, mass, STRIKER, np.zeros(mass.size), np.zeros(mass.size))
    began = time.thread_time()
    loop(*given, out, energies, plan.dt, steps, stride)
    return time.thread_time() - began, out


def time_best(plan: Plan) -> tuple[float, Any]:
    """Return the time of the best loop known [s], and its records.

    Its steps are the same.
    """
    assert plan.dt is not None
    system = plan.built["rod"].system
    mass, spring, n = system.mass[0], -system.stiffness[1, 0], system.load.size
    out = np.zeros((plan.steps, 7))
    out.fill(0.0)
    factor = plan.dt**2 * spring / mass[1]
    given = factor, mass[0], spring, STRIKER, 1.0, np.zeros(n), np.zeros(n), out, plan.dt, plan.steps
    began = time.thread_time()
    best_by_hand(*given)
    return time.thread_time() - began, out


def compared(plan: Plan, repeats: int, hand: Callable[[Plan], tuple[float, Any]] = time_by_hand) -> dict[str, float]:
    """Return steps, least times [s] of both loops, ratio, and force difference."""
    ours, theirs, difference = [], [], math.nan
    for _ in range(repeats + 1):
        spent, assembly = time_loop(plan)
        ours.append(spent)
        spent, out = hand(plan)
        theirs.append(spent)
        kept = assembly.memory.record[1 : plan.steps + 1, 1]
        difference = float(np.abs(kept - out[:, 1]).max() / np.abs(out[:, 1]).max())
    least = {"loop_s": min(ours[1:]), "by_hand_s": min(theirs[1:])}
    return {"steps": plan.steps} | least | {"ratio": least["loop_s"] / least["by_hand_s"], "difference": difference}


def measure(elements: int, repeats: int, integrator: AbstractIntegrator = CentralDifference()) -> dict[str, float]:  # noqa: B008
    """Return `compared` of the paper's case on a mesh.

    Of leapfrog the time of the best loop is returned as well, ``best_s`` [s].
    """
    plan = prepare(*scene_of(elements, integrator=integrator))
    found = {"elements": elements} | compared(plan, repeats)
    if isinstance(integrator, CentralDifference):
        found["best_s"] = min(time_best(plan)[0] for _ in range(repeats + 1))
    return found


def line(rows: list[dict[str, float]], name: str) -> tuple[float, float]:
    """Return the costs of a step on any mesh [us] and per element [ns].

    They follow from the two smallest meshes.
    """
    (first, low), (second, high) = [(row["elements"], 1e6 * row[name] / row["steps"]) for row in rows[:2]]
    slope = (high - low) / (second - first)
    return low - slope * first, 1e3 * slope


def report(rows: list[dict[str, float]]) -> None:
    """Print one row per mesh, and the costs of steps and elements."""
    print("elements   steps   loop us/step   by hand us/step   ratio   largest difference of force   to the best loop")
    for row in rows:
        ours, theirs = (1e6 * row[name] / row["steps"] for name in ("loop_s", "by_hand_s"))
        costs = f"{ours:14.3f} {theirs:17.3f} {row['ratio']:7.2f}"
        best = f"{row['loop_s'] / row['best_s']:20.2f}" if "best_s" in row else ""
        print(f"{row['elements']:8d} {row['steps']:7.0f} {costs} {row['difference']:12.1e} {best}")
    if len(rows) > 1:
        for name in ("loop_s", "by_hand_s"):
            fixed, slope = line(rows, name)
            print(f"{name}: {fixed:.3f} us per step on any mesh, {slope:.3f} ns per element and step")


def parser_of(doc: str | None, schemes: Iterable[str]) -> argparse.ArgumentParser:
    """Return the options of a comparison with loops written by hand."""
    parser = argparse.ArgumentParser(description=(doc or "").splitlines()[0])
    parser.add_argument("--elements", type=int, nargs="+", default=[100, 400, 1600])
    parser.add_argument("--repeats", type=int, default=40)
    parser.add_argument("--scheme", choices=schemes, nargs="+", default=list(schemes))
    return parser


def main() -> None:
    """Print a table per scheme."""
    given = parser_of(__doc__, SCHEMES).parse_args()
    for name in given.scheme:
        print(name)
        report([measure(elements, given.repeats, SCHEMES[name]) for elements in given.elements])


if __name__ == "__main__":
    main()
