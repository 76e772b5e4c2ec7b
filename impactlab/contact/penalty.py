"""The contact element: a spring and a dashpot between the faces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

from impactlab.contact.base import AbstractContactLaw
from impactlab.errors import PairingError
from impactlab.types import Level, Relative, SideFacts, Start, option


@final
@dataclass(frozen=True)
class Penalty(AbstractContactLaw):
    """Contact element (penalty): a Kelvin-Voigt spring and dashpot that never pull.

    F = k d + c d' with the penetration d where the scheme's force acts, solved with the compliance of the bodies, so
    that any stiffness is stable under an implicit scheme. Stored and lost energy are those of the same step.

    References
    ----------
    EscalonaMayoDominguez1999, Section 1 ("contact element technique").
    """

    needs = frozenset({Level.POSITION, Level.VELOCITY})
    citations = ("EscalonaMayoDominguez1999",)

    stiffness: float | Relative = option(
        Relative(1.0), unit="N/m", above=0.0, description="spring; relative to EA/h, the smaller of two rods"
    )
    damping: float | Relative = option(
        0.0, unit="N s/m", at_least=0.0, description="dashpot; relative to the impedance Z, the smaller of two rods"
    )

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
        return values[0], values[1]

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start(parameters=self.spring(left, right, dt), memory=(0.0,))

    @staticmethod
    def respond(port: Any, reply: Any) -> None:
        stiffness, damping = port.parameters[0], port.parameters[1]
        if port.load_point == 0.0:
            # The force acts at the start of the step; the rates of its two half steps straddle it.
            gap, gap_yield = port.gap, 0.0
            rate = 0.5 * (port.gap_rate + port.free_gap_rate)
            rate_yield = 0.5 * port.rate_per_force
        else:
            gap, gap_yield = 0.5 * (port.gap + port.free_gap), 0.5 * port.gap_per_force
            rate, rate_yield = (port.free_gap - port.gap) / port.dt, port.gap_per_force / port.dt
        reply.trial = -(stiffness * gap + damping * rate) / (1.0 + stiffness * gap_yield + damping * rate_yield)
        reply.dissipated = port.memory[0]  # a spring that is let go of gives nothing back
        if reply.trial > 0.0 and gap + gap_yield * reply.trial < 0.0:
            rate += rate_yield * reply.trial
            gap_end = port.free_gap + port.gap_per_force * reply.trial
            gap_other = port.gap if port.load_point == 0.0 else gap_end
            reply.force = reply.trial
            reply.in_contact = 1.0
            reply.stored = 0.5 * stiffness * gap_other * gap_end
            reply.dissipated = damping * rate * rate * port.dt
            reply.memory[0] = reply.stored
        else:
            reply.memory[0] = 0.0
