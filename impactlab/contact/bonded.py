"""Two faces that move as one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.branches import BOND
from impactlab.types import Branches, Level, Port, Reply, SideFacts, Start

TRAPEZOID = 1e-9  # of the compliance: a scheme whose displacements are the trapezoidal sums of its velocities


@final
@dataclass(frozen=True)
class Bonded(AbstractContactLaw):
    """Bond: a force of either sign keeps the gap rate at zero.

    Two faces then move as one. Bar, specimen and bar stay bodies of their own, with their names and probes. Faces that
    set out with different velocities have one after the first step: the loss of a plastic impact.

    References
    ----------
    EscalonaMayoDominguez1999, Section 1 (constraints by their multipliers; here one that is never deleted).
    """

    needs = frozenset({Level.POSITION, Level.VELOCITY})
    citations = ("EscalonaMayoDominguez1999",)
    two_sided = True
    moves_faces = True

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start(memory=(0.0, 0.0))

    def branches(self) -> Branches:
        return BOND

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        """Keep the gap rate at zero.

        Memory holds whether a step was taken, and the gap after the first one. Where faces at equal velocities may
        still move apart within a step, as under exact steps of modes, a bond at the level of velocities would drift and
        give energy: there the gap of the first step's end is kept.
        """
        if port.rate_per_force > 0.0:  # not before the first step
            mean = 0.5 * port.dt * port.rate_per_force
            drifts = port.averaged != 0.0 and abs(port.gap_per_force - mean) > TRAPEZOID * mean
            if drifts and port.memory[0] != 0.0:
                reply.force = -(port.free_gap - port.memory[1]) / port.gap_per_force
            else:
                reply.force = -port.free_gap_rate / port.rate_per_force
            travel = port.free_travel + port.travel_per_force * reply.force
            reply.dissipated = max(0.0, -reply.force * travel)
            if port.averaged == 0.0 and port.acting_gap_per_force > 0.0 and port.rate_per_impulse > 0.0:
                # A force at the end of a step changes the velocities by a part of its impulse, overshoots where it
                # stops a jump, and works over the steps after it. Lost is the energy of the jump, at once.
                jump = port.others_rate + (port.gap_rate if port.memory[0] == 0.0 else 0.0)
                reply.dissipated = 0.5 * jump * jump / port.rate_per_impulse
            if port.memory[0] == 0.0:
                reply.memory[0], reply.memory[1] = 1.0, port.free_gap + port.gap_per_force * reply.force
        reply.trial, reply.in_contact = reply.force, 1.0
