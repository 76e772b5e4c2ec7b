"""Spring and dashpot of Khulief and Shabana, damped to a given restitution.

The damping follows from the restitution and the masses of the bodies.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import final

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.penalty import Penalty
from impactlab.errors import PairingError
from impactlab.types import Level, Relative, Restitution, SideFacts, Start, option


@final
@dataclass(frozen=True)
class KhuliefShabana(AbstractContactLaw):
    """Khulief and Shabana: a spring and dashpot whose damping gives rigid bodies a given restitution.

    F = k d + c d', never pulling, with c from the energy balance of the whole contact of two rigid bodies with the mass
    m = m1 m2/(m1 + m2). Deviations from the source: the balance is solved exactly, up to the instant at which the force
    vanishes, so that the restitution holds for any damping; k is given, not found from a largest indentation; a
    flexible body counts with its whole mass and those at its ends (its waves take energy too, so it returns slower).

    References
    ----------
    KhuliefShabana1987 (spring and damper of a continuous force model, its constants from the energy balance).
    """

    needs = frozenset({Level.POSITION, Level.VELOCITY})
    zero_apart = True
    citations = ("KhuliefShabana1987",)
    smooth = True
    moves_faces = True
    examples = ({}, {"restitution": 0.5})

    stiffness: float | Relative = option(
        Relative(1.0), unit="N/m", above=0.0, description="spring; relative to EA/h, the smaller of two rods"
    )
    restitution: float = option(
        1.0, above=0.0, at_most=1.0, description="coefficient of restitution of rigid bodies of the same masses"
    )
    effective_mass: float | None = option(
        None, unit="kg", above=0.0, description="mass m that meets the contact; null: m1 m2/(m1 + m2) of the bodies"
    )

    @property
    def force_jumps(self) -> bool:
        return self.restitution < 1.0

    def spring(self, left: SideFacts, right: SideFacts, dt: float) -> tuple[float, float]:
        stiffness = Penalty(self.stiffness).spring(left, right, dt)[0]
        mass = self.effective_mass
        if mass is None:
            if "mechanism" in (left.kind, right.kind):
                raise PairingError(
                    "khulief_shabana needs one effective mass, and that of a mechanism changes with its position",
                    remedy="Give effective_mass in kg: the mass with which the rigid links meet the contact, combined "
                    "with that of the other body, m1 m2/(m1 + m2).",
                    path="effective_mass",
                )
            mass = 1.0 / (1.0 / left.mass + 1.0 / right.mass) if min(left.mass, right.mass) < math.inf else math.inf
        if mass == math.inf:
            raise PairingError(
                "neither body can move, so that there is no effective mass",
                remedy="Give effective_mass.",
                path="effective_mass",
            )
        return stiffness, 2.0 * damping_ratio(self.restitution) * math.sqrt(stiffness * mass)

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start(parameters=self.spring(left, right, dt), memory=(0.0,))

    def restitutions(self) -> Restitution:
        return Restitution(self.restitution, self.restitution)

    respond = staticmethod(Penalty.respond)


def logarithmic_loss(damping_ratio: float) -> float:
    """Return -ln e of a mass on a spring and dashpot that never pull.

    It is 2 zeta w0/w_d acos(zeta), beyond 1 with acosh.

    The force k d + c d' vanishes at w_d t = 2 acos(zeta), where the speed is exp(-zeta w0 t) of that of the approach.
    """
    zeta = damping_ratio
    if abs(zeta - 1.0) < 1e-4:  # the series of the same, which is smooth here
        return 2.0 - 4.0 / 3.0 * (1.0 - zeta) - 0.4 * (1.0 - zeta) ** 2
    if zeta < 1.0:
        return 2.0 * zeta * math.acos(zeta) / math.sqrt((1.0 - zeta) * (1.0 + zeta))
    return 2.0 * zeta * math.acosh(zeta) / math.sqrt((zeta - 1.0) * (zeta + 1.0))


@cache
def damping_ratio(restitution: float) -> float:
    """Return the damping ratio zeta of the spring and dashpot with this restitution, by bisection."""
    wanted = -math.log(restitution)
    low, high = 0.0, 1.0
    while logarithmic_loss(high) < wanted:
        high *= 2.0
    while low < (middle := 0.5 * (low + high)) < high:
        if logarithmic_loss(middle) < wanted:
            low = middle
        else:
            high = middle
    return low
