"""Identification of dispersive waves by a messenger per mode.

The last paragraph of the 1999 paper proposes it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, final

from impactlab.contact.base import AbstractContactLaw, needs_waves
from impactlab.errors import PairingError
from impactlab.types import SIDES, Arriving, Level, Port, Reply, SideFacts, Start, option


@final
@dataclass(frozen=True)
class ModalMessengers(AbstractContactLaw):
    """Wave identification by one messenger per mode, at the distance that its wave travels in a step.

    All of them give the motion of the face.

    Our reading of one paragraph of the source: mode i is read at c_i dt with c_i = w_i/k_i its phase speed
    (``speed: group`` for dw/dk); its wave towards the face follows from its velocity and its force, which are in the
    ratio rho A c_i, and the sum is the free velocity V of the face; the balance is that of `dispersive_identification`.
    The source leaves the compliance in the balance open: ``balance: modes`` takes that of the modes, ``impedance`` the
    1/Z of the place, which an Euler-Bernoulli beam does not have.

    A messenger gives the free motion of its mode only where the mode is one standing wave with its crest at the face:
    on rods, and at inner points of beams away from their ends. At the tip of a beam the near field hides most of its
    motion in a step, however short: the law then gains energy in proportion to the step. A run is refused where the
    error of the messengers in a step is above ``accept`` (docs/dispersive-waves.md).

    References
    ----------
    EscalonaMayoDominguez1999, Section 4, last paragraph.
    """

    needs = frozenset({Level.VELOCITY})
    zero_apart = True
    citations = ("EscalonaMayoDominguez1999",)
    hard = True
    fixed_step = True
    trial_at_end = True
    gains_energy = math.inf
    gain_remedy = "Use integrator exact_modal, whose step is the free motion that messengers give."
    examples = ({}, {"balance": "impedance", "accept": 1.0})

    speed: Literal["phase", "group"] = option("phase", description="speed of a mode's wave: w/k, or dw/dk")
    balance: Literal["modes", "impedance"] = option(
        "modes", description="velocity of the face per unit force: of the modes, or 1/Z of the place"
    )
    accept: float = option(
        0.6, above=0.0, description="largest error of messengers, or of 1/Z, over the motion by the modes"
    )

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        needs_waves("modal_messengers", left, right)
        parameters: list[float] = []
        readings: list[Arriving] = []
        for side, facts in zip(SIDES, (left, right), strict=True):
            if facts.kind in ("mass", "wall"):
                parameters += [0.0, 0.0, 0.0]
                continue
            share = facts.velocity_per_force * facts.impedance
            if self.balance == "impedance" and (math.isnan(facts.impedance) or abs(share - 1.0) > self.accept):
                text = f"balance 'impedance' needs an impedance, and the {facts.kind} '{facts.body}' has none here"
                if not math.isnan(facts.impedance):
                    text = (
                        "balance 'impedance' takes 1/Z for the velocity of the face per unit force; the modes of the "
                        f"{facts.kind} '{facts.body}' give {share:.3g}/Z in this step"
                    )
                raise PairingError(text, remedy="Use balance: modes, or law dispersive_identification.")
            if facts.end == "force":
                raise PairingError(
                    "modal_messengers predicts the motion of a face from waves alone, and an end force also "
                    f"acts on the face of '{facts.body}'",
                    remedy="Use dispersive_identification.",
                )
            taken = 1.0 / facts.impedance if self.balance == "impedance" else math.nan
            parameters += [1.0, 0.0 if math.isnan(taken) else taken, facts.gravity * dt]
            readings.append(Arriving(side, dt, self.speed, self.accept, taken))
        return Start(parameters=tuple(parameters), readings=tuple(readings))

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        left, right = port.left.free_velocity, port.right.free_velocity
        reading = 0
        if port.parameters[0] > 0.0:
            left = port.readings[0] + port.parameters[2]
            reading = 1
        if port.parameters[3] > 0.0:
            right = port.readings[reading] + port.parameters[5]
        compliance = port.parameters[1] if port.parameters[1] > 0.0 else port.left.velocity_per_force
        compliance += port.parameters[4] if port.parameters[4] > 0.0 else port.right.velocity_per_force
        reply.trial = (left - right) / compliance
        if (port.in_contact > 0.0 or port.gap <= 0.0) and reply.trial > 0.0:
            reply.force = reply.trial
            reply.in_contact = 1.0
            if port.in_contact == 0.0:
                # As in dispersive_identification: at a touch force times travel is lost.
                travel = port.free_travel + port.travel_per_force * reply.force
                reply.dissipated = max(0.0, -reply.force * travel)
