"""The soil of pile driving: elastic and plastic, with a dashpot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, final

from impactlab.contact import hysteresis
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.branches import one_sided, yielding
from impactlab.types import Branches, Level, SideFacts, Start, option


@final
@dataclass(frozen=True)
class Smith(AbstractContactLaw):
    """Smith's soil: a static resistance that yields after the quake, and a dashpot.

    Static part Rs = (Ru/Q)(d - set), held between -Ru and Ru; a toe (``tension: false``) between 0 and Ru, and where it
    has lost touch its hole stays. Dashpot J |Rs| v (``rule: smith``) or J Ru v (``rule: viscous``), which acts while
    pile and soil touch. The source prints Rs (1 + J v), which would give energy where a shaft moves upwards: there both
    Rs and v are negative.

    References
    ----------
    Smith1960.
    """

    needs = frozenset({Level.POSITION, Level.VELOCITY})
    citations = ("Smith1960",)
    examples = (
        {"capacity": 2e5, "quake": 2.5e-3, "damping": 0.2},
        {"capacity": 2e5, "quake": 2.5e-3, "damping": 0.5, "tension": False},
        {"capacity": 2e5, "quake": 1e-4, "damping": 0.5, "rule": "viscous", "set": 1e-4},
    )
    acts_at_start = True
    two_sided = True
    exact_remedy = "Give rule: viscous, or damping: 0"

    capacity: float = option(unit="N", above=0.0, description="Ru, largest static resistance")
    quake: float = option(unit="m", above=0.0, description="Q, displacement at which it yields")
    damping: float = option(0.0, unit="s/m", at_least=0.0, description="J of the dashpot")
    rule: Literal["smith", "viscous"] = option(
        "smith", description="dashpot J |Rs| v with the static part (smith), or J Ru v with the capacity (viscous)"
    )
    tension: bool = option(True, description="false: a toe, which never pulls")
    set: float = option(0.0, unit="m", description="permanent displacement at t = 0")

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        capacity = self.capacity if self.rule == "viscous" else 0.0
        parameters = (
            self.capacity / self.quake, self.capacity, 0.0, -self.capacity, 0.0, 0.0,
            0.0 if self.tension else 1.0, self.damping, capacity, 0.0,
        )  # fmt: skip
        return Start(parameters=parameters, memory=(self.set, 0.0, 0.0))

    @property
    def pulls(self) -> bool:
        return self.tension

    def branches(self) -> Branches | None:
        """Return its branches; None with a dashpot J |Rs| v, which is no linear one."""
        if self.rule == "smith" and self.damping > 0.0:
            return None
        made = yielding if self.tension else one_sided
        return made(self.capacity / self.quake, self.capacity, 0.0, self.damping * self.capacity, self.set)

    def stiffest(self, left: SideFacts, right: SideFacts, dt: float) -> float:
        return self.capacity / self.quake

    def divided(self, pieces: float) -> Smith:
        return replace(self, capacity=self.capacity / pieces)

    def set_of(self, memory: Sequence[float]) -> float:
        return memory[hysteresis.SET]

    respond = staticmethod(hysteresis.respond)
