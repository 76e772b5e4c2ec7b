"""Differences of a chosen run's largest contact forces to those of the next coarser run.

A tolerance bounds peak forces away from jumps of the force. A largest force beside a jump, as of two bodies that meet
in hard contact or through a dashpot, converges with the first order only, and may be far off within the tolerance.
"""

from __future__ import annotations

from collections.abc import Iterator

from impactlab.history.base import AbstractHistory, Warned
from impactlab.refine.convergence import Level, Study
from impactlab.scene.method import Tolerance

ERROR_WARN = 0.02  # relative error of a largest force, from which it is named if it also exceeds the tolerance
MIN_PEAK = 0.01  # of the largest force of the run: smaller peaks are not compared
ORDER = 2  # of the error, at most: the error of a lower order is larger than the estimate
NAMED = 3  # contacts in the text; the others are counted


def warnings(study: Study, chosen: Level, tolerance: Tolerance | None) -> Iterator[Warned]:
    """Yield a warning where largest forces of the chosen run are further off than the tolerance.

    The error is estimated from the next level of its description, by the highest order that a description has. Forces
    away from jumps keep the tolerance by an estimate that is never smaller, so only those beside jumps are named; none
    where peak forces do not count.
    """
    nearest = study.beside(chosen)
    if nearest is None or tolerance is None or "peak_forces" not in tolerance.on:
        return
    own, beside = largest_forces(chosen.history), largest_forces(nearest.history)
    falls = (chosen.fineness / nearest.fineness) ** ORDER  # of the error, from the other run to the chosen one
    least, limit = MIN_PEAK * max(own.values(), default=0.0), max(ERROR_WARN, tolerance.error)
    far = []
    for contact in own.keys() & beside.keys():
        difference = abs(own[contact] - beside[contact]) / own[contact] if own[contact] > least else 0.0
        if difference > limit * abs(falls - 1.0):
            far.append((difference, contact))
    if not far:
        return
    far.sort(reverse=True)
    named = ", ".join(f"that of {contact} by {100.0 * difference:.2g} %" for difference, contact in far[:NAMED])
    more = f", and those of {len(far) - NAMED} more contacts" if len(far) > NAMED else ""
    yield Warned(
        "peak_not_converged",
        "the tolerance does not bound a largest force beside a jump of the force: from "
        f"{nearest.fineness} to {chosen.fineness} {study.description.unit} it changed, {named}{more}; give a smaller "
        "tolerance, or a finer method of your own",
    )


def largest_forces(history: AbstractHistory) -> dict[str, float]:
    """Return the largest force of each contact that was closed [N]; none of laws of impulses."""
    found: dict[str, float] = {}
    for span in history.contacts:
        if span.peak_force is not None:
            found[span.contact] = max(span.peak_force, found.get(span.contact, 0.0))
    return found
