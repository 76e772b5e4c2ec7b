"""Two faces that move as one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw
from impactlab.types import Level, Port, Reply


@final
@dataclass(frozen=True)
class Bonded(AbstractContactLaw):
    """Bond: the force of either sign that keeps the gap rate at zero, so that two faces move as one.

    Bar, specimen and bar stay bodies of their own, with their names and probes. Faces that set out with different
    velocities have one after the first step: the loss of a plastic impact.

    References
    ----------
    EscalonaMayoDominguez1999, Section 1 (constraints by their multipliers; here one that is never deleted).
    """

    needs = frozenset({Level.POSITION, Level.VELOCITY})
    citations = ("EscalonaMayoDominguez1999",)
    two_sided = True

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        if port.rate_per_force > 0.0:  # not before the first step
            reply.force = reply.trial = -port.free_gap_rate / port.rate_per_force
            travel = port.free_travel + port.travel_per_force * reply.force
            reply.dissipated = max(0.0, -reply.force * travel)
        reply.in_contact = 1.0
