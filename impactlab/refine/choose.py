"""The document of ``impactlab choose``: the choice, and all candidates measured against the reference."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from impactlab.refine import choice, reference
from impactlab.refine.choice_record import Candidate
from impactlab.refine.distances import counted, difference
from impactlab.report.summary import method, plain
from impactlab.scene.method import Simulation

if TYPE_CHECKING:
    from impactlab.errors import ImpactlabError


def choose(label: str, asked: Simulation, physics: Simulation) -> dict[str, Any]:
    """Return the choice as a run makes it, and every description refined until it keeps the tolerance.

    ``physics`` are the scene and the laws that errors refer to. Measured errors are the largest relative ones of the
    quantities that count; None without a reference.
    """
    exact = reference.find(*physics)
    history = choice.run(*asked)
    assert history.choice is not None  # noqa: S101 - a scene with a tolerance has one

    def measured(candidate: Any) -> float | None:
        return None if exact is None else difference(candidate, exact.history, *counted(asked))

    studies, why = choice.studies_of(asked)
    ladder: list[Candidate] = []
    tolerance = choice.allowed(asked.method)
    for study in studies:
        failed: list[ImpactlabError] = []
        best = choice.searched([study], asked, failed)
        for level in study.levels:
            record = choice.candidate(study, level, "kept" if level.error <= tolerance else "trial", level.reason)
            ladder.append(record._replace(measured_error=measured(level.history)))
        if best is None or best[1].error > tolerance:
            ladder.append(choice.candidate(study, None, "rejected", study.closed))
    document = {
        "schema_version": 1,
        "case": label,
        "tolerance": tolerance,
        "reference": None if exact is None else exact.name,
        "reference_uncertainty": None if exact is None else exact.uncertainty,
        "choice": history.choice.document(method(history)),
        "measured_error": measured(history),
        "solve_s": history.cost.solve_s,
        "ladder": [candidate._asdict() for candidate in ladder + choice.not_served(why)],
    }
    return {key: plain(value) for key, value in document.items()}
