"""A joint that yields in both directions and hardens kinematically."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import final

from impactlab.contact import hysteresis
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.branches import yielding
from impactlab.errors import CaseError
from impactlab.types import Branches, Level, SideFacts, Start, option


@final
@dataclass(frozen=True)
class ElasticPlastic(AbstractContactLaw):
    """Elastic-plastic joint: F = k (d - set), limited by the yield force.

    |F - H set| is never above the yield force. Kinematic hardening: once it yields, the force rises with the tangent
    stiffness k_t, so H = k k_t/(k - k_t), and the elastic range moves with the set.

    References
    ----------
    Prager1956.
    """

    needs = frozenset({Level.POSITION, Level.VELOCITY})
    citations = ("Prager1956",)
    examples = ({"stiffness": 1e9, "yield_force": 2e4}, {"stiffness": 1e9, "yield_force": 2e4, "hardening": 2e8})
    acts_at_start = True
    two_sided = True

    stiffness: float = option(unit="N/m", above=0.0, description="k, elastic")
    yield_force: float = option(unit="N", above=0.0, description="force at which it yields first")
    hardening: float = option(0.0, unit="N/m", at_least=0.0, description="tangent stiffness once it yields, below k")

    def __post_init__(self) -> None:
        if self.hardening >= self.stiffness:
            raise CaseError(
                f"{self.hardening:g} N/m is not below the stiffness {self.stiffness:g} N/m",
                remedy="Give the tangent stiffness of the yielding joint, less than the elastic one.",
                path="hardening",
            )

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        rise = self.stiffness * self.hardening / (self.stiffness - self.hardening)
        parameters = (self.stiffness, self.yield_force, rise, -self.yield_force, rise, rise, 0.0, 0.0, 0.0, 0.0)
        return Start(parameters=parameters, memory=(0.0, 0.0, 0.0))

    def branches(self) -> Branches:
        return yielding(self.stiffness, self.yield_force, self.hardening)

    def stiffest(self, left: SideFacts, right: SideFacts, dt: float) -> float:
        return self.stiffness

    def divided(self, pieces: float) -> ElasticPlastic:
        shares = {name: getattr(self, name) / pieces for name in ("stiffness", "yield_force", "hardening")}
        return replace(self, **shares)

    def set_of(self, memory: Sequence[float]) -> float:
        return memory[hysteresis.SET]

    respond = staticmethod(hysteresis.respond)
