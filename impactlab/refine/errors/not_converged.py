"""Differences of a chosen run to the next coarser one, in probes and in the largest forces of contacts.

A tolerance bounds displacements, impulses, and peak forces away from jumps of the force. Internal forces are
derivatives of displacements and converge more slowly, above all beside ends and contacts. A largest force beside a
jump, as of two bodies that meet in hard contact or through a dashpot, converges with the first order only. Both may be
far off in a run within the tolerance.
"""

from __future__ import annotations

from collections.abc import Iterator

from impactlab.history.base import AbstractHistory, Warned
from impactlab.metrics.norms import midpoints, relative_l2
from impactlab.refine.convergence import Level, Study
from impactlab.scene.method import Tolerance

PROBE_WARN = 0.1  # relative L2 norm, from which a probe is named; of second order 6 % are then left, of first 16 %
CELLS = 2000  # of the run
PEAK_WARN = 0.02  # relative error of a largest force, from which it is named if it also exceeds the tolerance
MIN_PEAK = 0.01  # of the largest force of the run: smaller peaks are not compared
ORDER = 2  # of the error of a force, at most: the error of a lower order is larger than the estimate
NAMED = 3  # probes or contacts in a text; the others are counted


def warnings(study: Study, chosen: Level, tolerance: Tolerance | None) -> Iterator[Warned]:
    """Yield warnings where probes or largest forces of the chosen run are not converged."""
    nearest = study.beside(chosen)
    if nearest is None:
        return
    between = f"from {nearest.fineness} to {chosen.fineness} {study.description.unit}"
    remedy = "give a smaller tolerance, or a finer method of your own"
    if far := _far_probes(nearest, chosen):
        named = ", ".join(f"{channel} changed by {100.0 * difference:.2g} %" for difference, channel in far[:NAMED])
        more = f", and {len(far) - NAMED} more by over {100.0 * PROBE_WARN:g} %" if len(far) > NAMED else ""
        yield Warned(
            "probe_not_converged",
            "the tolerance bounds displacements, impulses and peak forces of contacts, not probes: "
            f"{between} {named}{more} (square mean over the run); {remedy}",
        )
    if tolerance is not None and "peak_forces" in tolerance.on and (far := _far_peaks(nearest, chosen, tolerance)):
        named = ", ".join(f"that of {contact} by {100.0 * difference:.2g} %" for difference, contact in far[:NAMED])
        more = f", and those of {len(far) - NAMED} more contacts" if len(far) > NAMED else ""
        yield Warned(
            "peak_not_converged",
            "the tolerance does not bound a largest force beside a jump of the force: "
            f"{between} it changed, {named}{more}; {remedy}",
        )


def _far_probes(nearest: Level, chosen: Level) -> list[tuple[float, str]]:
    """Return difference and channel of probes that differ much between two runs, the largest first."""
    t, far = midpoints(chosen.history.duration, CELLS), []
    for probe in chosen.history.scene.probes:
        values, beside = (level.history.evaluate(t, probe.channel) for level in (chosen, nearest))
        difference = relative_l2(beside, values)
        if difference is not None and difference > PROBE_WARN:
            far.append((difference, probe.channel))
    return sorted(far, reverse=True)


def _far_peaks(nearest: Level, chosen: Level, tolerance: Tolerance) -> list[tuple[float, str]]:
    """Return difference and contact of largest forces that are further off than the tolerance, the largest first.

    The error is estimated by the highest order that a description has. Forces away from jumps keep the tolerance by an
    estimate that is never smaller, so only those beside jumps are found.
    """
    own, beside = _largest_forces(chosen.history), _largest_forces(nearest.history)
    falls = (chosen.fineness / nearest.fineness) ** ORDER  # of the error, from the other run to the chosen one
    least, limit = MIN_PEAK * max(own.values(), default=0.0), max(PEAK_WARN, tolerance.error)
    far = []
    for contact in own.keys() & beside.keys():
        difference = abs(own[contact] - beside[contact]) / own[contact] if own[contact] > least else 0.0
        if difference > limit * abs(falls - 1.0):
            far.append((difference, contact))
    return sorted(far, reverse=True)


def _largest_forces(history: AbstractHistory) -> dict[str, float]:
    """Return the largest force of each contact that was closed [N]; none of laws of impulses."""
    found: dict[str, float] = {}
    for span in history.contacts:
        if span.peak_force is not None:
            found[span.contact] = max(span.peak_force, found.get(span.contact, 0.0))
    return found
