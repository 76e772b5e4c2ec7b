"""Distances between runs of one scene in the quantities that a tolerance is on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from impactlab.history import AbstractHistory
from impactlab.metrics import ZERO, face_channels, mass_channels, midpoints
from impactlab.peaks import find_peak, near_jumps, smooth_force
from impactlab.scene import Scene
from impactlab.types import Array

CELLS = 1000  # of the midpoint rule: fewer than a summary takes, as an estimate needs no third digit
AROUND_PEAK = (-0.01, -0.005, 0.0, 0.005, 0.01)  # of the longest period of contact: instants around a peak
MIN_IMPULSE = 1e-9  # of the largest impulse: contacts that give less are rounding and have no relative error


def distances(histories: Sequence[AbstractHistory], scene: Scene) -> list[dict[tuple[int, int], float]]:
    """Return the relative distances of all pairs of runs, one mapping for each quantity of the scene's tolerance.

    Parameters
    ----------
    histories : sequence of AbstractHistory
        Of one scene, of rising fineness; the last one gives the norms, and the jumps that peak forces leave out.
    scene : Scene
        Gives contacts, duration and ``tolerance_on``.

    Returns
    -------
    list of dict
        Of each displacement, impulse and peak force: pair of places in ``histories`` to relative distance, inf where a
        value is not finite. Quantities that are zero in the finest run are left out.
    """
    found = [_pairs(values) for values in _values(histories, scene)]
    return [pairs for pairs in found if pairs]


def _values(histories: Sequence[AbstractHistory], scene: Scene) -> list[list[Array]]:
    """Return for each quantity its values in each run: shape (CELLS,) of a displacement, (1,) of the others."""
    values = []
    if "displacements" in scene.tolerance_on:
        t = midpoints(scene.duration, CELLS)
        values += [
            [np.asarray(history.evaluate(t, name)) for history in histories]
            for name in (*mass_channels(scene), *face_channels(scene))
        ]
    forces = [contact for contact in scene.contacts if contact.law.answers_force]
    if "impulses" in scene.tolerance_on:
        impulses = [
            [sum(span.impulse for span in history.contacts if span.contact == contact.name) for history in histories]
            for contact in scene.contacts
        ]
        most = max((each[-1] for each in impulses), default=0.0)
        values += [[np.array([one]) for one in each] for each in impulses if each[-1] > MIN_IMPULSE * most]
    if "peak_forces" in scene.tolerance_on:
        values += [_near_peaks(histories, scene, contact) for contact in forces]
    return values


def _near_peaks(histories: Sequence[AbstractHistory], scene: Scene, contact: Contact) -> list[Array]:
    """Return the force of a contact in each run [N], shape (n,), close to the peaks of all of them.

    Two peaks may agree by luck while the forces around them ring; the forces at several instants do not.
    """
    left_out = near_jumps(histories[-1], scene, contact)
    peaks = [find_peak(history, contact, left_out) for history in histories]
    if peaks[-1].force == 0.0:
        return [np.zeros(1) for _ in histories]
    longest = max(
        (
            (history.duration if span.end is None else span.end) - span.start
            for history in histories[-1:]
            for span in history.contacts
            if span.contact == contact.name
        ),
        default=0.0,
    )
    t = np.concatenate([peak.time + longest * np.array(AROUND_PEAK) for peak in peaks])
    t = np.clip(t, 0.0, histories[-1].duration)
    for start, end in left_out:
        t = t[(t <= start) | (t >= end)]
    return [smooth_force(history, t, f"force:{contact.name}") for history in histories]


def _pairs(values: list[Array], norm: float) -> dict[tuple[int, int], float]:
    sizes = [float(np.linalg.norm(each, norm)) for each in values]
    if sizes[-1] <= ZERO * max(sizes):  # zero except for rounding
        return {}
    size = sizes[-1]
    return {
        (i, j): _finite(float(np.linalg.norm(values[i] - values[j], norm)) / size)
        for j in range(len(values))
        for i in range(j)
    }


def _finite(value: float) -> float:
    return value if np.isfinite(value) else float("inf")


def difference(one: AbstractHistory, other: AbstractHistory, scene: Scene) -> float:
    """Return the largest relative difference of two runs in the quantities of the tolerance, over the second one."""
    return max((pairs[0, 1] for pairs in distances((one, other), scene)), default=float("inf"))
