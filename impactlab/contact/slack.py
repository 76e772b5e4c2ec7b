"""Joint with play: it presses at once, and pulls after the play is used."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

from impactlab.contact import hysteresis
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.branches import joint
from impactlab.types import Branches, Level, SideFacts, Start, option


@final
@dataclass(frozen=True)
class Slack(AbstractContactLaw):
    """Joint or splice with play: k d in compression, k (d + slack) in tension.

    In tension the faces are farther apart than the slack; within it no force acts.

    References
    ----------
    Smith1960 (joints with slack between the parts of a pile); Gonzalez1996 (the force as a discrete gradient).
    """

    needs = frozenset({Level.POSITION, Level.VELOCITY})
    citations = ("Smith1960", "Gonzalez1996")
    examples = ({"stiffness": 1e9}, {"stiffness": 1e9, "slack": 1e-5})
    acts_at_start = True
    two_sided = True

    stiffness: float = option(unit="N/m", above=0.0, description="k of the joint")
    slack: float = option(0.0, unit="m", at_least=0.0, description="play before it pulls")

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start(parameters=hysteresis.elastic(self.stiffness, self.slack), memory=(0.0, 0.0, 0.0))

    def branches(self) -> Branches:
        return joint(self.stiffness, self.slack)

    def stiffest(self, left: SideFacts, right: SideFacts, dt: float) -> float:
        return self.stiffness

    def divided(self, pieces: float) -> Slack:
        return replace(self, stiffness=self.stiffness / pieces)

    respond = staticmethod(hysteresis.respond)
