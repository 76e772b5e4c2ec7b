"""The candidates of a choice as records for people and scripts."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

from impactlab.history.choice import Candidate, CandidateVerdict
from impactlab.refine.convergence import SHOWN_SAFETY, Level, Study
from impactlab.refine.descriptions.description import TWO_LEVEL_SAFETY, Description
from impactlab.refine.errors.level_errors import DONE, MAX_CHOOSING
from impactlab.refine.errors.smooth_touch import SAFETY_ALONE
from impactlab.refine.ranking import MIN_GAIN
from impactlab.simulate.checks import gain_of

CHEAPEST = "the cheapest found within the tolerance"


Outcome = Callable[[], Candidate]
"""The record of a candidate, described when it is called: it holds no run."""


def candidates(studies: list[Study], chosen: Study, best: Level) -> list[Outcome]:
    """Return the outcome of every candidate that was described, those of the chosen description first."""
    found = []
    for study in sorted(studies, key=lambda other: other is not chosen):
        for level in study.levels:
            verdict: CandidateVerdict = "chosen" if level is best else "trial" if study is chosen else "rejected"
            reason = level.reason
            if level is best:
                reason = reason or CHEAPEST
            elif study is not chosen:
                reason = reason or "solves longer than the chosen one"
            found.append(outcome(study, level, verdict, reason))
        if study.closed and study.closed != DONE:
            found.append(outcome(study, None, "rejected", study.closed))
        elif not study.levels:
            found.append(not_run(study, chosen.description.seconds(best.fineness)))
    return found


def not_run(study: Study, chosen_s: float) -> Outcome:
    """Return the record of a description that was not run.

    The reason is its predicted time of solving within the tolerance, beside that of the chosen one [s], or the trials.
    """
    text = f"predicted to solve for {1e3 * study.expected_s:.2g} ms, the chosen one for {1e3 * chosen_s:.2g} ms"
    if chosen_s > MIN_GAIN * study.expected_s:
        text += f"; all trials together would take more than {MAX_CHOOSING:g} times as long"
    elif chosen_s > study.expected_s:
        text += f", less than {MIN_GAIN:g} times as long"
    return partial(_described, study.description, study.expected, None, None, "not run", text)


def candidate(study: Study, level: Level | None, verdict: CandidateVerdict, reason: str) -> Candidate:
    """Return the record of a level, or of the next one."""
    return outcome(study, level, verdict, reason)()


def outcome(study: Study, level: Level | None, verdict: CandidateVerdict, reason: str) -> Outcome:
    """Return the record of a candidate, to be described later."""
    if level is None:
        return partial(_described, study.description, study.next, None, None, verdict, reason)
    error = None if math.isinf(level.error) else level.error
    return partial(_described, study.description, level.fineness, error, level.history.cost.solve_s, verdict, reason)


def _described(
    description: Description,
    fineness: int,
    error: float | None,
    solve_s: float | None,
    verdict: CandidateVerdict,
    reason: str,
) -> Candidate:
    """Return the record of a candidate before a run."""
    return Candidate(
        candidate=description.words(fineness),
        predicted_error=description.error(fineness),
        predicted_s=description.seconds(fineness),
        estimated_error=error,
        solve_s=solve_s,
        verdict=verdict,
        reason=reason,
    )


def not_served(why: str) -> list[Candidate]:
    """Return the record of the exact solver where it does not apply, for a reason."""
    return [Candidate("continuous, from event to event", None, None, verdict="refused", reason=why)] if why else []


def words_of_estimate(study: Study, level: Level) -> str:
    """Return how the error of a run was estimated, for people."""
    description, count = study.description, len(study.levels)
    if not description.unit:
        return "solved from event to event: exact except for rounding and near-grazing contacts"
    gained = f"the run gained {gain_of(level.history):.1g} of the reference energy"
    if level.alone:
        return (
            f"one resolution, by the linear equation that the error of its steps obeys, times a safety of "
            f"{SAFETY_ALONE:g}; {gained}"
        )
    if count == 2:
        return (
            f"two resolutions, extrapolated by {study.order_share:g} of the order of the description "
            f"({description.order:g}), times a "
            f"safety of {max(description.safety, TWO_LEVEL_SAFETY):g}; {gained}"
        )
    return (
        f"{count} resolutions, extrapolated by the order they show (at most {description.order:g}), times a safety of "
        f"{description.safety:g}, or {SHOWN_SAFETY:g} where that order shows; {gained}"
    )
