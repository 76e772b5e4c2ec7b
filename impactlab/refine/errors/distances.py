"""Relative distances between runs of one scene in the quantities that a tolerance bounds."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from impactlab.history.base import AbstractHistory
from impactlab.history.frame import touched_in
from impactlab.metrics.fronts import MIN_JUMP
from impactlab.metrics.norms import ZERO, displaced
from impactlab.metrics.peaks import (
    MIN_PEAK,
    Laws,
    find_peak,
    has_largest_step,
    largest_step,
    near_jumps,
    smooth_force,
)
from impactlab.refine.convergence import Distance, Pairs
from impactlab.refine.errors.moving_frames import CELLS, MovingFrames, moving_frames
from impactlab.refine.errors.raw_records import Records, Sizes, records_of, sizes_of
from impactlab.scene.method import COUNTED, Counted, Simulation
from impactlab.scene.problem import Scene
from impactlab.types import Array

PER_SPAN = 100  # cells of a period of contact in which a peak is sought, beside the middles of its steps
MIN_IMPULSE = 1e-9  # of the largest impulse: contacts that give less are rounding and have no relative error


def distances(
    histories: Sequence[AbstractHistory],
    scene: Scene,
    laws: Laws,
    on: Sequence[Counted],
    peak_margin: float = 1.0,
    least_jump: float = MIN_JUMP,
) -> list[Distance]:
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
    least_jump : float
        Share of the largest force of a contact below which a jump of it is not left out.

    Returns
    -------
    list of Distance
        Of each displacement, impulse and peak force; inf where a value is not finite. Displacements are measured in the
        frame of the bodies that interact (`impactlab.history.frame`). Quantities that are zero in the last run are left
        out.
    """
    raw = [found for found in map(records_of, histories) if found is not None]
    raw = raw if len(raw) == len(histories) else []
    each = {
        "displacements": _displacements(histories, raw, scene),
        "impulses": _impulses(histories, scene),
        "peak_forces": _peaks(histories, raw, scene, laws, peak_margin, least_jump),
    }
    return [found for name in on for found in each[name]]


def counted(request: Simulation) -> tuple[Scene, Laws, tuple[Counted, ...]]:
    """Return a scene, its laws, and the quantities that count against its tolerance."""
    return request.scene, request.method.laws, request.method.tolerance.on if request.method.tolerance else COUNTED


def difference(one: AbstractHistory, other: AbstractHistory, scene: Scene, laws: Laws, on: Sequence[Counted]) -> float:
    """Return the largest relative difference of two runs in the quantities that count."""
    return max((each.pairs[0, 1] for each in distances((one, other), scene, laws, on)), default=math.inf)


def _displacements(histories: Sequence[AbstractHistory], raw: Sequence[Records], scene: Scene) -> Iterator[Distance]:
    """Give the distances of the displacements of faces, relative L2 over [0, duration]."""
    touched, last = touched_in(histories[-1]), len(histories) - 1
    moving = moving_frames(scene, touched)
    apart = _all_sizes(histories, raw, moving)
    masses = displaced({name: apart[name][0, last].own for name in moving.masses})
    for name in (*masses, *moving.faces):
        found, own = apart[name], apart[name][0, last]
        least = ZERO * max(max(each.other, each.own) for each in found.values())
        if own.own > least:  # not zero except for rounding
            scale = own.within if touched and own.within > least else own.own
            of = f"displacement of {name.partition(':')[2]}"
            yield Distance(of, _finite({pair: each.apart / scale for pair, each in found.items()}))


def _all_sizes(
    histories: Sequence[AbstractHistory], raw: Sequence[Records], moving: MovingFrames
) -> dict[str, dict[tuple[int, int], Sizes]]:
    """Return norms of displacements and of their differences by channel and pair of runs."""
    names = moving.channels
    if raw and all(name in raw[0].columns for name in names):
        values = [records.displacements(names, CELLS) for records in raw]
    else:
        values = [_evaluated(history, moving, raw[place] if raw else None) for place, history in enumerate(histories)]
    found: dict[str, dict[tuple[int, int], Sizes]] = {name: {} for name in names}
    for i, j in _all_pairs(histories):
        for name, sizes in zip(names, sizes_of(values[j], values[i], moving.drifts), strict=True):
            found[name][i, j] = sizes
    return found


