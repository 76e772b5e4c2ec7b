"""The contact element: a spring and a dashpot between the faces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from impactlab.contact.base import AbstractContactLaw
from impactlab.errors import PairingError
from impactlab.types import Level, Port, Relative, Reply, SideFacts, Start, option


@final
@dataclass(frozen=True)
class Penalty(AbstractContactLaw):
    """Contact element (penalty): a Kelvin-Voigt spring and dashpot that never pull.

    F = k d + c d' with the penetration d where the scheme's force acts, solved with the compliance of the bodies, so
    that any stiffness is stable under an implicit scheme. Stored and lost energy are those of the same step. On a
    massless face the spring stands in series with the face's flexibility.

    The dashpot's force jumps at a touch. In the step of the touch it is the penetration at the end of the step that
    gives the dashpot's impulse, c times that, so that the order of the scheme holds wherever the touch falls.

    References
    ----------
    EscalonaMayoDominguez1999, Section 1 ("contact element technique").
    """

    needs = frozenset({Level.POSITION, Level.VELOCITY})
    citations = ("EscalonaMayoDominguez1999",)
    is_spring = True
    serves_massless = True
    examples = ({}, {"stiffness": Relative(3.0), "damping": Relative(0.5)})
    smooth = True

    stiffness: float | Relative = option(
        Relative(1.0), unit="N/m", above=0.0, description="spring; relative to EA/h, the smaller of two rods"
    )
    damping: float | Relative = option(
        0.0, unit="N s/m", at_least=0.0, description="dashpot; relative to the impedance Z, the smaller of two rods"
    )

    @property
    def force_jumps(self) -> bool:
        given = self.damping.relative if isinstance(self.damping, Relative) else self.damping
        return given > 0.0

    def spring(self, left: SideFacts, right: SideFacts, dt: float) -> tuple[float, float]:
        rods = [facts for facts in (left, right) if facts.kind == "rod"]
        values = []
        for name, given, references in (
            ("stiffness", self.stiffness, [rod.element_stiffness for rod in rods]),
            ("damping", self.damping, [rod.impedance for rod in rods]),
        ):
            if isinstance(given, Relative):
                if not references:
                    raise PairingError(
                        f"{name} is relative to a rod, and this contact has none", remedy="Give it in SI.", path=name
                    )
                given = given.relative * min(references)
            values.append(given)
        stiffness, damping = values
        flexibility = left.flexibility + right.flexibility
        if flexibility > 0.0 and damping > 0.0:
            raise PairingError(
                "the dashpot of penalty needs faces with mass",
                remedy="Give damping: 0, or mass: lumped.",
                path="damping",
            )
        return 1.0 / (1.0 / stiffness + flexibility), damping

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        stiffness, damping = self.spring(left, right, dt)
        flexible = (left.flexibility + right.flexibility) * stiffness
        return Start(parameters=(stiffness, damping, flexible), memory=(0.0,))

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        stiffness, damping = port.parameters[0], port.parameters[1]
        reply.dissipated = port.memory[0]  # a spring that is let go of gives nothing back
        gap, free_gap, pliancy = port.gap, port.free_gap, port.gap_per_force
        if port.load_point == 0.0:
            # The force acts at the start of the step; the rates of its two half steps straddle it.
            rate, rate_pliancy = 0.5 * (port.gap_rate + port.free_gap_rate), 0.5 * port.rate_per_force
            dash = damping
            if port.in_contact == 0.0 and gap < 0.0 and 1.001 * port.gap_rate * port.dt <= gap:
                # The first force after a touch stands for the time since the touch, a step at most, and half a step.
                dash *= 0.5 + min(1.0, gap / (port.gap_rate * port.dt))
            reply.trial = -(stiffness * gap + dash * rate) / (1.0 + dash * rate_pliancy)
            if gap < 0.0 and reply.trial > 0.0:
                rate += rate_pliancy * reply.trial
                reply.force = reply.trial
                reply.in_contact = 1.0
                reply.stored = 0.5 * stiffness * gap * min(0.0, free_gap + pliancy * reply.force)
                reply.dissipated = dash * rate * rate * port.dt
                reply.offset = -port.parameters[2] * min(0.0, free_gap + pliancy * reply.force)
        elif port.load_point == 1.0:
            # The force is that of the penetration and its rate at the end of the step.
            dash = damping
            if port.in_contact == 0.0 and gap >= 0.0 and free_gap < 0.0:
                # The first force after a touch stands for the time since the touch and half a step more.
                dash *= 0.5 + free_gap / (free_gap - gap)
            pressed = stiffness * free_gap + dash * port.free_gap_rate
            reply.trial = -pressed / (1.0 + stiffness * pliancy + dash * port.rate_per_force)
            reply.dissipated = (
                0.0  # what a spring keeps that lets go between two ends of steps is an error of the scheme
            )
            if free_gap < 0.0 and reply.trial > 0.0:
                reply.force = min(reply.trial, -free_gap / pliancy)  # a dashpot stops a touch, no more
                end = min(0.0, free_gap + pliancy * reply.force)
                reply.in_contact = 1.0
                reply.stored = 0.5 * stiffness * end * end
                reply.offset = -port.parameters[2] * end
                reply.dissipated = max(0.0, (reply.force + stiffness * end) * (min(gap, 0.0) - end))
        elif gap < 0.0 or free_gap < 0.0:
            # Force times change of the gap is the change of the spring's energy, also where the gap passes through zero
            # within the step: (1 + s a) g^2 + b g + c = 0 for the gap g at the end.
            dash = damping * pliancy / port.dt
            spring = 0.5 * stiffness * pliancy
            square = 1.0 + dash + spring
            held = 0.0
            if gap >= 0.0:
                # The dashpot gives its force times the time since the touch: c times the penetration at the end.
                linear = -(free_gap + gap + dash * gap)
                end = (-linear - math.sqrt(linear * linear - 4.0 * square * free_gap * gap)) / (2.0 * square)
                reply.force = reply.trial = (end - free_gap) / pliancy
                reply.in_contact = 1.0
                reply.stored = 0.5 * stiffness * end * end
                # Force times way, less the energy of the spring.
                reply.dissipated = dash * end * (end - gap) / pliancy
                reply.offset = -port.parameters[2] * end
            else:
                # As if the spring also pulled: the answer that stays in contact is linear.
                end = (free_gap + (dash - spring) * gap) / square
                # The signed force dates the opening: that of a spring that could pull.
                reply.trial = -(0.5 * stiffness * (gap + end) + damping * (end - gap) / port.dt)
                if end > 0.0:
                    linear = -(free_gap + gap + 2.0 * dash * gap)
                    constant = free_gap * gap + dash * gap * gap - spring * gap * gap
                    square -= spring
                    end = (-linear + math.sqrt(max(0.0, linear * linear - 4.0 * square * constant))) / (2.0 * square)
                force = (end - free_gap) / pliancy
                if end < 0.0 and dash + spring < 1.0:
                    force = reply.trial  # the same, without the rounding of two gaps over a small compliance
                if force > 0.0:
                    reply.force = force
                    reply.in_contact = 1.0 if end < 0.0 else 0.0
                    held = min(end, 0.0)
                    reply.stored = 0.5 * stiffness * held * held
                    reply.dissipated = dash * (end - gap) ** 2 / pliancy
                    reply.offset = -port.parameters[2] * held
                else:
                    # Let go before it is relaxed: its dashpot takes up the energy that it gives as it follows the face.
                    reply.stored = 0.5 * stiffness * min(free_gap, 0.0) ** 2
                    reply.dissipated = max(0.0, port.memory[0] - reply.stored)
        reply.memory[0] = reply.stored
