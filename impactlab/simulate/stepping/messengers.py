"""Error of modal messengers against the free motion of the modes, checked before the first step."""

from __future__ import annotations

import numpy as np

from impactlab.errors import PairingError
from impactlab.history.base import Warned
from impactlab.models.messengers import miss
from impactlab.scene.problem import Scene
from impactlab.simulate.stepping.preparation import BuiltBody, face_read
from impactlab.types import Arriving, Start

ERROR_WARN = 0.01  # relative error of messengers against the free motion of the modes


def check_messengers(scene: Scene, built: dict[str, BuiltBody], starts: tuple[Start, ...]) -> list[Warned]:
    """Return warnings of messengers with a large error; raise `PairingError` beyond the law's limit."""
    warnings = []
    for number, (contact, start) in enumerate(zip(scene.contacts, starts, strict=True)):
        for reading in start.readings:
            if not isinstance(reading, Arriving):
                continue
            point = face_read(contact, reading)
            body = built[point.body]
            try:
                row = body.model.arriving(point.x, reading.delay, reading.speed)
            except PairingError as error:
                error.path = error.path or f"contacts.{number}.law"
                raise
            frequencies = np.sqrt(body.system.stiffness[0] / body.system.mass[0])
            missed = miss(row, body.model.row(point.x, "displacement"), frequencies, reading.delay)
            text = (
                f"the messengers of the modes of '{point.body}' give the motion of the face {point.label} in a step "
                f"with an error of {100.0 * missed:.3g} %"
            )
            if missed > reading.most:
                raise PairingError(
                    f"{text}; allowed are {100.0 * reading.most:.3g} %. The wave of a mode gives the motion of the "
                    "face only where the mode is one standing wave with its crest there, not at the tip of a beam, nor "
                    "from the stresses of a coarse mesh",
                    remedy="Use law dispersive_identification, analytic modes (without elements), or another accept.",
                    path=f"contacts.{number}.law",
                )
            if missed > ERROR_WARN:
                warnings.append(Warned("messengers_apart", text))
    return warnings
