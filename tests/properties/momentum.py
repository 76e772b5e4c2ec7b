"""The balance of momentum of each scheme, written out again from its own equation, coordinate by coordinate.

Nothing of the steppers' own code is used: an error there shows as a residual here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

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
from impactlab.models.base import AbstractDiscreteModel, Operators
from impactlab.numerics.banded import multiply, solve, widened
from impactlab.testing.trace import Trace
from impactlab.types import Array


class StepOfBody(NamedTuple):
    """One step of one body: coordinates and velocities before and after, what the scheme keeps, force and kick."""

    dt: float  # s
    old_u: Array  # (n_dof,)
    old_v: Array  # (n_dof,)
    new_u: Array  # (n_dof,)
    new_v: Array  # (n_dof,)
    push: Array  # (n_dof,) generalised force of all contacts, along their gaps and other rows, N
    kick: Array  # (n_dof,) generalised impulse of all contacts, N s
    kept: Array  # what the scheme keeps at the start beside displacements and velocities


class Balance(NamedTuple):
    """Return the residual of one step's momentum balance and the size of its terms, each (n_dof,) [N s]."""

    left_over: Array
    size: Array

    @property
    def residual(self) -> float:
        """Largest residual of a coordinate over the largest size in the body."""
        largest = float(np.max(self.size, initial=0.0))
        return float(np.max(np.abs(self.left_over)) / largest) if largest > 0.0 else 0.0


def added(*terms: tuple[float, Array | None, Array]) -> Balance:
    """Return the balance of terms (factor, banded matrix or None, vector); sizes are those of the single products."""
    left_over, size = np.zeros_like(terms[0][2]), np.zeros_like(terms[0][2])
    for factor, matrix, vector in terms:
        left_over += factor * (vector if matrix is None else multiply(matrix, vector))
        size += abs(factor) * (np.abs(vector) if matrix is None else multiply(np.abs(matrix), np.abs(vector)))
    return Balance(left_over, size)


Equation = Callable[[AbstractIntegrator, Operators, StepOfBody], Balance]


def weighted_balance(integrator: AbstractIntegrator, system: Operators, step: StepOfBody) -> Balance:
    """Return the balance of a scheme that weights the forces at both ends of the step, damping after the kick.

    Newmark by gamma; a leapfrog with springs at the start and dashpots in the middle; a theta method by theta.
    """
    springs = dashpots = 0.5  # weight of the end of the step
    if isinstance(integrator, Newmark):
        springs = dashpots = integrator.gamma
    elif isinstance(integrator, CentralDifference):
        springs = 0.0
    elif isinstance(integrator, MoreauJean):
        springs = dashpots = integrator.theta
    dt, damped = step.dt, np.any(system.damping) and np.any(step.kick)
    jump = solve(system.mass, step.kick) if damped else np.zeros_like(step.kick)
    return added(
        (1.0, system.mass, step.new_v),
        (-1.0, system.mass, step.old_v),
        (-1.0, None, step.kick),
        (-dt, None, step.push),
        (-dt, None, system.load),
        (dt * (1.0 - springs), system.stiffness, step.old_u),
        (dt * springs, system.stiffness, step.new_u),
        (dt * (1.0 - dashpots), system.damping, step.old_v + jump),
        (dt * dashpots, system.damping, step.new_v),
    )


def modal_balance(integrator: AbstractIntegrator, system: Operators, step: StepOfBody) -> Balance:
    """Return the balance of exact modal steps: the spring's impulse is that of the exact motion."""
    assert isinstance(integrator, ExactModal)
    mass, stiffness = system.mass[0], system.stiffness[0]
    turn = np.sqrt(stiffness / mass) * step.dt
    # K times the integral of u: of u0, of the velocity after the kick, of the constant force.
    of_velocity = 2.0 * np.sin(0.5 * turn) ** 2
    of_force = np.where(
        turn > 1e-2, 1.0 - np.sin(turn) / np.where(turn > 0.0, turn, 1.0), turn**2 / 6.0 - turn**4 / 120.0
    )
    of_displacement = step.dt * stiffness * np.sinc(turn / np.pi)
    force = system.load + step.push
    return added(
        (1.0, None, mass * step.new_v),
        (-1.0, None, mass * step.old_v),
        (-1.0, None, step.kick),
        (-step.dt, None, force),
        (1.0, None, of_displacement * step.old_u),
        (1.0, None, of_velocity * (mass * step.old_v + step.kick)),
        (step.dt, None, of_force * force),
    )


def alpha_balance(integrator: AbstractIntegrator, system: Operators, step: StepOfBody) -> Balance:
    """Return the balance of a generalised-alpha method, from its accelerations at the start of the step."""
    if isinstance(integrator, HhtAlpha):
        af, am = -integrator.alpha, 0.0
    else:
        assert isinstance(integrator, GeneralisedAlpha | NonsmoothGeneralisedAlpha)
        af, am = (
            integrator.rho_inf / (1.0 + integrator.rho_inf),
            (2.0 * integrator.rho_inf - 1.0) / (1.0 + integrator.rho_inf),
        )
    gamma, n_dof = 0.5 + af - am, step.push.size
    a = step.kept[:n_dof]
    w = step.kept[n_dof : 2 * n_dof] if af != 0.0 or am != 0.0 else a
    change = solve(system.mass, -multiply(system.damping, solve(system.mass, step.kick)))
    new = step.dt * gamma / (1.0 - am)  # of (1 - af) w_new + af w - am a
    given = new * (1.0 - af) if isinstance(integrator, GeneralisedAlpha) else step.dt
    return added(
        (1.0, system.mass, step.new_v),
        (-1.0, system.mass, step.old_v),
        (-1.0, None, step.kick),
        (-given, None, step.push),
        (-step.dt * (1.0 - gamma) + new * am, system.mass, a + change),
        (-new * af, system.mass, w + change),
        (-new * (1.0 - af), None, system.load),
        (new * (1.0 - af), system.damping, step.new_v),
        (new * (1.0 - af), system.stiffness, step.new_u),
    )


