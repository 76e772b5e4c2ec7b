"""Relative errors of the quantities that a tolerance bounds, from errors of the contacts of a run."""

from __future__ import annotations

import math

import numpy as np

from impactlab.contact.power_law import AbstractHystereticLaw, Hertz
from impactlab.history.base import AbstractHistory
from impactlab.history.frame import touched_in
from impactlab.metrics.peaks import MIN_PEAK
from impactlab.refine.descriptions.contact_times import times_of
from impactlab.refine.errors.distances import MIN_IMPULSE, counted
from impactlab.refine.errors.error_equation import ContactError
from impactlab.refine.errors.moving_frames import CELLS, moving_frames, norm
from impactlab.refine.errors.raw_records import Records
from impactlab.scene.method import Simulation, laws_of
from impactlab.types import Array

OF_IMPULSE = 0.1  # of the errors of a force, that of their sum at least: they may cancel by luck


def laws_in(request: Simulation) -> Array:
    """Return stiffness, exponent and hysteresis a v0 of the laws, shape (contacts, 3)."""
    found, times = [], times_of(*request)
    for contact, law in zip(request.scene.contacts, laws_of(*request), strict=True):
        if isinstance(law, Hertz | AbstractHystereticLaw):
            hysteresis = law.hysteresis() if isinstance(law, AbstractHystereticLaw) else 0.0
            found.append((law.stiffness, law.exponent, hysteresis))
        else:
            found.append((times[contact.name].tangent, 1.0, 0.0))
    return np.array(found)


def largest_error(history: AbstractHistory, request: Simulation, records: Records, found: list[ContactError]) -> float:
    """Return the largest relative error of a quantity that a tolerance bounds."""
    shown = {
        "displacements": _of_displacements(history, request, records, found),
        "impulses": _of_impulses(found),
        "peak_forces": _of_peaks(found),
    }
    return max(shown[name] for name in counted(request)[2])


def _of_displacements(
    history: AbstractHistory, request: Simulation, records: Records, found: list[ContactError]
) -> float:
    """Return the largest relative error of the displacement of a face."""
    scene, largest = request.scene, 0.0
    moving = moving_frames(scene, touched_in(history))
    for number, (contact, each) in enumerate(zip(scene.contacts, found, strict=True)):
        moved_by = records.force(number, hard=False).moved(CELLS)
        for point, moved, error in zip(contact.faces, moved_by, (each.left, each.right), strict=True):
            body = scene.bodies[point.body]
            if body.moves and error > 0.0:
                size = norm(moved - moving.drift(body.face_channel(point.x)))
                largest = max(largest, math.sqrt(CELLS) * error / max(size, 1e-300))
    return largest


def _of_impulses(found: list[ContactError]) -> float:
    """Return the largest relative error of the impulse of a contact."""
    least = MIN_IMPULSE * max(each.given for each in found)
    given = [each for each in found if each.given > least]
    return max(((abs(each.impulse) + OF_IMPULSE * each.total) / each.given for each in given), default=0.0)


def _of_peaks(found: list[ContactError]) -> float:
    """Return the largest relative error of the peak force of a contact."""
    least = MIN_PEAK * max(each.peak for each in found)
    return max(((each.near_peak + each.reading) / each.peak for each in found if each.peak > least), default=0.0)
