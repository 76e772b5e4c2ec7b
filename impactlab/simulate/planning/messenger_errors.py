"""Errors of modal messengers against free modal motion, before the first step."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from impactlab.errors import PairingError
from impactlab.history.base import Warned
from impactlab.models.messengers import miss
from impactlab.scene.method import Method
from impactlab.scene.problem import Point, Scene
from impactlab.simulate.planning.preparation import BuiltBody, face_read, facts_of
from impactlab.stepper import Stepper
from impactlab.types import Arriving, Start

ERROR_WARN = 0.01  # relative error of messengers against the free motion of the modes
# Relative, of the velocity per force in a step, about 1/Z at most: in a round trip 2 l/c faces under F drift by up to
# twice that share of the rod's static deflection F l/(EA), as F/Z 2 l/c = 2 F l/(EA).
DRIFT_WARN = 1e-3


def _read(scene: Scene, starts: tuple[Start, ...]) -> Iterator[tuple[int, Arriving, Point]]:
    """Yield each reading of messengers, with contact number and face."""
    for number, (contact, start) in enumerate(zip(scene.contacts, starts, strict=True)):
        for reading in start.readings:
            if isinstance(reading, Arriving):
                yield number, reading, face_read(contact, reading)


def check_messengers(scene: Scene, built: dict[str, BuiltBody], starts: tuple[Start, ...]) -> list[Warned]:
    """Return warnings of messengers with a large error; raise `PairingError` beyond the law's limit."""
    warnings = []
    for number, reading, point in _read(scene, starts):
        body = built[point.body]
        try:
            row = body.model.arriving(point.x, reading.delay, reading.speed)
        except PairingError as error:
            error.path = error.path or f"contacts.{number}.law"
            raise
        frequencies = np.sqrt(body.system.stiffness[0] / body.system.mass[0])
        missed = miss(row, body.model.row(point.x, "displacement"), frequencies, reading.delay)
        text = (
            f"the messengers of the modes of '{point.body}' give the motion of the face {point.label} "
            f"in a step with an error of {100.0 * missed:.3g} %"
        )
        if missed > reading.most:
            raise PairingError(
                f"{text}. Allowed: {100.0 * reading.most:.3g} %. The wave of a mode gives the motion of "
                "the face only where the mode is one standing wave with its crest at the face: not at "
                "the tip of a beam, and not with stresses of a coarse mesh",
                remedy="Use law dispersive_identification, analytic modes (without elements), or another accept.",
                path=f"contacts.{number}.law",
            )
        if missed > ERROR_WARN:
            warnings.append(Warned("messengers_apart", text))
    return warnings


def check_step_of_face(
    scene: Scene,
    method: Method,
    built: Mapping[str, BuiltBody],
    steppers: Mapping[str, Stepper],
    starts: tuple[Start, ...],
) -> list[Warned]:
    """Return warnings where steps move a face unlike the law assumes.

    A law assumes the motion by free waves, or by a compliance. Under a constant force F the modes come to rest where
    the velocity by the waves, -F sum phi^2 sin(w dt)/w, and that by the force of the step cancel. A scheme whose step
    gives another velocity leaves a drift of the faces in contact.
    """
    warnings = []
    for number, reading, point in _read(scene, starts):
        body = built[point.body]
        mass, phase = body.system.mass[0], np.sqrt(body.system.stiffness[0] / body.system.mass[0]) * reading.delay
        phi = body.model.row(point.x, "displacement")
        waves = reading.delay * float(np.sum(phi**2 / mass * np.sinc(phase / np.pi)))
        left, right = facts_of(scene, method, built, steppers, number)
        stepped = (left if reading.side == "left" else right).velocity_per_force
        differs = abs(stepped / waves - 1.0)
        share = stepped / reading.compliance  # NaN where the law takes that of the step
        if abs(share - 1.0) > ERROR_WARN:
            text = (
                f"the law takes 1/Z for the velocity of the face {point.label} per force, but in this "
                f"step the modes of '{point.body}' give {share:.3g}/Z, so that the faces separate: give "
                "balance: modes"
            )
            warnings.append(Warned("messengers_apart", text))
        elif differs > DRIFT_WARN:
            text = (
                f"under a force, a step of the integrator moves the face {point.label} with a velocity "
                f"that differs by {100.0 * differs:.3g} % from that of the waves which the messengers of "
                f"'{point.body}' give: faces in contact drift, with any number of modes. exact_modal "
                "agrees with the waves"
            )
            warnings.append(Warned("messengers_apart", text))
    return warnings
