"""Error of displacements by the cubics between the records of a run.

Runs that keep the same few instants have it in common, so that their differences do not show it.
"""

from __future__ import annotations

import math

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.history.frame import touched_in
from impactlab.refine.errors.moving_frames import CELLS, moving_frames
from impactlab.refine.errors.raw_records import records_of
from impactlab.scene.problem import Scene

FALLS = 8.0  # error by cubics through every second record over that through all: 16 for many records


def error_between_records(history: AbstractHistory, scene: Scene, stride: int = 1) -> float:
    """Return the largest relative error of a bead's displacement between the records of a run of beads alone.

    Cubics through all records are compared with those through every second one. It is 0 of a run that has records at
    most ``stride`` steps apart.
    """
    records = records_of(history)
    if records is None or records.stride <= stride:
        return 0.0
    moving = moving_frames(scene, touched_in(history))
    own = records.displacements(moving.channels, CELLS)
    apart = np.linalg.norm(records.displacements_by_half(moving.channels, CELLS) - own, axis=1)
    sizes = np.linalg.norm(own - moving.drifts, axis=1)
    moved = sizes > 0.0
    largest = float(np.max(apart[moved] / sizes[moved], initial=0.0))
    return largest / FALLS if math.isfinite(largest) else math.inf
