"""Bodies that a scene has in common with the one before it.

They keep their matrices, and steps of the same length. Runs of a sweep, a fit or a sensitivity differ in a few numbers,
mostly of one body, of a law or of the step. All that the description of a body follows from is compared by value, so a
body that is not built again has the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import NamedTuple

from impactlab.integrators.base import AbstractIntegrator
from impactlab.models.base import AbstractRodModel, Face
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.scene.method import Method
from impactlab.scene.problem import Scene
from impactlab.simulate.planning.preparation import BuiltBody, faces_of
from impactlab.stepper import Stepper

MAX_COMPARED = 100  # bodies of a scene: of more, as in rows of beads, like ones share their matrices in any case


class KnownBodies(NamedTuple):
    """Bodies of a plan, and all that they follow from."""

    scene: Scene
    models: Mapping[str, AbstractRodModel]
    built: Mapping[str, BuiltBody]
    integrator: AbstractIntegrator | None
    dt: float | None  # s
    steppers: Mapping[str, Stepper]  # none where contacts push or press their bodies at t = 0

    def same(self, scene: Scene, method: Method) -> dict[str, BuiltBody]:
        """Return the bodies of another scene that are built already."""
        known = self.scene
        alike = scene.gravity == known.gravity and scene.duration == known.duration
        if not alike or len(scene.bodies) > MAX_COMPARED:
            return {}
        found: dict[str, BuiltBody] = {}
        for name, body in scene.bodies.items():
            built, model = self.built.get(name), method.models.get(name)
            if built is None or body.changes or isinstance(built.model, AbstractSelfStepping):
                continue
            if body != built.body or model != self.models.get(name):
                continue
            if faces_read(scene, name, model) == faces_read(known, name, model):
                found[name] = built._replace(body=body)
        return found

    def has_all_of(self, built: Mapping[str, BuiltBody]) -> bool:
        """Return whether all bodies of a plan that deform are taken over from here."""
        elastic = ((name, body) for name, body in built.items() if body.body.elastic is not None)
        return all(name in self.built and self.built[name].model is body.model for name, body in elastic)

    def same_steppers(self, same: Collection[str], integrator: AbstractIntegrator, dt: float) -> dict[str, Stepper]:
        """Return the steppers of bodies that are the ``same``.

        They are for a scheme and a step [s] without pushed rows.
        """
        if integrator != self.integrator or dt != self.dt:
            return {}
        return {name: self.steppers[name] for name in same if name in self.steppers}


def faces_read(scene: Scene, body: str, model: AbstractRodModel | None) -> tuple[Face, ...]:
    """Return the faces of a body as its model reads them.

    The masses of partners are left out where the model does not read them.
    """
    faces = faces_of(scene, body)
    if model is not None and model.reads_partners:
        return faces
    return tuple(face._replace(partner_mass=math.nan) for face in faces)
