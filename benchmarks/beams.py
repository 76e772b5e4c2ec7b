"""The step loop on beams against hand-written compiled loops.

Both have the same schemes and the same recorded output.

A hard mass on the tip of a cantilever, lumped beam elements, constraint addition-deletion, by central difference and by
Newmark's method. The hand-written loops walk over the same element coefficients, 12 EI/h^3/(1 + Phi) and EI/h each; at
every step they keep the records of the package, and take energies and momenta as often. Newmark's is factorised before
its first step, and so are its responses to a unit of force and of impulse. Times are minima of interleaved runs, in
time of the processor. A line through the meshes gives the cost of a step on any mesh, and the cost per element; a
second run of four times the steps shows whether the time is linear in them.

    python benchmarks/beams.py [--elements 100 400 1600] [--repeats 40] [--scheme newmark]
"""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numba
import numpy as np
from step_loop import compared, parser_of, report

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.newmark import Newmark
from impactlab.models.finite_element import FiniteElement
from impactlab.models.mesh.beam_elements import matrices
from impactlab.numerics.banded import multiply
from impactlab.scene import Beam, BeamSegment, Contact, End, Mass, Point
from impactlab.scene.method import StepRule
from impactlab.simulate import Plan, prepare
from impactlab.simulate.stepping.arrays import SAMPLES
from impactlab.testing.scenes import simulation

STRIKER = 0.05  # kg
STEEL = BeamSegment(0.3, 1e-4, 2.1e11, 7900.0, inertia=1e-8 / 12, shear_stiffness=6.7e6, rotary_inertia=7900.0e-8 / 12)
# Central difference close below its limit of pi points in the shortest period; Newmark's steps are four times
# that period: the shorter they are, the more touches there are, and the sooner rounding decides one of them.
SCHEMES: dict[str, tuple[AbstractIntegrator, float]] = {
    "central_difference": (CentralDifference(), 3.5),
    "newmark": (Newmark(), 0.25),
}
STEPS = 3000


class Coefficients(NamedTuple):
    """Data of a hand-written loop for a beam, clamped on its right."""

    shear: Any  # (n_elements,) 12 EI/h^3/(1 + Phi), N/m
    bending: Any  # (n_elements,) EI/h, N m
    half: float  # m, half an element
    mass: Any  # (2 n_elements,)


@numba.njit(fastmath={"reassoc", "contract"})  # type: ignore[untyped-decorator]
def take_off(shear: Any, bending: Any, half: float, u: Any, gain: Any, v: Any) -> None:
    """Subtract gain times the forces of all elements from ``v``.

    The last element ends in the clamp.
    """
    n = shear.size
    before, turn = 0.0, 0.0
    for e in range(n - 1):
        w, theta, next_w, next_theta = u[2 * e], u[2 * e + 1], u[2 * e + 2], u[2 * e + 3]
        force = shear[e] * (next_w - w - half * (theta + next_theta))
        moment = bending[e] * (next_theta - theta)
        v[2 * e] += gain[2 * e] * (force - before)
        v[2 * e + 1] += gain[2 * e + 1] * (half * (force + before) + moment - turn)
        before, turn = force, moment
    w, theta = u[2 * n - 2], u[2 * n - 1]
    force, moment = shear[n - 1] * (-w - half * theta), -bending[n - 1] * theta
    v[2 * n - 2] += gain[2 * n - 2] * (force - before)
    v[2 * n - 1] += gain[2 * n - 1] * (half * (force + before) + moment - turn)


@numba.njit(fastmath={"reassoc", "contract"})  # type: ignore[untyped-decorator]
def stored(shear: Any, bending: Any, half: float, u: Any, other: Any) -> float:
    """Return u K other over all elements."""
    n, energy = shear.size, 0.0
    for e in range(n - 1):
        a, b, c, d = u[2 * e], u[2 * e + 1], u[2 * e + 2], u[2 * e + 3]
        p, q, r, s = other[2 * e], other[2 * e + 1], other[2 * e + 2], other[2 * e + 3]
        energy += shear[e] * (c - a - half * (b + d)) * (r - p - half * (q + s)) + bending[e] * (d - b) * (s - q)
    a, b, p, q = u[2 * n - 2], u[2 * n - 1], other[2 * n - 2], other[2 * n - 1]
    return energy + shear[n - 1] * (a + half * b) * (p + half * q) + bending[n - 1] * b * q