def bathe_balance(integrator: AbstractIntegrator, system: Operators, step: StepOfBody) -> Balance:
    """Return the balance of the composite scheme over its second part, the first solved again."""
    assert isinstance(integrator, Bathe)
    part = integrator.first_part
    width = max(matrix.shape[0] for matrix in (system.mass, system.damping, system.stiffness)) - 1
    half, begun = 0.5 * part * step.dt, step.old_v + solve(system.mass, step.kick)
    matrices = [widened(matrix, width) for matrix in (system.mass, system.damping, system.stiffness)]
    ahead = step.old_u + half * begun
    force = system.load + step.push - multiply(system.damping, begun) - multiply(system.stiffness, ahead)
    middle = begun + 2.0 * half * solve(matrices[0] + half * matrices[1] + half**2 * matrices[2], force)
    weight = (1.0 - part) / (2.0 - part) * step.dt
    back = (1.0 - part) ** 2 / (part * (2.0 - part))
    return added(
        (1.0, system.mass, step.new_v),
        (-1.0 - back, system.mass, middle),
        (back, system.mass, begun),
        (-weight, None, system.load + step.push),
        (weight, system.damping, step.new_v),
        (weight, system.stiffness, step.new_u),
    )


EQUATIONS: dict[type[AbstractIntegrator], Equation] = {
    Bathe: bathe_balance,
    CentralDifference: weighted_balance,
    ContactStabilisedNewmark: weighted_balance,
    ExactModal: modal_balance,
    GeneralisedAlpha: alpha_balance,
    HhtAlpha: alpha_balance,
    Midpoint: weighted_balance,
    MoreauJean: weighted_balance,
    Newmark: weighted_balance,
    NonsmoothGeneralisedAlpha: alpha_balance,
}


def generalised(traced: Trace, body: str, per_contact: Array) -> Array:
    """Return what contacts give to a body's coordinates over each step, shape (n_steps, n_dof).

    ``per_contact`` (n_steps, n_contacts) are forces [N] or impulses [N s]; a contact pushes its left body to the
    left and its right body to the right.
    """
    model = traced.plan.built[body].model
    total = np.zeros((len(per_contact), traced.plan.built[body].system.load.size))
    for number, contact in enumerate(traced.scene.contacts):
        for point, sign in ((contact.left, -1.0), (contact.right, 1.0)):
            if point.body == body:
                total += sign * np.outer(per_contact[:, number], model.row(point.x, "displacement"))
    return total


def pushed(traced: Trace, body: str) -> Array:
    """Return what laws that push along other rows give to a body's coordinates, shape (n_steps, n_dof) [N]."""
    built = traced.plan.built
    total = np.zeros((len(traced.pushes), built[body].system.load.size))
    for push in traced.plan.pushes:
        if push.body == body:
            row = push.weight * built[body].model.row(push.x, push.quantity)
            total += np.outer(traced.pushes[:, push.contact], row)
    return total


def worst_balance(traced: Trace) -> float:
    """Return the largest relative residual of momentum over all steps, bodies and coordinates.

    For whole steps only (``events: dated``): a located step is cut, and its pieces are not kept.
    """
    equation, worst = EQUATIONS[type(traced.integrator)], 0.0
    for name, built in traced.plan.built.items():
        u, v = traced.displacements(name), traced.velocities(name)
        push = generalised(traced, name, traced.forces) + pushed(traced, name)
        kick = generalised(traced, name, traced.impulses)
        # A projection moves the end of the step, after the scheme's own equation; where it moves the predictor instead,
        # the equation holds for what comes of it.
        moved = np.zeros_like(push)
        if not traced.integrator.projects_first:
            projected = generalised(traced, name, traced.projections)
            for at in np.flatnonzero(np.any(projected != 0.0, axis=1)):
                moved[at] = solve(built.system.mass, projected[at])
        kept = traced.kept(name)
        for k in range(len(push)):
            step = StepOfBody(traced.dt, u[k], v[k], u[k + 1] - moved[k], v[k + 1], push[k], kick[k], kept[k])
            worst = max(worst, equation(traced.integrator, built.system, step).residual)
    return worst


def field_truncation(model: AbstractDiscreteModel, face: float) -> float:
    """Return the share of an impulse at ``face`` [m] that modal coordinates do not take up as momentum of the field.

    For mass-normalised modes. Zero for a free body. A held one with few modes also moves near its clamp: this part
    of a kick is taken up by the clamp at once, and shrinks as modes are added.
    """
    return 1.0 - float(model.momentum_row() @ model.row(face, "displacement"))
