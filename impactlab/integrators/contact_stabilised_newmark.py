"""Contact-stabilised Newmark method: the prediction is projected on admissible displacements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.integrators.base import AbstractIntegrator, Step
from impactlab.integrators.theta import theta_step
from impactlab.models.base import Operators


@final
@dataclass(frozen=True)
class ContactStabilisedNewmark(AbstractIntegrator):
    """Newmark's average acceleration with a prediction projected on admissible gaps.

    The prediction is u + dt v. u_new = P(u + dt v) - dt^2/2 M^-1 (K (u + u_new)/2 + C (u_new - u)/dt - load - contact),
    M (v_new - v) = the same forces times dt. The projection (the law's reply) is orthogonal in the mass and is no
    velocity; the contact force is implicit, and its F dt holds the closing jump. Dampers act against all that moves,
    the projection as well, so that they never give energy (derived here; without damping it is the published method).

    References
    ----------
    KaneRepettoOrtizMarsden1999; DeuflhardKrauseErtel2008; KlapprothSchielaDeuflhard2010.
    """

    citations = ("DeuflhardKrauseErtel2008", "KaneRepettoOrtizMarsden1999", "KlapprothSchielaDeuflhard2010")
    order = 2
    jump_in_force = True
    projects_first = True
    gains_energy = 0.0

    def step(self, system: Operators, dt: float) -> Step:
        return theta_step(system, dt, 0.5)
