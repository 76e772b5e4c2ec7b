"""The continuous rod, and the continuous beam: no mesh and no modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.errors import CaseError
from impactlab.models.base import AbstractDiscreteModel, AbstractRodModel, Face
from impactlab.scene import ElasticBody, Rod


@final
@dataclass(frozen=True)
class Continuous(AbstractRodModel):
    """Exact travelling waves (continuous): rods from event to event, without mesh or step; beams by characteristics.

    Rods under hard contacts and constant springs are solved from event to event; under other laws a rod is a pair of
    delays, which is asked step by step. A Timoshenko beam steps too, its two families of waves each shifted exactly
    (`timoshenko_waves`); an Euler-Bernoulli beam has no fronts and is served where it goes on for ever, by its exact
    memory at the place where it is struck (`infinite_beam`).

    References
    ----------
    StVenant1883; TimoshenkoGoodier1951, longitudinal impact of bars; EscalonaMayoDominguez1999, Section 2;
    LeonardBudiansky1954 and Graff1975 (beams).
    """

    steps = False
    citations = (
        "StVenant1883",
        "EscalonaMayoDominguez1999",
        "TimoshenkoGoodier1951",
        "LeonardBudiansky1954",
        "Graff1975",
    )

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
