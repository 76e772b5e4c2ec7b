"""The continuous rod: no mesh, no modes, no time step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.errors import CaseError
from impactlab.models.base import AbstractDiscreteModel, AbstractRodModel, Face
from impactlab.scene import ElasticBody, Rod


@final
@dataclass(frozen=True)
class Continuous(AbstractRodModel):
    """Exact travelling waves (continuous): solved from event to event, no mesh and no time step.

    References
    ----------
    StVenant1883; TimoshenkoGoodier1951, longitudinal impact of bars; EscalonaMayoDominguez1999, Section 2.
    """

    steps = False
    citations = ("StVenant1883", "EscalonaMayoDominguez1999", "TimoshenkoGoodier1951")

    @property
    def has_mesh(self) -> bool:
        return False

    def element_length(self, body: ElasticBody) -> float:
        """Return L/100 [m]: the scale of relative contact stiffnesses, as there is no mesh."""
        return body.length / 100.0

    def build(self, rod: Rod, gravity: float, faces: tuple[Face, ...] = ()) -> AbstractDiscreteModel:
        raise CaseError(
            f"rod '{rod.name}': the continuous model has no coordinates to step",
            remedy="Use it for all rods of a scene, or give finite_element or modal.",
            path="solve.model",
        )
