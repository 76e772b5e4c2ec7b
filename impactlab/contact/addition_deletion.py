"""The constraint that is added on touch and deleted when it would pull."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.penalty import Penalty
from impactlab.types import Level, Port, Reply, SideFacts


@final
@dataclass(frozen=True)
class AdditionDeletion(AbstractContactLaw):
    """Constraint addition-deletion: the multiplier closes the gap and is deleted where it would pull.

    The gap is zero at the end of each step in contact, and the multiplier is the force. Touch is found at the start of
    a step; the constraint then needs a velocity jump, given by an impulse (unless the scheme's own force holds it),
    whose lost energy is booked. A scheme that projects its predictor is given the least projection that leaves it no
    overlap. On a massless face the constraint is a spring of the face's flexibility.

    References
    ----------
    EscalonaMayoDominguez1999, Section 1 ("constraint addition-deletion method"); WuHaug1990;
    HughesTaylorSackmanCurnierKanoknukulchai1976.
    """

    needs = frozenset({Level.POSITION, Level.CLOSING})
    citations = ("WuHaug1990", "HughesTaylorSackmanCurnierKanoknukulchai1976")
    hard = True
    is_the_contact = True
    holds_position = True
    shares_losses = True
    zero_apart = True
    # A hard constraint has no stiffness to reduce. On a lumped mesh the 1999 paper's impact gains 0.003 to 0.008 under
    # newmark, and with its consistent mass 0.5 to 1.1; moreau_jean gains nothing on either (20 and 100 elements,
    # courant 0.5).
    gain_remedy = "Use integrator moreau_jean, or give finite_element mass: lumped."

    def acting(self, left: SideFacts, right: SideFacts) -> AbstractContactLaw:
        flexibility = left.flexibility + right.flexibility
        return Penalty(stiffness=math.inf) if flexibility > 0.0 else self

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        free_gap = port.free_gap
        if port.jump_in_force > 0.0:
            travel = port.free_travel
            if port.predicted_gap < 0.0:
                reply.projection = -port.predicted_gap / port.rate_per_impulse
                moved = port.gap_per_projection * reply.projection
                free_gap, travel = free_gap + moved, travel + moved
            reply.trial = -free_gap / port.gap_per_force
            if reply.trial > 0.0:
                reply.force = reply.trial
                reply.in_contact = 1.0
                reply.dissipated = max(0.0, -reply.force * (travel + port.travel_per_force * reply.force))
            else:
                # A projection p moves the faces without a velocity. With w = 2 (gap at the end)/dt^2 their mean free
                # acceleration it takes p w.
                reply.dissipated = 2.0 * reply.projection * free_gap / port.dt**2
            return
        if port.in_contact == 0.0:
            rate = port.gap_rate + port.others_rate
            if port.gap > 0.0 or rate >= 0.0:
                return
            reply.impulse = -rate / port.rate_per_impulse
            reply.dissipated = -0.5 * reply.impulse * port.gap_rate
            free_gap += port.gap_per_impulse * reply.impulse
        reply.trial = -free_gap / port.gap_per_force
        if reply.trial > 0.0 or reply.impulse > 0.0:
            reply.force = max(0.0, reply.trial)
            reply.in_contact = 1.0
