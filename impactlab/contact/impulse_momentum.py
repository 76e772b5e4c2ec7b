"""The generalised impulse-momentum balance: a velocity jump with a coefficient of restitution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw
from impactlab.types import Level, Port, Reply, SideFacts, Start, option


@final
@dataclass(frozen=True)
class ImpulseMomentum(AbstractContactLaw):
    """Generalised impulse-momentum balance: an impulse where a step begins with touching, approaching faces.

    The impulse (1 + e) m (approach speed), with m the effective mass of both faces, turns the approach speed into e
    times itself. There is no force and so no force history. A flexible body goes on approaching and is kicked again:
    the first kick is not the impulse of the impact.

    References
    ----------
    EscalonaMayoDominguez1999, Section 1; KhuliefShabana1987; Palas1992.
    """

    needs = frozenset({Level.IMPULSE})
    zero_apart = True
    citations = ("KhuliefShabana1987", "Palas1992", "Moreau1988")
    hard = True
    answers_force = False
    shares_losses = True
    examples = ({"restitution": 0.5}, {})

    restitution: float = option(1.0, at_least=0.0, at_most=1.0, description="coefficient of restitution")

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start(parameters=(self.restitution,))

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        # Restitution refers to the rate before any impulse of the step, also where other contacts kick too. Faces that
        # parted then, and that others drive back, may approach by the same share: with one e for all contacts that are
        # solved together, no impact gains energy (Moreau1988).
        target = -port.parameters[0] * port.gap_rate
        rate = port.rate_before_impulse
        if port.gap <= 0.0 and rate < target and port.gap_rate + port.others_rate < target:
            reply.impulse = (target - rate) / port.rate_per_impulse
            reply.dissipated = -0.5 * reply.impulse * (port.gap_rate + target)
