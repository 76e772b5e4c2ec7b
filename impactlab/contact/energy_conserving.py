"""The persistency condition, which does no work."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw
from impactlab.types import Level, Port, Reply

ROUNDING = 1e-14  # of displacements that were added up over a period of contact


@final
@dataclass(frozen=True)
class EnergyConserving(AbstractContactLaw):
    """Energy-conserving contact: faces in contact keep their gap over a step.

    The force then does no work. The condition is on the mean gap rate of the step (persistency), not on the gap: faces
    that overlapped by part of a step's travel when they touched keep that overlap until they part. Under implicit
    schemes energy is kept to rounding through touch and opening. Under explicit ones the faces take one velocity as if
    the impact were plastic, and the loss is booked.

    References
    ----------
    LaursenChawla1997, section 3 (normal contact, without their penalty regularisation); HauretLeTallec2006.
    """

    needs = frozenset({Level.POSITION})
    zero_apart = True
    citations = ("LaursenChawla1997", "HauretLeTallec2006")
    hard = True

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        # Faces that met without overlap stay where they are, up to the rounding of their displacements.
        slack = ROUNDING * max(abs(port.left.displacement), abs(port.right.displacement)) * port.in_contact
        if port.gap > slack:
            return
        reply.trial = (port.gap - port.free_gap) / port.gap_per_force
        if reply.trial > 0.0:
            reply.force = reply.trial
            reply.in_contact = 1.0
            if port.acting_gap_per_force == 0.0:  # explicit: the travel is not the change of the gap, which is zero
                travel = port.free_travel + port.travel_per_force * reply.force
                reply.dissipated = max(0.0, -reply.force * travel)
