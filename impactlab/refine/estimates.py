"""Estimated errors of runs of one description at several resolutions."""

from __future__ import annotations

import math

from impactlab.history.base import AbstractHistory
from impactlab.metrics.peaks import Laws
from impactlab.refine.extrapolation import Differences, Estimate, finest_error
from impactlab.refine.quantities import distances
from impactlab.scene.method import COUNTED, Counted, Simulation, laws_of
from impactlab.scene.problem import Scene

MIN_STEPS = 6  # in a period of contact: with fewer of them no order shows
MIN_SHARE = 1e-2  # of the impulse of a contact: shorter periods of contact that give less need no such resolution
PEAK_MARGIN = 1.5  # on distances of peak forces, which converge less evenly than displacements (docs/audit.md)


def estimated(
    runs: list[tuple[int, AbstractHistory]], asked: Simulation, order: float, safety: float
) -> list[tuple[float, Estimate]]:
    """Estimate the errors of runs of rising fineness, three or more; ``safety`` is a factor on each estimate.

    Returns
    -------
    list of (float, Estimate)
        For each run the distance to the finest run and the estimated error of that one, in the quantity in which their
        sum is largest.
    """
    last = len(runs) - 1
    if last < 2:
        return [(math.inf, Estimate(math.inf, order))] * len(runs)
    fineness = [float(count) for count, _ in runs]
    found = []
    for pairs in distances([history for _, history in runs], *counted(asked), PEAK_MARGIN):
        estimates = [
            finest_error(
                Differences(pairs[i, i + 1], pairs[i, i + 2], pairs[i + 1, i + 2]),
                (fineness[i], fineness[i + 1], fineness[i + 2]),
                order,
            )
            for i in range(last - 1)
        ]
        # An order that shows in some runs and not in others shows by luck.
        shown = all(estimate.shown for estimate in estimates)
        found.append((pairs, estimates[-1]._replace(shown=shown).with_safety(safety)))
    if not found:
        return [(math.inf, Estimate(math.inf, order))] * len(runs)
    return [
        max(
            ((pairs[number, last] if number < last else 0.0, estimate) for pairs, estimate in found),
            key=lambda each: each[0] + each[1].error,
        )
        for number in range(len(runs))
    ]


def counted(asked: Simulation) -> tuple[Scene, Laws, tuple[Counted, ...]]:
    """Return a scene, its laws, and the quantities that count against its tolerance."""
    return asked.scene, asked.method.laws, asked.method.tolerance.on if asked.method.tolerance else COUNTED


def resolves_contacts(history: AbstractHistory, asked: Simulation) -> bool:
    """Return whether each period of contact under a compliant law spans enough steps for the order to show."""
    if history.dt is None:
        return True
    for contact, law in zip(asked.scene.contacts, laws_of(*asked), strict=True):
        if law.hard or not law.answers_force:
            continue
        spans = [span for span in history.contacts if span.contact == contact.name]
        total = sum(span.impulse for span in spans)
        for span in spans:
            counts = span.impulse > MIN_SHARE * total
            if counts and span.end is not None and span.end - span.start < MIN_STEPS * history.dt:
                return False
    return True
