"""The constraint found by augmentations of a penalty."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.relative import in_si
from impactlab.types import Level, Port, Relative, Reply, SideFacts, Start, option


@final
@dataclass(frozen=True)
class AugmentedLagrangian(AbstractContactLaw):
    """Augmented Lagrangian: a penalty whose multiplier is augmented a few times in each step.

    The first force of a step starts from the last multiplier. One augmentation: F = max(0, multiplier - stiffness * gap
    at the end), then the multiplier is F. The overlap falls by 1/(1 + stiffness * compliance) each time; with many of
    them this is addition-deletion. Touch and the impulse of closing are those of the constraint.

    References
    ----------
    AlartCurnier1991; SimoLaursen1992 (Uzawa's algorithm, nested in the step).
    """

    needs = frozenset({Level.POSITION, Level.IMPULSE})
    citations = ("AlartCurnier1991", "SimoLaursen1992")
    hard = True
    holds_position = True
    shares_losses = True
    trial_at_end = True
    # Measured on the periodic and the bouncing bar (docs/methods.md): one augmentation 0.55, ten 4e-4.
    gains_energy = 0.6
    # On faces of small compliance augmentations remove next to nothing of an overlap in a step (17 pairs on a beam).
    gain_remedy = (
        "Give augmented_lagrangian a hundred times the stiffness and 100 augmentations, so that "
        "the overlap vanishes within each step, or law addition_deletion, which solves its "
        "constraint in each step."
    )
    examples = ({"stiffness": 1e9},)

    stiffness: float | Relative = option(
        Relative(1.0), unit="N/m", above=0.0, description="penalty; relative to EA/h, the smaller of two rods"
    )
    augmentations: int = option(10, at_least=1, at_most=1000, description="augmentations in each step")

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        references = [facts.element_stiffness for facts in (left, right) if facts.kind == "rod"]
        stiffness = in_si(self.stiffness, "stiffness", references)
        return Start(parameters=(stiffness, float(self.augmentations)), memory=(0.0, 0.0))

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        stiffness, count = port.parameters[0], int(port.parameters[1])
        free_gap, multiplier = port.free_gap, port.memory[0]
        if port.in_contact == 0.0:
            multiplier = 0.0
            if port.jump_in_force == 0.0:
                rate = port.gap_rate + port.others_rate
                if port.gap > 0.0 or rate >= 0.0:
                    reply.memory[0] = 0.0
                    return
                reply.impulse = -rate / port.rate_per_impulse
                reply.dissipated = -0.5 * reply.impulse * port.gap_rate
                free_gap += port.gap_per_impulse * reply.impulse
        for _ in range(count):
            reply.trial = (multiplier - stiffness * free_gap) / (1.0 + stiffness * port.gap_per_force)
            multiplier = max(0.0, reply.trial)
        reply.memory[0] = multiplier
        if multiplier > 0.0 or reply.impulse > 0.0:
            reply.force = multiplier
            reply.in_contact = 1.0
            if port.jump_in_force > 0.0:
                # The overlap that augmentations leave is pressed out in later steps: the energy taken by the force is
                # held until the contact opens, and energy returned comes from there.
                travel = port.free_travel + port.travel_per_force * reply.force
                reply.memory[1] = port.memory[1] - reply.force * travel
                reply.stored = max(0.0, reply.memory[1])
        else:
            reply.dissipated = max(0.0, port.memory[1])
            reply.memory[1] = 0.0
