"""Identification of dispersive waves on rods and beams: the general form of the 1999 paper's law."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw
from impactlab.types import Level, Port, Reply, SideFacts, Start, option


@final
@dataclass(frozen=True)
class DispersiveIdentification(AbstractContactLaw):
    """Identification of dispersive waves by the free motion of the faces over the step.

    All waves that reach a face within the step, of any speed, are in the velocity V that it would have at the end
    of the step without contact. Y is the velocity of the face per unit force of the step, over modes the sum of
    phi_i^2 sin(w_i dt)/w_i. One balance gives F = (V_left - V_right)/(Y_left + Y_right), never negative; masses and
    walls enter by their own V and Y. ``residual`` adds the static compliance r of the modes left out: then Y grows by
    r/dt and r F_old/dt is added to the numerator, and r (F - F_old)^2/2 a step is booked as unresolved. The energy
    lost as both faces take one velocity is booked as lost in the contact. For a uniform rod with all its modes V is
    the reading of one messenger and Y is 1/Z: the law of the source. Positions are not tied: a slight penetration
    belongs to it.

    References
    ----------
    EscalonaMayoDominguez1999, Section 4, whose last paragraph proposes a messenger per mode; the general form is ours.
    """

    needs = frozenset({Level.VELOCITY})
    zero_apart = True
    citations = ("EscalonaMayoDominguez1999",)
    hard = True
    trial_at_end = True
    gains_energy = 0.2  # measured: one element 0.14, one mode 0.035, ten modes 0.020 (docs/dispersive-waves.md)
    examples = ({}, {"residual": False})

    residual: bool = option(True, description="add the static compliance of the modes left out")

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        # Of a complete basis the residual is rounding, of either sign.
        compliance = max(0.0, left.left_out) + max(0.0, right.left_out)
        return Start(parameters=(compliance if self.residual else 0.0,), memory=(0.0, 0.0))

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        residual, before = port.parameters[0] / port.dt, port.memory[0]
        pressed = port.parameters[0] * before  # m, by how much the faces stand beyond their modes
        reply.trial = (residual * before - port.free_gap_rate) / (port.rate_per_force + residual)
        now = 0.0
        if (port.in_contact > 0.0 or port.gap + pressed <= 0.0) and reply.trial > 0.0:
            reply.force = now = reply.trial
            reply.in_contact = 1.0
            # The faces take one velocity within the step: force times travel is lost, except the part in the
            # residual. A step in which the force works in the other direction is set against the losses after it.
            travel = port.free_travel + port.travel_per_force * now
            lost = port.memory[1] - now * (travel + port.parameters[0] * (now - before))
            reply.dissipated = max(0.0, lost)
            reply.memory[1] = min(0.0, lost)
        reply.unresolved = 0.5 * port.parameters[0] * (now - before) ** 2
        reply.stored = 0.5 * port.parameters[0] * now * now
        reply.offset = port.parameters[0] * now
        reply.memory[0] = now
