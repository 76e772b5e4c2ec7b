"""Stability limit of explicit steps with a closed contact under Nitsche's method, along two rows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from impactlab.contact.base import AbstractContactLaw
from impactlab.errors import CaseError
from impactlab.integrators.base import AbstractIntegrator
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.numerics.banded import multiply
from impactlab.printing import at_most
from impactlab.scene.problem import Scene
from impactlab.simulate.planning.preparation import BuiltBody, Push
from impactlab.types import Array, Start

MAX_DENSE = 300  # unknowns of both bodies: below, all frequencies are found at once
MAX_AMPLIFICATION = 2.75  # of a push by the highest mode (w dt 1.6): all pairs measured that diverge lie above 3.7
SAFE_SHARE = 0.85  # of the limit of an unsymmetric pair, which gains some energy up to there
FREQUENCY_TOL = 1e-6  # of the squared frequency, and of the limit


def check_closed(
    scene: Scene,
    laws: Sequence[AbstractContactLaw],
    built: dict[str, BuiltBody],
    starts: tuple[Start, ...],
    pushes: tuple[Push, ...],
    integrator: AbstractIntegrator,
    dt: float,
) -> None:
    """Raise `CaseError` for an explicit step beyond a closed contact's limit.

    It is the stability limit of the bodies that the contact joins.

    A law with F = S - gap/g and a push Q = theta gap along the row of S adds to the stiffness K of both bodies
    -d s' + d d'/g - theta s d', with the rows d of the gap and s of S. Leapfrog is stable up to w dt = 2, w^2 the
    largest root of M^-1 times that. Near w dt = 2 a push grows 1/(1 - (w dt/2)^2) times; with theta = 1 the matrix is
    symmetric and an energy bounds the motion, else the step stays where that factor is `MAX_AMPLIFICATION`.
    """
    if integrator.load_point > 0.0:
        return
    for number, (contact, law) in enumerate(zip(scene.contacts, laws, strict=True)):
        gains = law.closed_gains(starts[number])
        bodies = tuple(dict.fromkeys((contact.left.body, contact.right.body)))
        if gains is None or any(isinstance(built[name].model, AbstractSelfStepping) for name in bodies):
            continue
        own = [push for push in pushes if push.contact == number]
        highest = math.sqrt(max(0.0, _largest_root(scene, built, number, own, gains)))
        symmetric = gains[1] == 1.0
        reach = 2.0 if symmetric else 2.0 * math.sqrt(1.0 - 1.0 / MAX_AMPLIFICATION)
        share = 0.999 if symmetric else SAFE_SHARE
        if highest * dt > reach * (1.0 + FREQUENCY_TOL):
            raise CaseError(
                f"a step of {dt:.6g} s is beyond the stability limit {reach / highest:.6g} s of the bodies of "
                f"{contact.name} with the contact closed",
                remedy=f"Give dt: {at_most(share * reach / highest)} or less, or integrator newmark.",
                path="solve.step",
            )


def _largest_root(
    scene: Scene, built: dict[str, BuiltBody], number: int, pushes: list[Push], gains: tuple[float, float]
) -> float:
    """Return the largest squared frequency of two joined bodies [1/s2].

    It is the largest real part, with their contact closed.
    """
    contact = scene.contacts[number]
    names = list(dict.fromkeys((contact.left.body, contact.right.body)))
    systems = [built[name].system for name in names]
    ends = np.cumsum([system.load.size for system in systems])
    starts = (0, *ends[:-1].tolist())
    parts = {name: slice(start, int(end)) for name, start, end in zip(names, starts, ends, strict=True)}
    gap, read = np.zeros(int(ends[-1])), np.zeros(int(ends[-1]))
    for point, sign in ((contact.left, -1.0), (contact.right, 1.0)):
        gap[parts[point.body]] += sign * built[point.body].model.row(point.x, "displacement")
    for push in pushes:
        read[parts[push.body]] += push.weight * built[push.body].model.row(push.x, push.quantity)
    stiffness, along = gains
    mass = np.concatenate([system.mass[0] for system in systems])

    def accelerations(u: Array) -> Array:
        pulled = np.concatenate([multiply(s.stiffness, u[parts[name]]) for name, s in zip(names, systems, strict=True)])
        opening, stress = gap @ u, read @ u
        pulled += gap * (stiffness * opening - stress) - along * read * opening
        return np.asarray(pulled / mass)

    size = mass.size
    if size <= MAX_DENSE:
        matrix = np.array([accelerations(unit) for unit in np.eye(size)]).T
        return float(np.max(np.linalg.eigvals(matrix).real))
    from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

    operator: Any = LinearOperator((size, size), matvec=accelerations, dtype=float)
    try:
        # A start of its own, so that the same case gives the same bits.
        found = eigs(operator, 1, which="LM", v0=1.0 / (1.0 + np.arange(size)), tol=FREQUENCY_TOL)[0]
    except ArpackNoConvergence as near:
        found = near.eigenvalues
    return float(np.max(np.real(found), initial=0.0))
