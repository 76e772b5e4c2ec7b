"""Differences of a chosen run's probes to those of the next coarser run.

A tolerance bounds displacements, impulses and peak forces of contacts. Internal forces are derivatives of displacements
and converge more slowly, above all beside ends and contacts, so a run within the tolerance may still be far off there.
"""

from __future__ import annotations

from collections.abc import Iterator

from impactlab.history.base import Warned
from impactlab.metrics.norms import midpoints, relative_l2
from impactlab.refine.convergence import Level, Study

DIFFERENCE_WARN = 0.1  # relative L2 norm, from which a probe is named; of second order 6 % are then left, of first 16 %
CELLS = 2000  # of the run
NAMED = 3  # probes in the text; the others are counted


def warnings(study: Study, chosen: Level) -> Iterator[Warned]:
    """Yield a warning where probes of the chosen run are not converged.

    They differ much from those of another level of its description.
    """
    probes, nearest = chosen.history.scene.probes, study.beside(chosen)
    if not probes or nearest is None:
        return
    t, far = midpoints(chosen.history.duration, CELLS), []
    for probe in probes:
        values, beside = (level.history.evaluate(t, probe.channel) for level in (chosen, nearest))
        difference = relative_l2(beside, values)
        if difference is not None and difference > DIFFERENCE_WARN:
            far.append((difference, probe.channel))
    if not far:
        return
    far.sort(reverse=True)
    named = ", ".join(f"{channel} changed by {100.0 * difference:.2g} %" for difference, channel in far[:NAMED])
    more = f", and {len(far) - NAMED} more by over {100.0 * DIFFERENCE_WARN:g} %" if len(far) > NAMED else ""
    yield Warned(
        "probe_not_converged",
        "the tolerance bounds displacements, impulses and peak forces of contacts, not probes: from "
        f"{nearest.fineness} to {chosen.fineness} {study.description.unit} {named}{more} (square mean over the run); "
        "give a smaller tolerance, or a finer method of your own",
    )
