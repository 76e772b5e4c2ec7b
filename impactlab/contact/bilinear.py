"""Bilinear law of a cushion or a bit on rock, steeper as it unloads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from impactlab.contact import hysteresis
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.branches import cushion
from impactlab.errors import CaseError
from impactlab.types import Array, Branches, Level, SideFacts, Start, option


@final
@dataclass(frozen=True)
class Bilinear(AbstractContactLaw):
    """Cushion, or bit on rock: F = k d, steeper in unloading and reloading.

    It never pulls. The steeper line k_u passes through the deepest point so far; the faces part at the permanent
    indentation d (1 - k/k_u). Of the work of loading the share k/k_u = e^2 comes back.

    References
    ----------
    Smith1960 (cushions, with the restitution e); HustrulidFairhurst1971 (bit and rock, with gamma = k/k_u).
    """

    needs = frozenset({Level.POSITION, Level.VELOCITY})
    citations = ("Smith1960", "HustrulidFairhurst1971")
    examples = ({"stiffness": 1e9, "restitution": 0.8}, {"stiffness": 1e9, "unloading_stiffness": 1e9})
    acts_at_start = True
    fixed_step = True
    why_fixed = "meets the other face at its dent, and steps are cut where the gap is zero"

    stiffness: float = option(unit="N/m", above=0.0, description="k, on first loading")
    restitution: float | None = option(
        None, above=0.0, at_most=1.0, description="e: unloading has the stiffness k/e^2; this or unloading_stiffness"
    )
    unloading_stiffness: float | None = option(None, unit="N/m", above=0.0, description="k_u, at least k")

    def __post_init__(self) -> None:
        if (self.restitution is None) == (self.unloading_stiffness is None):
            given = "neither is given" if self.restitution is None else "both are given"
            text = f"restitution and unloading_stiffness define the same in two ways, and {given}"
            raise CaseError(text, remedy="Give one of the two.")
        if self.unloading_stiffness is not None and self.unloading_stiffness < self.stiffness:
            raise CaseError(
                f"{self.unloading_stiffness:g} N/m is below the stiffness {self.stiffness:g} N/m: it would give energy",
                remedy="Give at least the stiffness of loading, or restitution, which goes with every stiffness.",
                path="unloading_stiffness",
            )

    @property
    def unloading(self) -> float:
        """Stiffness of unloading [N/m]."""
        return self.unloading_stiffness or self.stiffness / (self.restitution or 1.0) ** 2

    def along(self, penetration: Array) -> tuple[Array, Array]:
        """Return force [N] and work [J] at a sequence of penetrations [m], shape (n,)."""
        deepest = np.maximum.accumulate(np.maximum(penetration, 0.0))
        stays = deepest * (1.0 - self.stiffness / self.unloading)
        force = np.maximum(self.unloading * (penetration - stays), 0.0)
        return force, 0.5 * (self.stiffness * deepest * stays + force**2 / self.unloading)

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start(parameters=hysteresis.cushion(self.stiffness, self.unloading), memory=(0.0, 0.0, 0.0))

    def branches(self) -> Branches:
        return cushion(self.stiffness, self.unloading)

    def stiffest(self, left: SideFacts, right: SideFacts, dt: float) -> float:
        return self.unloading

    def stiffness_at(self, overlap: float, left: SideFacts, right: SideFacts) -> float:
        return self.unloading

    def set_of(self, memory: Sequence[float]) -> float:
        return memory[hysteresis.SET]

    respond = staticmethod(hysteresis.respond)
