"""Contacts that may close within the error of a run.

They did not close in it, though their faces came closer than the error of their displacements.
"""

from __future__ import annotations

import math

from impactlab.history.base import AbstractHistory
from impactlab.history.frame import touched_in
from impactlab.refine.errors.moving_frames import CELLS, moving_frames, norm
from impactlab.refine.errors.raw_records import records_of
from impactlab.scene.method import Simulation

GAP = 1  # column of a contact in a record, after its force


def may_close(history: AbstractHistory, request: Simulation, error: float) -> str:
    """Return the name of a contact that may close; empty for none.

    It may close in the true solution. Its faces approach and do not meet in the run, whose displacements have a
    relative error. Faces that rest beside each other from the start do not approach.
    """
    records, scene = records_of(history), request.scene
    if records is None:
        return ""
    for number, contact in enumerate(scene.contacts):
        if history.spans(contact.name):
            continue
        force = records.force(number, hard=False)
        gap = records.record[:, force.column + GAP]
        least = float(gap.min())
        if gap[0] <= 0.0 or least >= gap[0]:
            continue
        moving, size = moving_frames(scene, touched_in(history)), 0.0
        for point, moved in zip(contact.faces, force.moved(CELLS), strict=True):
            body = scene.bodies[point.body]
            if body.moves:
                size += norm(moved - moving.drift(body.face_channel(point.x))) / math.sqrt(CELLS)
        if least <= error * size:
            return contact.name
    return ""
