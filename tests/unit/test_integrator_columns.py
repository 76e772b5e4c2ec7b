"""Each scheme's step and its columns against the scheme as its paper has it, in full matrices and one solve."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from impactlab.errors import PairingError
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.bathe import Bathe
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.contact_stabilised_newmark import ContactStabilisedNewmark
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.generalised_alpha import GeneralisedAlpha
from impactlab.integrators.hht_alpha import HhtAlpha
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.moreau_jean import MoreauJean
from impactlab.integrators.newmark import Newmark
from impactlab.integrators.nonsmooth_generalised_alpha import NonsmoothGeneralisedAlpha
from impactlab.models.base import Operators
from impactlab.numerics import addresses
from impactlab.numerics.banded import full, grounded
from impactlab.numerics.banded_kernels import pull
from impactlab.types import Array

N = 7
DT = 0.4


def banded(matrix: Array, width: int) -> Array:
    """The lower bands of a symmetric matrix."""
    return np.array([np.append(np.diagonal(matrix, -k), np.zeros(k)) for k in range(width + 1)])


def definite(random: np.random.Generator, width: int, floor: float) -> Array:
    """A positive definite band matrix: springs between all coordinates within the band, and to the ground."""
    matrix = np.diag(floor + random.random(N))
    for k in range(1, width + 1):
        for i in range(N - k):
            spring = random.random()
            matrix[i, i] += spring
            matrix[i + k, i + k] += spring
            matrix[i, i + k] -= spring
            matrix[i + k, i] -= spring
    return matrix


class Widths(NamedTuple):
    mass: int
    damping: int | None
    stiffness: int


def system_of(widths: Widths, random: np.random.Generator) -> Operators:
    mass, stiffness = definite(random, widths.mass, 2.0), definite(random, widths.stiffness, 0.0)
    damping = np.zeros((N, N)) if widths.damping is None else 0.3 * definite(random, widths.damping, 0.1)
    return Operators(
        mass=banded(mass, widths.mass),
        damping=banded(damping, widths.damping or 0),
        stiffness=banded(stiffness, widths.stiffness),
        load=random.normal(size=N),
        displacement=random.normal(size=N),
        velocity=random.normal(size=N),
        highest_frequency=float(np.sqrt(np.linalg.eigvalsh(np.linalg.solve(mass, stiffness)).max())),
        rule_frequency=1.0,
        diagonal_mass=widths.mass == 0,
        modes=False,
    )


class Step(NamedTuple):
    """State before a step, what pushes it, and the matrices."""

    u: Array
    v: Array  # after the kick
    a: Array  # what the scheme keeps, after the kick
    w: Array
    force: Array
    projection: Array
    mass: Array
    damping: Array
    stiffness: Array
    load: Array


Scheme = Callable[[Step], tuple[Array, ...]]


def together(*rows: tuple[dict[int, Array | float], Array]) -> list[Array]:
    """Solve block equations; each row holds matrices (or factors of unity) by unknown, and its right side."""
    size = len(rows)
    matrix, right = np.zeros((size * N, size * N)), np.concatenate([row[1] for row in rows])
    for i, (blocks, _) in enumerate(rows):
        for j, block in blocks.items():
            value = block * np.eye(N) if isinstance(block, float | int) else block
            matrix[i * N : (i + 1) * N, j * N : (j + 1) * N] = value
    return list(np.linalg.solve(matrix, right).reshape(size, N))


def projected(s: Step, u: Array, v: Array, *accelerations: Array) -> tuple[Array, ...]:
    moved = np.linalg.solve(s.mass, s.projection)
    change = -np.linalg.solve(s.mass, s.stiffness @ moved)
    return u + moved, v, *(a + change for a in accelerations)


def chung_hulbert(af: float, am: float, beta: float, gamma: float, in_accelerations: bool) -> Scheme:
    """ChungHulbert1993, Eqs. 4 to 6, in the accelerations of ArnoldBruels2007; F beside them or in them."""

    def step(s: Step) -> tuple[Array, ...]:
        beside = 0.0 if in_accelerations else 1.0
        quick = np.linalg.solve(s.mass, s.force) * beside
        u, v, a, w = together(
            ({0: 1.0, 2: -beta * DT**2}, s.u + DT * s.v + DT**2 * (0.5 - beta) * s.a + 0.5 * DT**2 * quick),
            ({1: 1.0, 2: -gamma * DT}, s.v + DT * (1.0 - gamma) * s.a + DT * quick),
            ({2: 1.0 - am, 3: af - 1.0}, af * s.w - am * s.a),
            ({0: s.stiffness, 1: s.damping, 3: s.mass}, s.load + (1.0 - beside) * s.force),
        )
        return projected(s, u, v, a, w)

    return step


def of_radius(rho: float, in_accelerations: bool) -> Scheme:
    af, am = rho / (rho + 1.0), (2.0 * rho - 1.0) / (rho + 1.0)
    return chung_hulbert(af, am, 0.25 * (1.0 - am + af) ** 2, 0.5 - am + af, in_accelerations)


def newmark(beta: float, gamma: float) -> Scheme:
    def step(s: Step) -> tuple[Array, ...]:
        return chung_hulbert(0.0, 0.0, beta, gamma, False)(s._replace(w=s.a))[:3]

    return step


def hilber(alpha: float) -> Scheme:
    """HilberHughesTaylor1977, Eq. 2 with damping and constant load; one acceleration."""
    beta, gamma = 0.25 * (1.0 - alpha) ** 2, 0.5 - alpha

    def step(s: Step) -> tuple[Array, ...]:
        quick = np.linalg.solve(s.mass, s.force)
        u, v, a = together(
            ({0: 1.0, 2: -beta * DT**2}, s.u + DT * s.v + DT**2 * (0.5 - beta) * s.a + 0.5 * DT**2 * quick),
            ({1: 1.0, 2: -gamma * DT}, s.v + DT * (1.0 - gamma) * s.a + DT * quick),
            (
                {0: (1.0 + alpha) * s.stiffness, 1: (1.0 + alpha) * s.damping, 2: s.mass},
                s.load + alpha * (s.damping @ s.v + s.stiffness @ s.u),
            ),
        )
        return projected(s, u, v, a)

    return step


def theta_method(theta: float) -> Scheme:
    """AcaryBrogliato2008, section 10.1: linear, the impulse of the step F dt."""

    def step(s: Step) -> tuple[Array, ...]:
        new, old = theta * DT, (1.0 - theta) * DT
        v, u = together(
            (
                {0: s.mass + new * s.damping, 1: new * s.stiffness},
                s.mass @ s.v + DT * (s.load + s.force) - old * (s.damping @ s.v + s.stiffness @ s.u),
            ),
            ({0: -new, 1: 1.0}, s.u + old * s.v),
        )
        return projected(s, u, v)

    return step


def stabilised(s: Step) -> tuple[Array, ...]:
    """DeuflhardKrauseErtel2008, Eqs. 12 to 14 with the prediction moved by a given amount; damping C (u_new - u)/DT."""
    prediction = s.u + DT * s.v + np.linalg.solve(s.mass, s.projection)
    half = 0.5 * DT
    u, v = together(
        (
            {0: s.mass + half**2 * s.stiffness + half * s.damping},
            s.mass @ prediction + 2.0 * half**2 * (s.load + s.force) - (half**2 * s.stiffness - half * s.damping) @ s.u,
        ),
        (
            {0: half * s.stiffness + s.damping, 1: s.mass},
            s.mass @ s.v + DT * (s.load + s.force) - (half * s.stiffness - s.damping) @ s.u,
        ),
    )
    return u, v


def composite(part: float) -> Scheme:
    """BatheBaig2005, Eqs. 3 to 12 (Bathe2007 for another first part), load and F constant over the step."""

    def step(s: Step) -> tuple[Array, ...]:
        push = s.load + s.force
        start = np.linalg.solve(s.mass, push - s.damping @ s.v - s.stiffness @ s.u)
        half = 0.5 * part * DT
        motion: dict[int, Array | float] = {0: s.stiffness, 1: s.damping, 2: s.mass}
        u1, v1, _ = together(
            ({0: 1.0, 1: -half}, s.u + half * s.v), ({1: 1.0, 2: -half}, s.v + half * start), (motion, push)
        )
        c1, c2, c3 = (1 - part) / (part * DT), -1.0 / ((1 - part) * part * DT), (2 - part) / ((1 - part) * DT)
        u, v, _ = together(
            ({0: c3, 1: -1.0}, -c1 * s.u - c2 * u1), ({1: c3, 2: -1.0}, -c1 * s.v - c2 * v1), (motion, push)
        )
        return projected(s, u, v)

    return step


def leapfrog(s: Step) -> tuple[Array, ...]:
    v = np.linalg.solve(
        s.mass + 0.5 * DT * s.damping,
        (s.mass - 0.5 * DT * s.damping) @ s.v + DT * (s.load + s.force - s.stiffness @ s.u),
    )
    return projected(s, s.u + DT * v, v)


SCHEMES: list[tuple[AbstractIntegrator, Scheme]] = [
    (Newmark(), newmark(0.25, 0.5)),
    (Newmark(0.3, 0.6), newmark(0.3, 0.6)),
    (HhtAlpha(-0.1), hilber(-0.1)),
    (HhtAlpha(-1.0 / 3.0), hilber(-1.0 / 3.0)),
    (HhtAlpha(0.0), newmark(0.25, 0.5)),
    (GeneralisedAlpha(0.0), of_radius(0.0, True)),
    (GeneralisedAlpha(0.7), of_radius(0.7, True)),
    (GeneralisedAlpha(1.0), of_radius(1.0, True)),
    (NonsmoothGeneralisedAlpha(0.5), of_radius(0.5, False)),
    (NonsmoothGeneralisedAlpha(0.9), of_radius(0.9, False)),
    (Midpoint(), theta_method(0.5)),
    (MoreauJean(), theta_method(0.5)),
    (MoreauJean(0.7), theta_method(0.7)),
    (MoreauJean(1.0), theta_method(1.0)),
    (ContactStabilisedNewmark(), stabilised),
    (Bathe(), composite(2.0 - np.sqrt(2.0))),
    (Bathe(0.5), composite(0.5)),
]


def check_steps(integrator: AbstractIntegrator, scheme: Scheme, widths: Widths) -> None:
    """Five steps with random forces, impulses and projections along two rows."""
    random = np.random.default_rng(7)
    system = system_of(widths, random)
    ports = random.normal(size=(2, N))
    stepper = integrator.prepare(system, ports, DT)
    mass, damping, stiffness = full(system.mass), full(system.damping), full(system.stiffness)
    state = stepper.state.copy()
    parts = [state[:N], state[N : 2 * N], state[2 * N : 3 * N], state[3 * N : 4 * N]]
    # The average acceleration is stepped without an array of accelerations: the reference keeps its own.
    derived = np.linalg.solve(mass, system.load - damping @ parts[1] - stiffness @ parts[0])
    parts = [part if part.size else derived for part in parts]
    for _ in range(5):
        force, impulse, projection = random.normal(size=(3, 2))
        jump = np.linalg.solve(mass, impulse @ ports)
        change = -np.linalg.solve(mass, damping @ jump)
        begun = parts[0], parts[1] + jump, parts[2] + change, parts[3] + change
        after = scheme(Step(*begun, force @ ports, projection @ ports, mass, damping, stiffness, system.load))
        stepper.free(stepper.parameters, state)
        state += force @ stepper.force_response + impulse @ stepper.impulse_response
        state += projection @ stepper.projection_response
        # A few solves of well-conditioned matrices of 28 rows.
        for number, part in enumerate(after[: state.size // N]):
            assert state[number * N : (number + 1) * N] == pytest.approx(part, rel=1e-12, abs=1e-12)
        parts = [*after, *parts[len(after) :]]


@pytest.mark.parametrize(("integrator", "scheme"), SCHEMES, ids=[str(scheme[0]) for scheme in SCHEMES])
@pytest.mark.parametrize("widths", [Widths(0, None, 0), Widths(1, 0, 1), Widths(0, 3, 3), Widths(2, 1, 4)], ids=str)
def test_steps_are_those_of_the_scheme_in_full_matrices(
    integrator: AbstractIntegrator, scheme: Scheme, widths: Widths
) -> None:
    check_steps(integrator, scheme, widths)


@pytest.mark.parametrize("widths", [Widths(0, None, 1), Widths(0, 0, 1), Widths(0, 0, 4)], ids=str)
def test_leapfrog_of_any_stiffness(widths: Widths) -> None:
    check_steps(CentralDifference(), leapfrog, widths)


def test_schemes_of_explicit_and_modal_steps_refuse_coupled_damping_by_name() -> None:
    system = system_of(Widths(0, 1, 1), np.random.default_rng(1))
    for integrator in (CentralDifference(), ExactModal()):
        with pytest.raises(PairingError) as refused:
            integrator.prepare(system, np.zeros((0, N)), DT)
        assert "newmark" in refused.value.remedy
        assert refused.value.path == "solve.integrator"


def test_forces_of_a_wide_chain_do_not_depend_on_its_travel() -> None:
    random = np.random.default_rng(3)
    stiffness = definite(random, 3, 0.0)
    stiffness -= np.diag(stiffness.sum(axis=1))  # nothing holds it
    bands = banded(stiffness, 3)
    assert not np.any(grounded(bands))
    near = np.round(random.normal(size=N) * 1024.0) / 1024.0
    forces = []
    for travel in (0.0, 2.0**30):  # both sums are exact
        force = np.zeros(N)
        pull(N, 3, np.concatenate((np.zeros(N), bands[1:].ravel())), near + travel, force)
        forces.append(force)
    assert np.array_equal(*forces)


@pytest.mark.parametrize("integrator", [scheme[0] for scheme in SCHEMES], ids=str)
def test_a_trial_in_plain_python_finds_the_columns_of_compiled_code(integrator: AbstractIntegrator) -> None:
    random = np.random.default_rng(5)
    system, ports = system_of(Widths(1, 0, 1), random), random.normal(size=(2, N))
    wanted = integrator.prepare(system, ports, DT)
    with addresses.trial():
        found = integrator.prepare(system, ports, DT)
    for field in ("state", "force_response", "impulse_response", "projection_response"):
        # Sums of seven terms and two solves, in another order where compiled code uses vector registers.
        np.testing.assert_allclose(getattr(found, field), getattr(wanted, field), rtol=1e-12, atol=1e-13)
