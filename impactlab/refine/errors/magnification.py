"""Factors by which touches magnify the error of a run, also that of modes left out."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.history.frame import touched_in
from impactlab.refine.convergence import Level
from impactlab.refine.descriptions.description import Description
from impactlab.refine.errors.error_equation import EXPONENT, STIFFNESS, contact_errors
from impactlab.refine.errors.moving_frames import CELLS, moving_frames, norm
from impactlab.refine.errors.raw_records import Records, records_of
from impactlab.refine.errors.relative_errors import largest_error, laws_in
from impactlab.refine.errors.smooth_touch import stated_alone
from impactlab.scene.method import Simulation
from impactlab.types import Array

MAX_UNMAGNIFIED = 10.0  # error of a run over its predicted one, up to which touches are not taken to magnify it
MAX_SIZE = 0.3  # change of a force in a touch over this force, or of a gap that nearly closes over this gap
# Of that change, by which it may exceed the one that a shift gives at once: more in 1 of 200 random beams.
FOLLOWS = 10.0


def magnified_by_touches(description: Description, finest: Level, error: float) -> float:
    """Return the factor by which touches magnify an error.

    It is the error by the steps of a run over its predicted one. A difference between two runs of a beam grows with
    each touch, whether it comes from the steps or from modes left out. Runs with the same modes show only that from the
    steps.
    """
    touches = Counter(span.contact for span in finest.history.contacts)
    if not description.alike or not math.isfinite(error) or max(touches.values(), default=0) < 2:
        return 1.0
    return max(1.0, error / (MAX_UNMAGNIFIED * description.error(finest.fineness)))


def magnified_by_sensitive_touches(
    description: Description, history: AbstractHistory, request: Simulation, error: float
) -> float:
    """Return the factor by which later touches magnify an error of displacements.

    It is 1 where no force changes by more than a share `MAX_SIZE` of its own. A touch with little overlap, as
    one that begins as the run ends, may change by more: then it is the largest error of a quantity that a tolerance
    bounds, by a shift of the overlaps, over this shift (`impactlab.refine.errors.error_equation`).
    """
    records = records_of(history)
    again = len(history.contacts) > 1 or len(request.scene.contacts) > 1
    if error <= 0.0 or not again or not description.alike or math.isinf(stated_alone(request)):
        return 1.0
    if records is None or not records.of_every_step:
        return 1.0
    laws, shifts = laws_in(request), _shifts(history, request, records)
    if error * FOLLOWS * _share_of_overlap(history, request, laws, shifts) <= MAX_SIZE:
        return 1.0  # so it is of most runs, without a march
    found = contact_errors(records.record, records.dt, laws, records.arrays, shifts)
    if not error * max(each.in_touch for each in found) > MAX_SIZE:
        return 1.0
    largest = largest_error(history, request, records, found)
    return max(1.0, largest) if math.isfinite(largest) else 1.0


def _share_of_overlap(history: AbstractHistory, request: Simulation, laws: Array, shifts: Array) -> float:
    """Return the largest relative change of a force by the shifts.

    It is that of the weakest touch of each contact, at its peak.
    """
    share = 0.0
    for contact, law, shift in zip(request.scene.contacts, laws, shifts[:, 0], strict=True):
        peaks = [span.peak_force for span in history.spans(contact.name) if span.peak_force]
        if peaks and shift > 0.0:
            share = max(share, law[EXPONENT] * shift / (min(peaks) / law[STIFFNESS]) ** (1.0 / law[EXPONENT]))
    return share


def _shifts(history: AbstractHistory, request: Simulation, records: Records) -> Array:
    """Return shifts of the overlaps [m] and the steps after which they begin.

    They are as large as the beams of a contact move, and begin after a touch at t = 0; shape (contacts, 2).
    """
    scene, shifts = request.scene, np.zeros((len(request.scene.contacts), 2))
    moving = moving_frames(scene, touched_in(history))
    for number, contact in enumerate(scene.contacts):
        for point, moved in zip(contact.faces, records.force(number, hard=False).moved(CELLS), strict=True):
            body = scene.bodies[point.body]
            if body.elastic is not None:
                shifts[number, 0] += norm(moved - moving.drift(body.face_channel(point.x))) / math.sqrt(CELLS)
        spans = history.spans(contact.name)
        if spans and spans[0].start <= records.dt:
            shifts[number, 1] = math.inf if spans[0].end is None else math.ceil(spans[0].end / records.dt)
    return shifts
