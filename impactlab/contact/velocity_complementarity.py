"""Complementarity of velocity and percussion, with Newton's restitution: the contact law of event-capturing schemes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw
from impactlab.types import Level, Port, Reply, SideFacts, Start, option


@final
@dataclass(frozen=True)
class VelocityComplementarity(AbstractContactLaw):
    """Moreau's law: complementarity of percussion and gap rate while faces touch.

    0 <= percussion, 0 <= gap rate + e (gap rate before), and one of them is zero.

    The percussion F dt of a step holds impact and pressure alike. Faces touch where the gap is zero at the start of the
    step, so they have overlapped by less than a step's travel; the overlap stays, unless ``projection`` moves
    positions (and no velocity) back at the end of the step.

    References
    ----------
    Moreau1988; Jean1999, section 3 (event-capturing, velocity level); Acary2013 (projection; here without a second
    complementarity: positions are projected where the step ends in overlap while the contact is closed).
    """

    needs = frozenset({Level.POSITION, Level.VELOCITY, Level.IMPULSE})
    zero_apart = True
    citations = ("Moreau1988", "Jean1999", "Acary2013")
    hard = True
    shares_losses = True
    trial_at_end = True
    # Measured: projected positions change the strain energy (docs/bounds.md).
    gains_energy = 0.3
    examples = ({}, {"restitution": 0.5, "projection": True})

    restitution: float = option(0.0, at_least=0.0, at_most=1.0, description="coefficient of restitution of the faces")
    projection: bool = option(False, description="project overlapping positions back at the end of the step")

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start(parameters=(self.restitution, float(self.projection)))

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        # The gap of resting faces is zero to rounding: they touch as long as they would overlap.
        if port.gap > 0.0 and (port.in_contact == 0.0 or port.free_gap > 0.0):
            return
        # Faces that part, and that others drive back, may approach by the share e of that rate. Summed over contacts
        # that are solved together, P (rate before) <= 0 follows, and one e for all of them gains no energy.
        target = -port.parameters[0] * port.gap_rate
        reply.trial = (target - port.free_gap_rate) / port.rate_per_force
        if reply.trial <= 0.0:
            return
        reply.force = reply.trial
        reply.in_contact = 1.0
        # The faces move apart by the mean of their rates: the work of the force, negative where energy is lost. Of
        # contacts that collide together each has its own share, which has either sign.
        reply.dissipated = -0.5 * reply.force * port.dt * (port.gap_rate + target)
        end = port.free_gap + port.gap_per_force * reply.force
        if port.parameters[1] > 0.0 and end < 0.0:
            reply.projection = -end / port.gap_per_projection
