"""Wave identification, the law of the 1999 paper.

It identifies the wave that arrives at the contact face and balances the forces.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw, needs_waves
from impactlab.errors import PairingError
from impactlab.printing import at_most
from impactlab.types import SIDES, Level, Port, Reading, Reply, SideFacts, Start, option

WAVE_ROUNDING = 1e-9  # of 1/Z, by which a face on a stepped delay line moves
MAX_VELOCITY_PER_FORCE = 0.8 * (1.0 + 1e-9)  # of a face, over 1/Z; from 1 on the balance diverges, docs/bounds.md
TRY = 0.95  # of the step at which that limit lies on a long mesh


def step_to_try(ratio: float, dt: float) -> float:
    """Return a step [s] at which the velocity per force of a face is within its limit.

    ``ratio`` is that velocity over 1/Z at a step ``dt`` [s]. On a long mesh of elements h under the trapezoidal rule it
    is 2/sqrt(1 + (a/dt)^2), with a = h/c for lumped masses.
    """
    place, most = ((2.0 / min(each, 1.99)) ** 2 - 1.0 for each in (ratio, MAX_VELOCITY_PER_FORCE))
    return TRY * dt * math.sqrt(place / most)


def reads_waves(facts: SideFacts, dt: float) -> bool:
    """Return whether the wave that arrives at a side is read by a messenger.

    Velocity and compliance of other sides are those of their steppers. Raise `PairingError` where the law does not
    support the side.
    """
    if facts.kind == "beam":
        raise PairingError(
            f"wave_identification reads one wave that travels unchanged, and on the beam '{facts.body}' every "
            "wave length travels at a speed of its own",
            remedy="Use law dispersive_identification, or modal_messengers with model modal.",
        )
    if facts.kind != "rod":
        return False
    if facts.end not in ("free", "inner"):
        raise PairingError(
            f"wave_identification needs a struck end without support or force, and that of '{facts.body}' has a "
            f"{facts.end}",
            remedy="Use addition_deletion or penalty, or the continuous model.",
        )
    if facts.in_waves and abs(facts.velocity_per_force * facts.impedance - 1.0) < WAVE_ROUNDING:
        # A stepped delay line: its own free velocity is that of the waves that arrive.
        return False
    if facts.end == "inner":
        raise PairingError(
            "wave_identification reads one wave that arrives at an end, and at an inner point of the rod "
            f"'{facts.body}' waves arrive from both sides",
            remedy="Put the contact at a free end, or use dispersive_identification or addition_deletion.",
        )
    distance = facts.wave_speed * dt
    if distance > facts.room:
        raise PairingError(
            f"the messenger of wave_identification would lie {distance:.6g} m from the face, beyond the "
            f"first segment ({facts.room:.6g} m)",
            remedy=f"Give a step of {at_most(facts.room / facts.wave_speed)} s or less.",
            path="solve.step",
        )
    if facts.velocity_per_force * facts.impedance > MAX_VELOCITY_PER_FORCE:
        # The face moves faster per force than waves allow: the balance feeds back and diverges.
        share = facts.velocity_per_force * facts.impedance
        raise PairingError(
            f"in this step a force moves the face of the rod '{facts.body}' {share:.3g} "
            "times as fast as by wave theory (1/Z). Allowed: below 0.8; with a larger ratio "
            "wave_identification may diverge",
            remedy=f"Give a smaller step; try {step_to_try(share, dt):.3g} s, with few modes a smaller one.",
            path="solve.step",
        )
    return True


@final
@dataclass(frozen=True)
class WaveIdentification(AbstractContactLaw):
    """Wave identification: a messenger gives the wave that arrives at the face.

    The messenger is at c dt from the face, and a balance gives the force. With stress s1 and velocity v1 of the
    messenger at the start of the step, the wave that arrives at its end gives a free face the velocity V = v1 -+
    s1/(rho c) (rod on the right, left of the contact); a mass would have its free velocity, a wall none. Then F =
    (V_left - V_right)/(Y_left + Y_right) with Y = dt/M, 1/Z or 0. For a mass and a rod this is Eq. 15 of the source.
    Deviations: the contact ends when the whole stress turns negative (the source tests one wave); Eq. 20 is not used;
    walls, rods on both sides, gravity and ``residual`` are ours. Positions are not tied: a slight penetration belongs
    to the law, and its energy has no bound. Two rigid faces stay together, and the loss of that plastic impact is
    booked.

    References
    ----------
    EscalonaMayoDominguez1999, Section 4, Eqs. 15 to 22.
    """

    needs = frozenset({Level.VELOCITY})
    zero_apart = True
    citations = ("EscalonaMayoDominguez1999",)
    hard = True
    is_the_contact = True
    fixed_step = True
    trial_at_end = True
    shares_losses = True
    # Measured: 0.43 on two 2-node elements (docs/bounds.md), 0.674 with four Ritz vectors of 17 elements. On spectral
    # elements of order 4 and more it may gain the whole energy; such runs end as failed.
    gains_energy = 0.75

    residual: bool = option(True, description="add the quasi-static stress of the modes left out to the messenger's")

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        parameters: list[float] = []
        readings: list[Reading] = []
        needs_waves("wave_identification", left, right)
        for side, facts in zip(SIDES, (left, right), strict=True):
            if not reads_waves(facts, dt):
                parameters += [0.0, 0.0, 0.0]
                continue
            distance = facts.wave_speed * dt
            # 1/Z, 1/(rho c), g dt
            parameters += [1.0 / facts.impedance, facts.area / facts.impedance, facts.gravity * dt]
            readings += [
                Reading(side, distance, "velocity"),
                Reading(side, distance, "stress", left_out=self.residual),
            ]
        parameters.append(0.0 if "rod" in (left.kind, right.kind) else 1.0)  # 1 where no wave takes part
        return Start(parameters=tuple(parameters), readings=tuple(readings))

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        left_per_force, right_per_force = port.parameters[0], port.parameters[3]
        reading = 0
        if left_per_force > 0.0:
            left = port.readings[0] + port.readings[1] * port.parameters[1] + port.parameters[2]
            reading = 2
        else:
            left, left_per_force = port.left.free_velocity, port.left.velocity_per_force
        if right_per_force > 0.0:
            right = port.readings[reading] - port.readings[reading + 1] * port.parameters[4] + port.parameters[5]
        else:
            right, right_per_force = port.right.free_velocity, port.right.velocity_per_force
        reply.trial = (left - right) / (left_per_force + right_per_force)
        if (port.in_contact > 0.0 or port.gap <= 0.0) and reply.trial > 0.0:
            reply.force = reply.trial
            reply.in_contact = 1.0
            if port.parameters[6] != 0.0:  # rigid faces take one velocity at once: the loss of a plastic impact
                end = port.free_gap_rate + port.rate_per_force * reply.force
                reply.dissipated = -0.5 * reply.force * port.dt * (port.gap_rate + end)
