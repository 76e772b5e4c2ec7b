"""The contact element: a spring and a dashpot between the faces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.relative import in_si
from impactlab.errors import PairingError
from impactlab.numerics.compiling import UNPACK
from impactlab.types import Level, Port, PowerForce, Relative, Reply, SideFacts, Start, option

# Share of the overlap at the end of a step that the dashpot may take away in an explicit scheme. It slows faces and
# parts none; with a third left, faces on meshes part in no later step, either.
MAX_CLOSED = 2.0 / 3.0
MIN_OVERLAP, MIN_COMPLIANCE = 1e-300, 1e-300  # m and m/(N s), to divide by


@UNPACK
def early_share(port: Port) -> float:
    """Return the share of a step from an early touch to its middle.

    It is 0 without a touch in the first half of the step. In an explicit scheme the force at the start of a step stands
    for half of the step before and half of the step itself: the share is the time that a dashpot is closed in it. If
    the dashpot acted from the next step only, its force would be up to half too large.
    """
    gap, free_gap = port.gap, port.free_gap
    if gap < 0.0 or free_gap >= 0.0:
        return 0.0
    return max(0.0, free_gap / (free_gap - gap) - 0.5)


@UNPACK
def lost_while_closed(port: Port, damping: float, force: float, end: float) -> float:
    """Return the energy that a dashpot takes in a step whose force is that at its end [J].

    The rate is linear over the time in which the faces are closed. A dashpot that stops them within a fraction of the
    step takes their kinetic energy, of about half the mass that the rate at the end shows: force is still to come.
    """
    before, rate = port.gap_rate, port.acting_rate + port.acting_rate_per_force * force
    share = 1.0 if port.gap < 0.0 else end / min(end - port.gap, -MIN_OVERLAP)
    most = 0.25 * before * before * port.dt / max(port.acting_rate_per_force, MIN_COMPLIANCE)
    return min(damping * (before * before + before * rate + rate * rate) / 3.0 * share * port.dt, most)


@final
@dataclass(frozen=True)
class Penalty(AbstractContactLaw):
    """Contact element (penalty): a Kelvin-Voigt spring and dashpot that never pull.

    F = k d + c d' with the penetration d where the force acts, solved with the compliance of the bodies: any stiffness
    is stable under an implicit scheme. On a massless face the spring is in series with its flexibility. In the step of
    a touch the dashpot gives the impulse c times the penetration at its end, which keeps the order of the scheme. In
    an explicit scheme it gives shares of its force in the two steps around a touch, and never parts the faces.

    References
    ----------
    EscalonaMayoDominguez1999, Section 1 ("contact element technique").
    """

    needs = frozenset({Level.POSITION, Level.VELOCITY})
    zero_apart = True
    citations = ("EscalonaMayoDominguez1999",)
    examples = ({}, {"stiffness": Relative(3.0), "damping": Relative(0.5)})
    smooth = True
    moves_faces = True

    stiffness: float | Relative = option(
        Relative(1.0), unit="N/m", above=0.0, description="spring; relative to EA/h, the smaller of two rods"
    )
    damping: float | Relative = option(
        0.0, unit="N s/m", at_least=0.0, description="dashpot; relative to the impedance Z, the smaller of two rods"
    )

    @property
    def force_jumps(self) -> bool:
        return (self.damping.relative if isinstance(self.damping, Relative) else self.damping) > 0.0

    def spring(self, left: SideFacts, right: SideFacts, dt: float) -> tuple[float, float]:
        rods = [facts for facts in (left, right) if facts.kind == "rod"]
        stiffness = in_si(self.stiffness, "stiffness", [rod.element_stiffness for rod in rods])
        damping = in_si(self.damping, "damping", [rod.impedance for rod in rods])
        flexibility = left.flexibility + right.flexibility
        if flexibility > 0.0 and damping > 0.0:
            text = "the dashpot of penalty needs faces with mass"
            raise PairingError(text, remedy="Give damping: 0, or mass: lumped.", path="damping")
        return 1.0 / (1.0 / stiffness + flexibility), damping

    def acting(self, left: SideFacts, right: SideFacts) -> Penalty:
        return self

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        stiffness, damping = self.spring(left, right, dt)
        flexible = (left.flexibility + right.flexibility) * stiffness
        return Start(parameters=(stiffness, damping, flexible), memory=(0.0,))

    def power_force(self, start: Start) -> PowerForce | None:
        stiffness, damping, flexible = start.parameters
        return PowerForce(stiffness, 1.0) if damping == 0.0 and flexible == 0.0 else None

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        stiffness, damping, weight = port.parameters[0], port.parameters[1], port.first_weight
        gap, free_gap, compliance = port.gap, port.free_gap, port.gap_per_force
        averaged = port.averaged != 0.0
        explicit = not averaged and port.acting_gap_per_force == 0.0
        early = early_share(port) if explicit and damping > 0.0 else 0.0
        if not explicit:
            damping *= weight
        elif early > 0.0:
            weight = early
        spring, dash = stiffness * port.acting_gap_per_force, damping * port.acting_rate_per_force
        # Spring and dashpot as if they could also pull: a linear equation, whose sign dates the opening.
        overlapping = stiffness * (port.acting_gap if early == 0.0 else 0.0)
        force = -(overlapping + damping * port.acting_rate) / (1.0 + spring + dash)
        if explicit and weight != 1.0:
            # A share of the force that the dashpot has in a whole step, not the force of a share of the dashpot: a face
            # whose mass is that of half an element then moves as far as it does under the wave that the force sends.
            force -= (1.0 - weight) * (force + overlapping)
        if explicit and compliance > 0.0 > free_gap and force + overlapping > 0.0:
            force = min(force, max(-overlapping, -MAX_CLOSED * free_gap / compliance))
        reply.trial = force
        end = free_gap + compliance * force
        if averaged and free_gap < 0.0 <= gap:
            # The faces meet within the step: force times travel is the energy of the spring, and the dashpot gives c
            # times the penetration at the end. (1 + dash + spring) end^2 - b end + (free gap) gap = 0.
            square, b = 1.0 + dash + spring, free_gap + gap + dash * gap
            end = (b - math.sqrt(b * b - 4.0 * square * free_gap * gap)) / (2.0 * square)
            force = reply.trial = (end - free_gap) / compliance
        elif averaged and end > 0.0:
            # They part within the step: the spring gives all of its energy, and the dashpot acts to the end.
            square, b = 1.0 + dash, free_gap + gap + 2.0 * dash * gap
            constant = free_gap * gap + (dash - spring) * gap * gap
            end = (b + math.sqrt(max(0.0, b * b - 4.0 * square * constant))) / (2.0 * square)
            force = (end - free_gap) / compliance
        elif not explicit and end > 0.0:
            force, end = -free_gap / compliance, 0.0  # a dashpot stops a touch, no more
        if force > 0.0 and (port.first_gap < 0.0 or port.last_gap < 0.0 or early > 0.0):
            last = gap if explicit else end  # where the force ceases to act
            reply.force = force
            reply.in_contact = 1.0 if last <= 0.0 or early > 0.0 else 0.0
            reply.stored = 0.5 * stiffness * min(last, 0.0) * min(end, 0.0)
            reply.offset = -port.parameters[2] * min(end, 0.0)
            travel = port.free_travel + port.travel_per_force * force
            if averaged and gap >= 0.0:
                reply.dissipated = damping * end * travel / port.dt
            elif explicit:
                reply.dissipated = max(0.0, -(force + overlapping) * travel)
            elif averaged:
                rate = port.acting_rate + port.acting_rate_per_force * force
                reply.dissipated = max(0.0, damping * rate * travel)
            else:  # only faces in contact move the dashpot
                reply.excess = max(0.0, 1.0 - 1.0 / weight) * (force + stiffness * end)
                reply.dissipated = lost_while_closed(port, damping / weight, force, end)
        elif averaged or explicit or damping > 0.0:
            # Let go before it is relaxed: the dashpot takes the energy that the spring gives as it follows the face. A
            # spring alone that is let go of between two ends of steps is an error of the scheme.
            reply.stored = 0.5 * stiffness * min(free_gap, 0.0) * min(gap if explicit else free_gap, 0.0)
            reply.dissipated = max(0.0, port.memory[0] - reply.stored)
        reply.memory[0] = reply.stored
