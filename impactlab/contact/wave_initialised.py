"""The constraint whose first pressure is that of the waves."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw, needs_waves
from impactlab.errors import PairingError
from impactlab.types import Level, Port, Reply, SideFacts, Start


@final
@dataclass(frozen=True)
class WaveInitialised(AbstractContactLaw):
    """Addition-deletion that begins with the common velocity and force of wave theory.

    On touch the faces take this velocity, and the pressure of the waves that leave them. The force of the first step is
    (approach speed)/(1/Z + 1/Z') (1/Z = 0 for mass and wall); from then on it is the multiplier of the constraint. The
    common velocity is given by an impulse, whose lost energy is booked, or is in F dt where the scheme's percussion
    holds it.

    References
    ----------
    Shao and others, as cited by EscalonaMayoDominguez1999 (Introduction, p. 767: "initial velocities of the nodes in
    contact and initial contact pressure ... obtained from wave propagation concepts"); the relations are those of
    TimoshenkoGoodier1951. Deviation: the impulse acts on both bodies, so that momentum is kept.
    """

    needs = frozenset({Level.POSITION, Level.IMPULSE})
    zero_apart = True
    citations = ("EscalonaMayoDominguez1999", "TimoshenkoGoodier1951")
    hard = True
    holds_position = True
    shares_losses = True
    # No bound is known: the first pressure leaves an overlap or a gap, which the constraint closes in the next step. On
    # the 1999 paper's impact 0.015 were gained with steps cut at events, several times the initial energy where F dt
    # holds the closing jump (docs/matrix.md).
    gains_energy = math.inf
    # On the same impact: consistent mass 4 to 15, lumped 0.03 to 0.12 (20 to 100 elements, courant 0.5).
    gain_remedy = (
        "Give finite_element mass: lumped (with newmark, hht_alpha or midpoint), or law velocity_complementarity, "
        "which gains less on every mesh."
    )

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        rods = [facts for facts in (left, right) if facts.kind == "rod"]
        if not rods or any(math.isnan(facts.impedance) for facts in rods):
            needs_waves("wave_initialised", left, right)
            raise PairingError(
                "wave_initialised needs the impedance of a rod's end, and this contact has none",
                remedy="Use addition_deletion.",
            )
        return Start(parameters=(1.0 / sum(1.0 / facts.impedance for facts in rods),))

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        if port.in_contact == 0.0:
            rate = port.gap_rate + port.others_rate
            if port.gap > 0.0 or rate >= 0.0:
                return
            reply.force = -port.parameters[0] * port.gap_rate if port.gap_rate < 0.0 else 0.0
            reply.trial = reply.force
            reply.in_contact = 1.0
            if port.jump_in_force == 0.0:
                reply.impulse = -rate / port.rate_per_impulse
                reply.dissipated = -0.5 * reply.impulse * port.gap_rate
            else:
                reply.force -= rate / (port.rate_per_impulse * port.dt)
                reply.trial = reply.force
                travel = port.free_travel + port.travel_per_force * reply.force
                reply.dissipated = max(0.0, -reply.force * travel)
            return
        reply.trial = -port.free_gap / port.gap_per_force
        if reply.trial > 0.0:
            reply.force = reply.trial
            reply.in_contact = 1.0
            if port.jump_in_force > 0.0:
                travel = port.free_travel + port.travel_per_force * reply.force
                reply.dissipated = max(0.0, -reply.force * travel)
