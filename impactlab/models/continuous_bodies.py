"""Which continuous body steps for itself under a scene that is not solved from event to event."""

from __future__ import annotations

from impactlab.errors import CaseError
from impactlab.models.base import Face
from impactlab.models.delay_line import DelayLine
from impactlab.models.infinite_beam import InfiniteBeam
from impactlab.models.self_stepping import AbstractSelfStepping
from impactlab.models.timoshenko_waves import TimoshenkoWaves
from impactlab.scene import Beam, ElasticBody, Rod, Scene


def continuous_body(scene: Scene, body: ElasticBody, faces: tuple[Face, ...]) -> AbstractSelfStepping:
    """Return a rod as two delays, a Timoshenko beam by its characteristics, an infinite Euler-Bernoulli beam."""
    if isinstance(body, Beam) and body.theory == "timoshenko":
        probes = tuple(probe for probe in (*scene.probes, *scene.loaded_ends) if probe.body == body.name)
        return TimoshenkoWaves(body, scene.gravity, faces, probes, scene.duration, bool(scene.snapshots))
    if isinstance(body, Beam):
        return InfiniteBeam(body, scene.gravity, faces)
    if isinstance(body, Rod):
        return DelayLine(body, scene.gravity)
    raise CaseError(f"no continuous description of the {body.kind} '{body.name}'", path=f"solve.models.{body.name}")