def _evaluated(history: AbstractHistory, moving: MovingFrames, raw: Records | None) -> Array:
    """Return displacements of a run [m], (n_channels, CELLS), from its records where they are."""
    found = [
        raw.displacements([name], CELLS)[0] if raw is not None and name in raw.columns
        else history.evaluate(moving.t, name)
        for name in moving.channels
    ]  # fmt: skip
    return np.array(found).reshape(len(found), CELLS)


def _impulses(histories: Sequence[AbstractHistory], scene: Scene) -> Iterator[Distance]:
    """Give the distances of the total impulses of contacts."""
    given = [
        [sum(span.impulse for span in history.spans(contact.name)) for history in histories]
        for contact in scene.contacts
    ]
    least = MIN_IMPULSE * max((values[-1] for values in given), default=0.0)
    for values, contact in zip(given, scene.contacts, strict=True):
        if values[-1] > least:
            apart = {(i, j): abs(values[i] - values[j]) / values[-1] for i, j in _all_pairs(values)}
            yield Distance(f"impulse of {contact.name}", _finite(apart))


def _peaks(
    histories: Sequence[AbstractHistory],
    raw: Sequence[Records],
    scene: Scene,
    laws: Laws,
    margin: float,
    least_jump: float,
) -> Iterator[Distance]:
    """Yield the distances of the peak forces of contacts.

    Two runs are compared at the instants of both peaks. Peaks below `MIN_PEAK` of the largest are left out. The larger
    of these two differences bounds that of the peaks. Two peaks may agree by luck while the forces around them ring;
    the forces at the instants of both do not. Between rigid bodies in long runs, which keep means over several steps,
    the largest forces of all steps are compared.
    """
    every: list[tuple[str, list[list[float]]]] = []
    for number, contact in enumerate(scene.contacts):
        law = laws[contact.name]
        if not law.answers_force:
            continue
        samples = raw[-1].force(number, law.hard).samples() if raw and law.force_jumps else None
        left_out = near_jumps(histories[-1], scene, laws, contact, least_jump, samples)
        if raw and has_largest_step(scene, law, left_out) and any(each.thinned for each in raw):
            # Means over several steps, which are not the same in both runs, differ by more than the largest forces.
            found = [[largest_step(history, contact)] * len(histories) for history in histories]
        elif raw:
            forces = [each.force(number, law.hard) for each in raw]
            times = [each.peak_time(number, law.hard, left_out) for each in raw]
            found = [[force.at(t) for t in times] for force in forces]
        else:
            peaks = [find_peak(history, contact, left_out, law.hard, CELLS, PER_SPAN) for history in histories]
            t = np.array([peak.time for peak in peaks])
            found = [smooth_force(history, t, contact, law.hard).tolist() for history in histories]
        every.append((contact.name, found))
    least = MIN_PEAK * max((found[-1][-1] for _, found in every), default=0.0)
    for name, found in every:
        if found[-1][-1] > least:
            apart = {
                (i, j): max(abs(found[i][i] - found[j][i]), abs(found[i][j] - found[j][j])) / (found[-1][-1] / margin)
                for i, j in _all_pairs(found)
            }
            yield Distance(f"peak force of {name}", _finite(apart))


def _all_pairs(values: Sequence[Any]) -> Iterator[tuple[int, int]]:
    return itertools.combinations(range(len(values)), 2)


def _finite(found: Pairs) -> Pairs:
    """Return distances, inf in place of NaN."""
    return {pair: value if math.isfinite(value) else math.inf for pair, value in found.items()}
