"""The candidates of a choice as records for people and scripts."""

from __future__ import annotations

import math

from impactlab.history.base import AbstractHistory
from impactlab.history.choice import Candidate, Verdict
from impactlab.refine.convergence import SHOWN_SAFETY, Level, Study
from impactlab.refine.description import TWO_LEVEL_SAFETY
from impactlab.refine.level_errors import DONE
from impactlab.simulate.checks import gain_of

CHEAPEST = "the cheapest found within the tolerance"


def candidates(studies: list[Study], chosen: Study, best: Level) -> list[Candidate]:
    """Return the outcome of every candidate that was described, those of the chosen description first."""
    found = []
    for study in sorted(studies, key=lambda other: other is not chosen):
        for level in study.levels:
            verdict: Verdict = "chosen" if level is best else "trial" if study is chosen else "rejected"
            reason = level.reason
            if level is best:
                reason = reason or CHEAPEST
            elif study is not chosen:
                reason = reason or "solves longer than the chosen one"
            found.append(candidate(study, level, verdict, reason))
        if study.closed and study.closed != DONE:
            found.append(candidate(study, None, "rejected", study.closed))
        elif not study.levels:
            reason = longer(study.seconds, chosen.description.seconds(best.fineness))
            found.append(candidate(study, None, "not run", reason))
    return found


def longer(seconds: float, chosen: float) -> str:
    """Return the reason why a description was not run, of predicted times of solving [s], for people."""
    return f"predicted to solve for {1e3 * seconds:.2g} ms, the chosen one for {1e3 * chosen:.2g} ms"


def candidate(study: Study, level: Level | None, verdict: Verdict, reason: str) -> Candidate:
    """Return the record of a level, or of the next one, not run."""
    description, fineness = study.description, study.next if level is None else level.fineness
    return Candidate(
        candidate=description.words(fineness),
        predicted_error=description.error(fineness),
        predicted_s=description.seconds(fineness),
        estimated_error=None if level is None or math.isinf(level.error) else level.error,
        solve_s=None if level is None else level.history.cost.solve_s,
        verdict=verdict,
        reason=reason,
    )


def not_served(why: str) -> list[Candidate]:
    """Return the record of the exact solver where it does not apply, for a reason."""
    return [Candidate("continuous, from event to event", None, None, verdict="refused", reason=why)] if why else []


def words_of_estimate(study: Study, history: AbstractHistory) -> str:
    """Return how the error of a run was estimated, for people."""
    description, count = study.description, len(study.levels)
    if not description.unit:
        return "solved from event to event: exact except for rounding and near-grazing contacts"
    gained = f"the run gained {gain_of(history):.1g} of the reference energy"
    if count == 2:
        return (
            f"two resolutions, extrapolated by half the order of the description ({description.order:g}), times a "
            f"safety of {max(description.safety, TWO_LEVEL_SAFETY):g}; {gained}"
        )
    return (
        f"{count} resolutions, extrapolated by the order they show (at most {description.order:g}), times a safety of "
        f"{description.safety:g}, or {SHOWN_SAFETY:g} where that order shows; {gained}"
    )
