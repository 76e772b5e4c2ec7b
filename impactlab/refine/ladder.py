"""Every candidate run and measured: what the automatic choice saw, and what it would have found elsewhere."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

from impactlab.refine.choice_record import Rung
from impactlab.refine.quantities import difference
from impactlab.refine.search import Search, searched, searches_of
from impactlab.report.summary import method, plain
from impactlab.scene.problem import Scene

if TYPE_CHECKING:
    from impactlab.errors import ImpactlabError
    from impactlab.refine.reference import Reference


def measured_ladder(scene: Scene, reference: Reference | None) -> list[Rung]:
    """Return every family of a scene with a tolerance, refined until it keeps it, with errors against the reference.

    The largest relative error of displacements and impulses, on the cells of the estimate; None without a reference.
    """
    tolerance = scene.tolerance or 0.0
    searches, why = searches_of(scene)
    rungs = []
    for search in searches:
        failed: list[ImpactlabError] = []
        best = searched([search], tolerance, failed)
        for trial in search.trials:
            kept = trial.expected <= tolerance
            rungs.append(
                Rung(
                    candidate=search.family.words(trial.fineness),
                    predicted_error=search.family.error(trial.fineness),
                    predicted_s=search.family.seconds(trial.fineness),
                    estimated_error=trial.expected if math.isfinite(trial.expected) else None,
                    measured_error=None if reference is None else difference(trial.history, reference.history, scene),
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


def choose(label: str, scene: Scene, physics: Scene, tolerance: float) -> dict[str, Any]:
    """Return the document of ``impactlab choose``: the choice as a run makes it, and the whole ladder measured.

    ``physics`` is the scene that errors refer to; its reference takes the time it needs.
    """
    from impactlab.refine import reference
    from impactlab.simulate import driver as simulate

    asked = dataclasses.replace(scene, tolerance=tolerance)
    judge = reference.find(dataclasses.replace(physics, tolerance=None))
    history = simulate.run(asked)
    assert history.choice is not None  # noqa: S101 - a scene with a tolerance has one
    document = {
        "schema_version": 1,
        "case": label,
        "tolerance": tolerance,
        "reference": None if judge is None else judge.name,
        "reference_uncertainty": None if judge is None else judge.uncertainty,
        "choice": history.choice.document(method(scene, history)),
        "measured_error": None if judge is None else difference(history, judge.history, asked),
        "solve_s": history.cost.solve_s,
        "ladder": [rung._asdict() for rung in measured_ladder(asked, judge)],
    }
    return {key: plain(value) for key, value in document.items()}
