"""Faces that a force moves against itself by a step's end.

They occur on strongly damped meshes under some schemes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from impactlab.contact.base import AbstractContactLaw
from impactlab.errors import CaseError
from impactlab.history.base import Warned
from impactlab.integrators.base import AbstractIntegrator
from impactlab.plugins import kind_of
from impactlab.scene.problem import Scene
from impactlab.simulate.planning.preparation import BuiltBody
from impactlab.stepper import Stepper

REMEDY = "Give a smaller step, or integrator midpoint, moreau_jean or generalised_alpha."


def check_faces(
    scene: Scene,
    laws: Mapping[str, AbstractContactLaw],
    built: Mapping[str, BuiltBody],
    steppers: Mapping[str, Stepper],
    integrator: AbstractIntegrator,
    dt: float,
) -> list[Warned]:
    """Return warnings of damped bodies whose face a force moves against itself.

    Raises `CaseError` where no force opens a contact. Forces that act beside the accelerations move a face by F dt^2/2
    over its mass, traced back to the start of the step. Dampers that are fast beside the step take the velocity from
    it, and under some weights more than that: the displacement left over then has the wrong sign. Where that of both
    faces together has, no force opens the gap, and a constraint finds none: the bodies pass through each other.
    """
    damped = {
        name
        for name, stepper in steppers.items()
        if stepper.losses is not None and np.count_nonzero(built[name].system.damping)
    }
    warnings: dict[str, Warned] = {}
    for number, contact in enumerate(scene.contacts) if damped else ():
        opens, against = 0.0, []
        for point, place in zip(contact.faces, scene.places[number], strict=True):
            if (stepper := steppers.get(point.body)) is None or not len(stepper.face_rows):
                continue
            moved = float(stepper.force_response[place, : stepper.jump.shape[1]] @ stepper.face_rows[place])
            opens += moved
            if moved < 0.0 and point.body in damped:
                against.append(point)
        if not against:
            continue
        text = (
            f"in a step of {dt:.6g} s, which is long beside the decay time of '{against[0].body}', "
            f"{kind_of(integrator)} moves the face {against[0].label} against the force on it"
        )
        if opens < 0.0 and laws[contact.name].hard:
            raise CaseError(
                f"{text}, by more than the other face of {contact.name} moves with it: no contact force "
                "can open a gap there",
                remedy=REMEDY,
                path="solve.step",
            )
        warnings.setdefault(
            against[0].label, Warned("coarse_contact", f"{text}; the displacement there is wrong. {REMEDY}")
        )
    return list(warnings.values())
