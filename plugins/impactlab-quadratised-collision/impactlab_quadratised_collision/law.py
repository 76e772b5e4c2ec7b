"""Energy quadratisation: a power law of contact without iteration.

Its energy is the square of a variable.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw
from impactlab.types import Level, Port, Reply, SideFacts, Start, option


@final
@dataclass(frozen=True)
class QuadratisedPowerLaw(AbstractContactLaw):
    """Power law F = K d^a by energy quadratisation: linear steps, exact energy.

    A step solves one linear equation. The energy K d^(a+1)/(a+1) of a penetration d is carried as psi^2/2. Over a step
    psi grows by g times the change of d, with g a slope of psi(d) known before the force is; the force g (psi_old +
    psi_new)/2 then is linear in itself, and its work is exactly the change of psi^2/2, under forces in the middle of
    the step and at its start alike.

    Deviations from the source: g is the slope of psi(d) between the depth at the start and the depth that free motion
    would reach, not the derivative at the start, so that the depth of a first touch within a step is counted; and in
    the step in which the faces part the force is the one that gives back just what psi holds, so that no energy is left
    in an open contact.

    References
    ----------
    DucceschiBilbaoWillemsenSerafin2021; DucceschiBilbao2019.
    """

    needs = frozenset({Level.POSITION, Level.VELOCITY})
    citations = ("DucceschiBilbaoWillemsenSerafin2021", "DucceschiBilbao2019")
    examples = ({}, {"stiffness": 1.0e8, "exponent": 1.0}, {"stiffness": 1.0e12, "exponent": 2.5})

    stiffness: float = option(1.0e9, unit="N/m^exponent", above=0.0, description="constant K of the power law")
    exponent: float = option(1.5, at_least=1.0, at_most=10.0, description="exponent a of the power law; Hertz 1.5")

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start(parameters=(math.sqrt(2.0 * self.stiffness / (self.exponent + 1.0)), 0.5 * (self.exponent + 1.0)))

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        scale, power = port.parameters[0], port.parameters[1]  # psi(d) = scale d^power
        # Depths at the ends of the travel over which the force works, the later one without force.
        start, end, compliance = -port.travel_start, -(port.travel_start + port.free_travel), port.travel_per_force
        if start <= 0.0 and end <= 0.0:
            reply.dissipated = 0.5 * port.memory[0] * port.memory[0]  # nothing is left, except pulls of other contacts
            return
        psi = port.memory[0]
        if port.memory[1] == 0.0 and start > 0.0:  # faces that overlap from the beginning
            psi = scale * start**power
        larger = max(start, end)
        if abs(end - start) > 1e-5 * larger:
            slope = (scale * max(end, 0.0) ** power - scale * max(start, 0.0) ** power) / (end - start)
        else:  # a difference of nearly equal numbers says less than the derivative between them
            slope = scale * power * (0.5 * (start + end)) ** (power - 1.0)
        force = slope * (psi + 0.5 * slope * (end - start)) / (1.0 + 0.5 * slope * slope * compliance)
        depth = end - compliance * force
        after = psi + slope * (depth - start)
        if depth <= 0.0 or after < 0.0 or force < 0.0:
            # Parting: F (start - depth) = psi^2/2 with depth = end - compliance F.
            back = start - end
            root = back + math.sqrt(back * back + 2.0 * compliance * psi * psi)
            force = psi * psi / root if psi > 0.0 and root > 0.0 else 0.0
            depth, after = end - compliance * force, 0.0
        reply.force = reply.trial = force
        reply.in_contact = 1.0 if depth > 0.0 else 0.0
        reply.stored = 0.5 * after * after
        reply.memory[0] = after
        reply.memory[1] = reply.in_contact
