"""Relative distances between runs of one scene in the quantities that a tolerance bounds."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.metrics.norms import ZERO, face_channels, mass_channels, midpoints
from impactlab.metrics.peaks import Laws, find_peak, near_jumps, smooth_force
from impactlab.refine.convergence import Pairs
from impactlab.scene.frame import common_drift, touched_in
from impactlab.scene.method import COUNTED, Counted, Simulation
from impactlab.scene.problem import Scene
from impactlab.types import Array

CELLS = 400  # of the midpoint rule: fewer than a summary takes, as an estimate needs no third digit
PER_SPAN = 100  # cells of a period of contact in which a peak is sought, beside the middles of its steps
MIN_IMPULSE = 1e-9  # of the largest impulse: contacts that give less are rounding and have no relative error


def distances(
    histories: Sequence[AbstractHistory],
    scene: Scene,
    laws: Laws,
    on: Sequence[Counted],
    peak_margin: float = 1.0,
) -> list[Pairs]:
    """Return the relative distances of all pairs of runs, by quantity.

    Parameters
    ----------
    histories : sequence of AbstractHistory
        Of one scene, of rising fineness; the last one gives the norms, and the jumps that peak forces leave out.
    scene : Scene
        Gives contacts and duration.
    laws : mapping
        Laws by name of the contact: an impulse law has no peak force.
    on : sequence of str
        Quantities that count, as in `impactlab.scene.method.Tolerance`.
    peak_margin : float
        By which distances of peak forces are multiplied.

    Returns
    -------
    list of dict
        Of each displacement, impulse and peak force; inf where a value is not finite. Displacements are measured in the
        frame of the bodies that interact (`impactlab.scene.frame`). Quantities that are zero in the last run are left
        out.
    """
    each = {
        "displacements": _displacements(histories, scene),
        "impulses": _impulses(histories, scene),
        "peak_forces": _peaks(histories, scene, laws, peak_margin),
    }
    return [pairs for name in on for pairs in each[name]]


def counted(asked: Simulation) -> tuple[Scene, Laws, tuple[Counted, ...]]:
    """Return a scene, its laws, and the quantities that count against its tolerance."""
    return asked.scene, asked.method.laws, asked.method.tolerance.on if asked.method.tolerance else COUNTED


def difference(one: AbstractHistory, other: AbstractHistory, scene: Scene, laws: Laws, on: Sequence[Counted]) -> float:
    """Return the largest relative difference of two runs in the quantities that count."""
    return max((pairs[0, 1] for pairs in distances((one, other), scene, laws, on)), default=math.inf)


def _displacements(histories: Sequence[AbstractHistory], scene: Scene) -> Iterator[Pairs]:
    """Give the distances of the displacements of faces, relative L2 over [0, duration]."""
    t, touched = midpoints(scene.duration, CELLS), touched_in(histories[-1])
    for name in (*mass_channels(scene), *face_channels(scene)):
        values = [history.evaluate(t, name) for history in histories]
        largest = max(float(np.linalg.norm(each)) for each in values)
        size = float(np.linalg.norm(values[-1]))
        if size <= ZERO * largest:  # zero except for rounding
            continue
        within = float(np.linalg.norm(values[-1] - common_drift(scene, name, t, touched))) if touched else size
        yield _pairs(values, within if within > ZERO * largest else size, None)


def _impulses(histories: Sequence[AbstractHistory], scene: Scene) -> Iterator[Pairs]:
    """Give the distances of the total impulses of contacts."""
    given = [
        [np.array([sum(s.impulse for s in history.contacts if s.contact == contact.name)]) for history in histories]
        for contact in scene.contacts
    ]
    least = MIN_IMPULSE * max((float(values[-1][0]) for values in given), default=0.0)
    for values in given:
        if values[-1][0] > least:
            yield _pairs(values, float(values[-1][0]), None)


def _peaks(histories: Sequence[AbstractHistory], scene: Scene, laws: Laws, margin: float) -> Iterator[Pairs]:
    """Give the distances of the peak forces of contacts: of two runs, at the instants of both peaks.

    The larger of these two differences bounds that of the peaks. Two peaks may agree by luck while the forces around
    them ring; the forces at the instants of both do not.
    """
    for contact in scene.contacts:
        law = laws[contact.name]
        if not law.answers_force:
            continue
        left_out = near_jumps(histories[-1], scene, laws, contact)
        peaks = [find_peak(history, contact, left_out, law.hard, CELLS, PER_SPAN) for history in histories]
        if peaks[-1].force > 0.0:
            t = np.array([peak.time for peak in peaks])
            values = np.array([smooth_force(history, t, contact, law.hard) for history in histories])
            yield {
                (i, j): float(np.max(np.abs(values[i, [i, j]] - values[j, [i, j]]))) / (peaks[-1].force / margin)
                for i, j in itertools.combinations(range(len(values)), 2)
            }


def _pairs(values: Sequence[Array], scale: float, norm: float | None) -> Pairs:
    """Return the norms of all differences over a scale."""
    found = {
        (i, j): float(np.linalg.norm(values[i] - values[j], norm)) / scale
        for i, j in itertools.combinations(range(len(values)), 2)
    }
    return {pair: value if math.isfinite(value) else math.inf for pair, value in found.items()}