@numba.njit(fastmath={"reassoc", "contract"})  # type: ignore[untyped-decorator]
def by_hand(
    shear: Any, bending: Any, half: float, mass: Any, striker: float, state: Any, out: Any, energies: Any,
    dt: float, stride: int,
) -> None:  # fmt: skip
    """Leapfrog; the multiplier keeps the mass off the tip; one row of ``out`` per step."""
    u, v, before = state[0], state[1], state[2]
    n = u.size
    gain = dt / mass
    um, vm = 0.0, 1.0
    compliance = dt * dt * (1.0 / striker + 1.0 / mass[0])
    sample = 0
    for step in range(out.shape[0]):
        take_off(shear, bending, half, u, gain, v)
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
                before[i] = u[i] - dt * v[i]
            for i in range(0, n, 2):
                momentum += mass[i] * v[i]
            energy += stored(shear, bending, half, u, before)
            energies[sample, 0], energies[sample, 1] = 0.5 * energy, momentum
            energies[sample, 2], energies[sample, 3] = 0.5 * striker * vm * vm, striker * vm
            sample += 1


@numba.njit(fastmath={"reassoc", "contract"})  # type: ignore[untyped-decorator]
def newmark_by_hand(  # noqa: C901 - all in one, as one writes it by hand
    shear: Any, bending: Any, half: float, mass: Any, striker: float, pivot: Any, lower: Any, responses: Any,
    state: Any, out: Any, energies: Any, dt: float, stride: int,
) -> None:  # fmt: skip
    """Newmark's method with average acceleration, factorised M + dt^2 K/4 = L D L^T.

    ``pivot`` holds 1/D, ``lower`` the three bands of L below its diagonal; the responses hold u, v, a after a step, per
    force over it and per impulse at its start, as far as they are not zero, shape (2, 3, reach). The multiplier closes
    the gap at the end of a step; an impulse on touch takes the approach away. One row of ``out`` per step.
    """
    u, v, a = state[0], state[1], state[2]
    n = u.size
    ones = np.ones(n)
    early, later = 0.25 * dt * dt, 0.5 * dt
    one, two, three = lower[0], lower[1], lower[2]
    um, vm, closed = 0.0, 1.0, False
    gap, rate = u[0] - um, v[0] - vm
    per_force = responses[0, 0, 0] + 0.5 * dt * dt / striker
    per_impulse = responses[1, 0, 0] + dt / striker
    sample = 0
    for step in range(out.shape[0]):
        for i in range(n):
            u[i] += dt * v[i] + early * a[i]
            v[i] += later * a[i]
            a[i] = 0.0
        take_off(shear, bending, half, u, ones, a)
        p, q, r = 0.0, 0.0, 0.0
        for i in range(3):
            found = a[i]
            if i > 0:
                found -= one[i - 1] * p
            if i > 1:
                found -= two[i - 2] * q
            a[i] = found
            p, q, r = found, p, q
        for i in range(3, n):
            found = a[i] - one[i - 1] * p - two[i - 2] * q - three[i - 3] * r
            a[i] = found
            p, q, r = found, p, q
        p, q, r = 0.0, 0.0, 0.0
        for i in range(n - 1, -1, -1):
            found = a[i] * pivot[i] - one[i] * p - two[i] * q - three[i] * r
            a[i] = found
            p, q, r = found, p, q
        for i in range(n):
            u[i] += early * a[i]
            v[i] += later * a[i]
        um += dt * vm
        force, impulse, free_gap = 0.0, 0.0, u[0] - um
        if not closed and gap <= 0.0 and rate < 0.0:
            closed = True
            impulse = -rate / (1.0 / striker + 1.0 / mass[0])
            free_gap += per_impulse * impulse
        if closed:
            force = max(0.0, -free_gap / per_force)
            closed = force > 0.0 or impulse > 0.0
            for i in range(responses.shape[2]):
                u[i] += force * responses[0, 0, i] + impulse * responses[1, 0, i]
                v[i] += force * responses[0, 1, i] + impulse * responses[1, 1, i]
                a[i] += force * responses[0, 2, i] + impulse * responses[1, 2, i]
            um -= (0.5 * dt * force + impulse) * dt / striker
            vm -= (dt * force + impulse) / striker
        gap, rate = u[0] - um, v[0] - vm
        row = out[step]
        row[0], row[1], row[2] = (step + 1) * dt, force, gap
        row[3], row[4], row[5], row[6], row[7], row[8] = um, vm, u[0], v[0], um, vm
        if (step + 1) % stride == 0:
            energy, momentum = stored(shear, bending, half, u, u), 0.0
            for i in range(n):
                energy += mass[i] * v[i] * v[i]
            for i in range(0, n, 2):
                momentum += mass[i] * v[i]
            energies[sample, 0], energies[sample, 1] = 0.5 * energy, momentum
            energies[sample, 2], energies[sample, 3] = 0.5 * striker * vm * vm, striker * vm
            sample += 1


