"""The continuous rod, and the continuous beam: no mesh and no modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.models.base import AbstractRodModel, Face
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.models.continuous.delay_chain import DelayChain
from impactlab.models.continuous.delay_line import DelayLine
from impactlab.models.continuous.infinite_beam import InfiniteBeam
from impactlab.models.continuous.timoshenko import TimoshenkoWaves
from impactlab.scene.bodies import Beam, ElasticBody, WaveBody


@final
@dataclass(frozen=True)
class Continuous(AbstractRodModel):
    """Exact travelling waves (continuous): rods from event to event, without mesh or step; beams by characteristics.

    Rods under hard contacts, constant springs and, without a step, laws that are linear between changes of branch are
    solved from event to event; under other laws a rod is delays between its ends, the ends of its segments and the
    places of its contacts, which are evaluated in each step. A Timoshenko beam steps too, its two families of waves
    each shifted exactly (`timoshenko`); an Euler-Bernoulli beam has no fronts and is supported where it is infinite, by
    its exact memory at the place where it is struck (`infinite_beam`).

    References
    ----------
    StVenant1883; TimoshenkoGoodier1951, longitudinal impact of bars; EscalonaMayoDominguez1999, Section 2;
    LeonardBudiansky1954 and Graff1975 (beams).
    """

    exact = True
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

    def build(self, rod: WaveBody, gravity: float, faces: tuple[Face, ...] = ()) -> AbstractSelfStepping:
        """Return a uniform rod without gravity struck at its ends as a pair of delays, any other as a chain of them."""
        if gravity != 0.0 or len(rod.segments) > 1 or any(rod.is_inner(face.x) for face in faces):
            return DelayChain(rod, gravity, faces)
        return DelayLine(rod, gravity)

    def build_beam(self, beam: Beam, gravity: float, faces: tuple[Face, ...] = ()) -> AbstractSelfStepping:
        """Return a Timoshenko beam in its characteristics, an infinite Euler-Bernoulli beam by its memory."""
        if beam.theory == "timoshenko":
            return TimoshenkoWaves(beam, gravity, faces)
        return InfiniteBeam(beam, gravity, faces)
