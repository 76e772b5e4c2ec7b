"""Measured orders of convergence of the integrators, on a smooth problem and on an impact."""

from __future__ import annotations

import math
from typing import Any

from impactlab.integrators.adaptive import Adaptive
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
from impactlab.testing.contracts import IntegratorContract
from impactlab.testing.impact_orders import error, impact_order
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


def smooth_order(integrator: AbstractIntegrator) -> float:
    """Return the order on free and forced smooth motion, as the contract suite of integrators measures it."""
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
