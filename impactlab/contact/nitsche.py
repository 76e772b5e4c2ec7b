"""Nitsche's method: the stress at the face takes part in the contact condition."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, final

from impactlab.contact.base import AbstractContactLaw, needs_waves
from impactlab.errors import PairingError
from impactlab.types import SIDES, Level, Port, Reading, Reply, SideFacts, Start, option


@final
@dataclass(frozen=True)
class Nitsche(AbstractContactLaw):
    """Nitsche's method: F = max(0, S - gap/g), with S from the face's stress.

    S is the force that the stress of the rod gives at the face, for two rods the mean, weighted by h/EA of each. The
    method is consistent without a multiplier: in the exact solution S is the contact force. Inner points of a rod,
    where it is not, are refused. Beside F along the gap, theta g (S - F) acts along the row of S, so that the method is
    the symmetric one (theta = 1), the simple one (0) or the skew one (-1). g = ``gamma`` h/EA, with h the least
    distance between nodes, for two rods the mean. Gap and S are taken where the scheme's force acts. The stored energy
    theta g (F^2 - S^2)/2 may be negative; with the energy of the rods it is positive while g < l/(EA p^2), in elements
    of length l and order p, for two rods less than the sum: gamma < 1 for 2-node bars, 0.27 for any order. With S as
    the plain mean that would hold for similar rods alone.

    References
    ----------
    ChoulyHildRenard2015, equations of part 1 (semi-discrete problem, energy of the theta family) and part 2 (in time);
    ChoulyRenard2018 (explicit). Deviation: the weights of two rods.
    """

    needs = frozenset({Level.POSITION})
    citations = ("ChoulyHildRenard2015", "ChoulyRenard2018")
    hard = True
    # Measured (docs/bounds.md): touches and releases within a step, and theta below 1.
    gains_energy = 0.3
    gain_remedy = "Give nitsche a gamma of at most 0.27, or a smaller step."
    examples = ({}, {"theta": "0"}, {"theta": "-1", "gamma": 0.1})

    theta: Literal["1", "0", "-1"] = option("1", description="1 symmetric, 0 without, -1 skew")
    gamma: float = option(
        0.25,
        above=0.0,
        below=1.0,
        description="g over h/EA, h between nodes; bounded for 2-node bars, 0.27 for any order",
    )

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        rods = [(side, facts) for side, facts in zip(SIDES, (left, right), strict=True) if facts.kind == "rod"]
        if not rods:
            needs_waves("nitsche", left, right)
            raise PairingError("nitsche needs a rod on one side", remedy="Use penalty or addition_deletion.")
        compliances = [1.0 / facts.element_stiffness for _, facts in rods]
        compliance = self.gamma * sum(compliances) / len(rods)
        weights = [each / sum(compliances) for each in compliances]  # for equal ones exactly a half
        pushed = tuple((Reading(side, 0.0, "force"), weight) for (side, _), weight in zip(rods, weights, strict=True))
        return Start(parameters=(compliance, float(self.theta)), pushed=pushed)

    def closed_gains(self, start: Start) -> tuple[float, float]:
        compliance, theta = start.parameters[:2]
        return 1.0 / compliance, theta

    def stiffest(self, left: SideFacts, right: SideFacts, dt: float) -> float:
        return 1.0 / self.begin(left, right, dt).parameters[0]

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        compliance, theta = port.parameters[0], port.parameters[1]
        # F = S - gap/g and Q = theta g (S - F), two linear equations: S and gap are linear in F and Q.
        a = 1.0 - port.acting_pushed_per_force + port.acting_gap_per_force / compliance
        b = -port.acting_pushed_per_push + port.acting_gap_per_push / compliance
        c = theta * compliance * (1.0 - port.acting_pushed_per_force)
        d = 1.0 - theta * compliance * port.acting_pushed_per_push
        known, push = port.acting_pushed - port.acting_gap / compliance, theta * compliance * port.acting_pushed
        reply.trial = (known * d - b * push) / (a * d - b * c)
        if reply.trial > 0.0:
            reply.force = reply.trial
            reply.push = (a * push - c * known) / (a * d - b * c)
            reply.in_contact = 1.0
        else:
            reply.push = push / d
        end = port.free_pushed + port.pushed_per_force * reply.force + port.pushed_per_push * reply.push
        gap_end = port.free_gap + port.gap_per_force * reply.force + port.gap_per_push * reply.push
        held = max(0.0, end - gap_end / compliance)
        reply.stored = 0.5 * theta * compliance * (held * held - end * end)
