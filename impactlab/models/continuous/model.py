"""The continuous rod, and the continuous beam: no mesh and no modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from impactlab.errors import PairingError
from impactlab.models.base import AbstractRodModel, Face
from impactlab.models.continuous.base import MODES, AbstractSelfStepping
from impactlab.models.continuous.delay_chain import DelayChain
from impactlab.models.continuous.delay_line import DelayLine
from impactlab.models.continuous.infinite_beam import InfiniteBeam
from impactlab.models.continuous.timoshenko import TimoshenkoWaves
from impactlab.scene.bodies import Beam, ElasticBody, WaveBody
from impactlab.types import option


@final
@dataclass(frozen=True)
class Continuous(AbstractRodModel):
    """Exact travelling waves (continuous), without a mesh: rods from event to event, beams by characteristics.

    Rods under hard contacts, constant springs and, without a step, laws that are linear between changes of branch are
    solved from event to event. Under other laws a rod is delays between its ends, the ends of its segments and the
    places of its contacts, which are evaluated in each step. A Timoshenko beam steps too, its two families of waves
    each shifted exactly (`timoshenko`). An Euler-Bernoulli beam has no fronts and is supported where it is infinite, by
    its exact memory at the place where it is struck (`infinite_beam`).

    Where it steps, ``points_per_period`` counts the period of mode d of the uniform body, d = ``modes``, else
    ``elements``, else 100: the step of a modal model with as many. A run without steps ignores both, with a warning.

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

    examples = ({}, {"modes": 40}, {"elements": 60})

    modes: int | None = option(
        None, at_least=1, at_most=100_000, description="mode whose period points_per_period counts; default elements"
    )
    elements: int | None = option(
        None, at_least=1, at_most=100_000, description="the same where modes is not given; default 100"
    )

    @property
    def counted(self) -> int:
        """Number of the mode whose period ``points_per_period`` counts."""
        return self.modes or self.elements or MODES

    @property
    def has_mesh(self) -> bool:
        return False

    def element_length(self, body: ElasticBody) -> float:
        """Return L/100 [m]: the scale of relative contact stiffnesses, as there is no mesh."""
        return body.length / 100.0

    def build(self, rod: WaveBody, gravity: float, faces: tuple[Face, ...] = ()) -> AbstractSelfStepping:
        """Return a rod as a delay line or a chain of them.

        One delay line describes a uniform rod without gravity that is struck at its ends; a chain describes any other.
        """
        if gravity != 0.0 or len(rod.segments) > 1 or any(rod.is_inner(face.x) for face in faces):
            return DelayChain(rod, gravity, faces, self.counted)
        return DelayLine(rod, gravity, self.counted)

    def build_beam(self, beam: Beam, gravity: float, faces: tuple[Face, ...] = ()) -> AbstractSelfStepping:
        """Return a Timoshenko beam in its characteristics, an infinite Euler-Bernoulli beam by its memory."""
        if beam.theory == "timoshenko":
            return TimoshenkoWaves(beam, gravity, faces, modes=self.counted)
        if self.modes is not None or self.elements is not None:
            raise PairingError(
                f"the continuous Euler-Bernoulli beam '{beam.name}' is infinite, and has neither modes nor elements",
                remedy="Leave modes and elements out; give step: {dt: ...}, or theory: timoshenko.",
                path=f"solve.models.{beam.name}",
            )
        return InfiniteBeam(beam, gravity, faces)
