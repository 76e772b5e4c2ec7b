"""Measured orders of convergence of the integrators, on a smooth problem and on an impact.

The impact: a mass meets a clamped rod through a fixed spring, the mesh staying as it is.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.penalty import Penalty
from impactlab.integrators.adaptive import Adaptive
from impactlab.integrators.base import AbstractIntegrator, AbstractScheme
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
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene.method import StepRule
from impactlab.simulate import driver as simulate
from impactlab.testing.contracts import IntegratorContract
from impactlab.testing.scenes import STEEL, mass_on_rod
from impactlab.types import Array
from studies.pages import table

# With the declared order; that of a scheme's class holds for its options but these.
FIRST = {"moreau_jean theta = 1": MoreauJean(1.0), "newmark beta = 0.3025, gamma = 0.6": Newmark(0.3025, 0.6)}
STEPPING: dict[str, AbstractIntegrator] = {
    "newmark": Newmark(),
    "newmark beta = 0.3025, gamma = 0.6": FIRST["newmark beta = 0.3025, gamma = 0.6"],
    "central_difference": CentralDifference(),
    "midpoint": Midpoint(),
    "exact_modal": ExactModal(),
    "hht_alpha": HhtAlpha(),
    "hht_alpha alpha = -1/3": HhtAlpha(-1.0 / 3.0),
    "generalised_alpha rho_inf = 0": GeneralisedAlpha(0.0),
    "generalised_alpha": GeneralisedAlpha(),
    "generalised_alpha rho_inf = 1": GeneralisedAlpha(1.0),
    "nonsmooth_generalised_alpha": NonsmoothGeneralisedAlpha(),
    "bathe": Bathe(),
    "moreau_jean": MoreauJean(),
    "moreau_jean theta = 1": FIRST["moreau_jean theta = 1"],
    "contact_stabilised_newmark": ContactStabilisedNewmark(),
}
TOLERANCES = (1e-4, 1e-5)  # smaller ones reach the error of the reference


ELEMENTS, POINTS = 8, 150
SPRING = 0.5 * STEEL.young * STEEL.area * ELEMENTS / STEEL.length
LINEAR = Penalty(SPRING)
STEPS = (16, 64)  # between two points; the second four times finer


def positions(integrator: AbstractScheme, steps: int, law: AbstractContactLaw = LINEAR) -> Array:
    """Return positions of the mass at fixed instants, (151,) [m].

    All of them are ends of steps, through contact and flight. Schemes that need modes get all those of the mesh, which
    is the same problem; adaptive ones choose their steps.
    """
    needs_modes = isinstance(integrator, AbstractIntegrator) and integrator.needs_modes
    model: AbstractRodModel = Modal(ELEMENTS, None, "lumped") if needs_modes else FiniteElement(ELEMENTS, "lumped")
    fixed, duration = isinstance(integrator, AbstractIntegrator), 2.5 * 2.0 * STEEL.length / STEEL.wave_speed
    step = StepRule(dt=duration / (POINTS * steps)) if fixed else StepRule(points_per_period=10.0)
    history = simulate.run(*mass_on_rod(model, law, integrator, step, round_trips=2.5))
    assert [event.kind for event in history.events] == ["close", "open"]
    return history.evaluate(np.linspace(0.0, duration, POINTS + 1), "position:hammer")


@functools.cache
def reference(law: AbstractContactLaw = LINEAR) -> tuple[float, ...]:
    """Return the positions of the semi-discrete problem.

    They are extrapolated: of fine midpoint steps, the h^2 of their error is subtracted.
    """
    coarse, fine = (positions(Midpoint(), steps, law) for steps in (256, 512))
    return tuple(fine + (fine - coarse) / 3.0)


def error(integrator: AbstractScheme, steps: int, law: AbstractContactLaw = LINEAR) -> float:
    """Return the error of the positions in the Euclidean norm [m]."""
    return float(np.linalg.norm(positions(integrator, steps, law) - np.array(reference(law))))


def impact_order(integrator: AbstractScheme, law: AbstractContactLaw = LINEAR) -> float:
    """Return the order at which the error falls.

    It falls from 16 to 64 steps between two points.
    """
    coarse, fine = (error(integrator, steps, law) for steps in STEPS)
    return math.log(coarse / fine) / math.log(STEPS[1] / STEPS[0])


def smooth_order(integrator: AbstractIntegrator) -> float:
    """Return the order on free and forced smooth motion.

    The contract suite of integrators measures it in the same way.
    """
    suite: Any = type("Suite", (IntegratorContract,), {"part": integrator})()
    return float(suite.measured_order()[0])


def orders() -> str:
    """Return the table of orders."""
    lines = []
    for name, integrator in STEPPING.items():
        declared = 1 if name in FIRST else integrator.order
        lines.append(f"{name} | {declared} | {smooth_order(integrator):.2f} | {impact_order(integrator):.2f}")
    for method in ("DOP853", "RK45", "Radau", "BDF", "LSODA"):
        coarse, fine = (error(Adaptive(method, tolerance), 1) for tolerance in TOLERANCES)
        per_tolerance = math.log(coarse / fine) / math.log(TOLERANCES[0] / TOLERANCES[1])
        lines.append(f"adaptive, {method} | the tolerance | - | error falls as tolerance^{per_tolerance:.2f}")
    return table("integrator | declared | smooth motion | impact", lines)
