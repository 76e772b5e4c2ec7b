"""Contact laws that test formulas of the paper as printed.

None of them is part of the package. Each is a small law in plain Python, for one rigid mass on the left of one rod.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, final

from impactlab.contact.base import AbstractContactLaw
from impactlab.types import Level, Port, Reading, Reply, SideFacts, Start


def messenger(right: SideFacts, dt: float, residual: bool) -> tuple[Reading, Reading]:
    """Return stress and velocity at point 1, at c dt from the face."""
    distance = right.wave_speed * dt
    return Reading("right", distance, "stress", left_out=residual), Reading("right", distance, "velocity")


def balance_constants(left: SideFacts, right: SideFacts, dt: float) -> tuple[float, float, float]:
    """Return rho c [Pa s/m], lam dt = (2 alpha/T) dt and the area [m2]."""
    return right.impedance / right.area, right.impedance / left.mass * dt, right.area


class AbstractPrinted(AbstractContactLaw):
    """Data of each before a run."""

    needs = frozenset({Level.VELOCITY})
    compiled = False
    hard = True
    trial_at_end = True
    gains_energy = float("inf")


@final
@dataclass(frozen=True)
class Equation15(AbstractPrinted):
    """Eq. 15 with its own memory of both waves.

    ``ends``: the stress that ends the contact, the whole stress (Eq. 13), or sI alone as Section 4 prints it.
    ``restart``: sI at a new touch, from the velocity of the mass and the arriving wave, or from Eq. 22 alone.
    """

    ends: Literal["stress", "new_wave"] = "stress"
    restart: Literal["whole", "printed"] = "whole"
    residual: bool = False

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start(
            parameters=(
                *balance_constants(left, right, dt),
                float(self.ends == "stress"),
                float(self.restart == "whole"),
            ),
            readings=messenger(right, dt, self.residual),
        )

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        rho_c, lam_dt, area, by_stress, whole = port.parameters[:5]
        wave_in = 0.5 * (port.readings[0] - rho_c * port.readings[1])  # Eq. 19
        if port.in_contact > 0.0:
            old_out, old_in = port.memory[0], port.memory[1]
        else:
            if port.gap > 0.0:
                return
            old_in = wave_in
            old_out = rho_c * port.left.velocity + (old_in if whole > 0.0 else 0.0)
        wave_out = (wave_in * (1.0 - lam_dt) - old_in + old_out) / (1.0 + lam_dt)
        reply.memory[0], reply.memory[1] = wave_out, wave_in
        stress = wave_out + wave_in
        reply.trial = area * (stress if by_stress > 0.0 else wave_out)
        if reply.trial > 0.0:
            reply.force = max(0.0, area * stress)
            reply.in_contact = 1.0


@final
@dataclass(frozen=True)
class Equation20(AbstractPrinted):
    """Eq. 20: Eq. 15 with the face velocity for old waves.

    The velocity is that of the previous step. ``face`` says where that velocity comes from: the modes of the rod, or
    the balance itself (Eq. 21).
    """

    face: Literal["modes", "balance"] = "modes"
    residual: bool = False

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start(
            parameters=(*balance_constants(left, right, dt), float(self.face == "modes")),
            readings=messenger(right, dt, self.residual),
        )

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        rho_c, lam_dt, area, from_modes = port.parameters[:4]
        wave_in = 0.5 * (port.readings[0] - rho_c * port.readings[1])
        if port.in_contact > 0.0:
            face_velocity = port.right.velocity if from_modes > 0.0 else port.memory[0]
        else:
            if port.gap > 0.0:
                return
            face_velocity = port.left.velocity
        wave_out = (wave_in * (1.0 - lam_dt) + rho_c * face_velocity) / (1.0 + lam_dt)
        reply.memory[0] = (wave_out - wave_in) / rho_c  # Eq. 21
        reply.trial = area * (wave_out + wave_in)
        if reply.trial > 0.0:
            reply.force = reply.trial
            reply.in_contact = 1.0
