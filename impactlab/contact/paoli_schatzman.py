"""The two-step position law with restitution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw
from impactlab.types import Level, Port, Reply, SideFacts, Start, option


@final
@dataclass(frozen=True)
class PaoliSchatzman(AbstractContactLaw):
    """Paoli and Schatzman: a complementarity condition on gaps two steps apart.

    The gap at the end of a step plus e times the gap a step before its start is not negative.

    The force of the step is the least that keeps it so; its percussion holds the impact. With e = 0 the gap itself is
    kept, with e = 1 positions are mirrored in time.

    References
    ----------
    PaoliSchatzman2002 (written for second differences in time; with other steps only e = 0 is offered, which keeps the
    gap: how two faces that both have mass then part depends on where in the step they meet).
    """

    needs = frozenset({Level.POSITION})
    citations = ("PaoliSchatzman2002",)
    hard = True
    holds_position = True
    trial_at_end = True
    fixed_step = True
    examples = ({}, {"restitution": 1.0})

    restitution: float = option(0.0, at_least=0.0, at_most=1.0, description="coefficient of restitution of the faces")

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start(parameters=(self.restitution,), memory=(0.0, 0.0, 0.0))

    def needs_second_differences(self) -> bool:
        return self.restitution > 0.0

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        # Before the first step the faces moved as they do at its start.
        before = port.memory[0] if port.memory[1] > 0.0 else port.gap - port.dt * port.gap_rate
        reply.memory[0], reply.memory[1] = port.gap, 1.0
        reply.trial = -(port.free_gap + port.parameters[0] * before) / port.gap_per_force
        # An impact takes two steps, of which the second may return energy that the first took: the energy taken by the
        # force is held until the contact opens.
        if reply.trial > 0.0:
            reply.force = reply.trial
            reply.in_contact = 1.0
            rate = port.free_gap_rate + port.rate_per_force * reply.force
            reply.memory[2] = port.memory[2] - 0.5 * reply.force * port.dt * (port.gap_rate + rate)
            reply.stored = max(0.0, reply.memory[2])
        else:
            reply.dissipated = max(0.0, port.memory[2])
            reply.memory[2] = 0.0
