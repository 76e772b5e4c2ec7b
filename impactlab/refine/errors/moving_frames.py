"""Instants and displacements at which runs are compared, and their frames' motion."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np

from impactlab.history.frame import common_drift
from impactlab.metrics.norms import face_channels, mass_channels, midpoints
from impactlab.scene.problem import Scene
from impactlab.types import Array

CELLS = 400  # of the midpoint rule: fewer than a summary takes, as an estimate needs no third digit


class MovingFrames:
    """Displacements that are compared, and those of interacting bodies' frames.

    Parameters
    ----------
    scene : Scene
        Gives bodies, contacts and duration.
    touched : collection of str
        Contacts that were closed in a run; where none was, nothing interacts, and no frame moves.
    """

    def __init__(self, scene: Scene, touched: Collection[str]) -> None:
        self.t = midpoints(scene.duration, CELLS)
        self.masses, self.faces = mass_channels(scene), face_channels(scene)
        self.channels = tuple(dict.fromkeys((*self.masses, *self.faces)))
        self.drifts = np.zeros((len(self.channels), CELLS))  # m, of the frame of each channel's body
        for row, channel in zip(self.drifts, self.channels, strict=True):
            if touched:
                row[:] = common_drift(scene, channel, self.t, touched)

    def drift(self, channel: str) -> Array:
        """Return the displacement of a channel's frame [m], (CELLS,).

        It is that of the frame of the channel's body, in the middles of the cells.
        """
        return np.asarray(self.drifts[self.channels.index(channel)])


def moving_frames(scene: Scene, touched: Collection[str]) -> MovingFrames:
    """Return the moving frames of a scene, made once for the contacts that were closed."""
    key = "moving frames", frozenset(touched)
    if key not in scene.derived:
        scene.derived[key] = MovingFrames(scene, touched)
    found: MovingFrames = scene.derived[key]
    return found


def norm(values: Array) -> float:
    """Return the root of the sum of squares of values, shape (n,)."""
    return math.sqrt(np.dot(values, values))
