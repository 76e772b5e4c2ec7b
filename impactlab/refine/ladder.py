"""Every candidate run and measured: what the automatic choice saw, and what it would have found elsewhere."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from impactlab.refine import reference as references
from impactlab.refine import search as choice
from impactlab.refine.choice_record import Rung
from impactlab.refine.estimates import counted
from impactlab.refine.quantities import difference
from impactlab.refine.search import Search, allowed, searched, searches_of
from impactlab.report.summary import method, plain
from impactlab.scene.method import Simulation

if TYPE_CHECKING:
    from impactlab.errors import ImpactlabError
    from impactlab.refine.reference import Reference


def measured_ladder(asked: Simulation, reference: Reference | None) -> list[Rung]:
    """Return every family of a scene under a tolerance, refined until it keeps it, with errors against the reference.

    The largest relative error of displacements and impulses, on the cells of the estimate; None without a reference.
    """
    tolerance = allowed(asked.method)
    searches, why = searches_of(asked)
    rungs = []
    for search in searches:
        failed: list[ImpactlabError] = []
        best = searched([search], tolerance, failed)
        for trial in search.trials:
            kept, measured = trial.expected <= tolerance, None
            if reference is not None:
                measured = difference(trial.history, reference.history, *counted(asked))
            rungs.append(
                Rung(
                    candidate=search.family.words(trial.fineness),
                    predicted_error=search.family.error(trial.fineness),
                    predicted_s=search.family.seconds(trial.fineness),
                    estimated_error=trial.expected if math.isfinite(trial.expected) else None,
                    measured_error=measured,
                    solve_s=trial.history.cost.solve_s,
                    verdict="kept" if kept else "trial",
                    reason=trial.reason,
                )
            )
        if best is None or best[1].expected > tolerance:
            rungs.append(_unfinished(search))
    if why:
        rungs.append(Rung("continuous, from event to event", None, None, verdict="refused", reason=why))
    return rungs


def _unfinished(search: Search) -> Rung:
    family, fineness = search.family, search.next
    error, seconds = family.error(fineness), family.seconds(fineness)
    return Rung(family.words(fineness), error, seconds, verdict="rejected", reason=search.closed)


def choose(label: str, asked: Simulation, physics: Simulation) -> dict[str, Any]:
    """Return the document of ``impactlab choose``: the choice as a run makes it, and the whole ladder measured.

    ``physics`` are the scene and the laws that errors refer to; their reference takes the time it needs.
    """
    judge = references.find(*physics)
    history = choice.run(*asked)
    assert history.choice is not None  # noqa: S101 - a scene with a tolerance has one
    document = {
        "schema_version": 1,
        "case": label,
        "tolerance": allowed(asked.method),
        "reference": None if judge is None else judge.name,
        "reference_uncertainty": None if judge is None else judge.uncertainty,
        "choice": history.choice.document(method(history)),
        "measured_error": None if judge is None else difference(history, judge.history, *counted(asked)),
        "solve_s": history.cost.solve_s,
        "ladder": [rung._asdict() for rung in measured_ladder(asked, judge)],
    }
    return {key: plain(value) for key, value in document.items()}