def planned(elements: int, scheme: str, steps: int) -> Plan:
    """Return the case, prepared."""
    integrator, points = SCHEMES[scheme]
    beam = Beam("beam", (STEEL,), End("free"), End("clamped"), theory="timoshenko")
    contact = Contact(Point("hammer", 0.0, "hammer"), Point("beam", 0.0, "beam.left"), 0.0)
    bodies = {"hammer": Mass("hammer", STRIKER, 1.0), "beam": beam}
    model = FiniteElement(elements, "lumped")
    highest = model.build_beam(beam, 0.0).operators().highest_frequency
    dt = 2.0 * np.pi / highest / points
    scene = simulation(
        "beams",
        bodies,
        (contact,),
        steps * dt,
        integrator,
        StepRule(dt=dt),
        round_trip=beam.round_trip,
        model=model,
        law=AdditionDeletion(),
    )
    return prepare(*scene)


def time_by_hand(plan: Plan, elements: int) -> tuple[float, Any]:
    """Return the time of the same steps in the hand-written loop [s], and its records."""
    assert plan.dt is not None
    system, stepper = plan.built["beam"].system, plan.steppers["beam"]
    h = STEEL.length / elements
    known = matrices(STEEL, h).stiffness
    bending = STEEL.bending_stiffness / h
    body = np.full(elements, known[0, 0]), np.full(elements, bending), 0.5 * h, system.mass[0]
    n = system.load.size
    out, energies, state = np.zeros((plan.steps, 9)), np.zeros((SAMPLES + 1, 4)), np.zeros((3, n))
    out.fill(0.0)
    stride = -(-plan.steps // SAMPLES)
    if isinstance(plan.integrator, Newmark):
        loop: Any = newmark_by_hand
        given = (*factorised(plan), state)
    else:
        loop, given = by_hand, (state,)
        assert stepper.jump.size
    began = time.thread_time()
    loop(*body, STRIKER, *given, out, energies, plan.dt, stride)
    return time.thread_time() - began, out


def factorised(plan: Plan) -> tuple[Any, Any, Any]:
    """Return 1/D, the bands of L and the responses to force and impulse.

    The bands are (3, n), the responses of the stepper (2, 3, reach).
    """
    from scipy.linalg import cholesky_banded

    assert plan.dt is not None
    system, stepper = plan.built["beam"].system, plan.steppers["beam"]
    matrix = 0.25 * plan.dt**2 * system.stiffness
    matrix[0] += system.mass[0]
    root = cholesky_banded(matrix, lower=True)
    responses = np.zeros((2, 3, system.load.size))
    for response, each in zip(responses, (stepper.force_response, stepper.impulse_response), strict=True):
        response[:2] = each[0].reshape(2, -1)
        response[2] = -multiply(system.stiffness, response[0]) / system.mass[0]
    size = np.abs(responses) / np.abs(responses).max(axis=2, keepdims=True)
    reach = 1 + int(np.flatnonzero((size > 1e-20).any(axis=(0, 1)))[-1])
    return root[0] ** -2, np.ascontiguousarray(root[1:] / root[0]), np.ascontiguousarray(responses[:, :, :reach])


def measure(elements: int, repeats: int, scheme: str, steps: int = STEPS) -> dict[str, float]:
    """Return `compared` on a mesh."""
    plan = planned(elements, scheme, steps)
    return {"elements": elements} | compared(plan, repeats, lambda plan: time_by_hand(plan, elements))


def main() -> None:
    """Print one row per scheme and mesh."""
    given = parser_of(__doc__, SCHEMES).parse_args()
    for scheme in given.scheme:
        print(scheme)
        rows = [measure(elements, given.repeats, scheme) for elements in given.elements]
        report(rows)
        longer = measure(given.elements[0], max(2, given.repeats // 4), scheme, 4 * STEPS)
        print(f"four times the steps take {longer['loop_s'] / rows[0]['loop_s']:.2f} times the time\n")


if __name__ == "__main__":
    main()
