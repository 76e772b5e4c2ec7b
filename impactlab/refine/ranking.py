"""Ranking of studies by predicted solving time, and of runs by error."""

from __future__ import annotations

import math

from impactlab.refine.convergence import Level, Study
from impactlab.refine.descriptions.cost import FIXED_S
from impactlab.refine.errors.level_errors import MAX_CHOOSING, spent_s

EXACT_ADVANTAGE = 1.25  # of the exact solver, which needs no trial, over a prediction that is a little lower
SAME_COST_RATIO = 1.25  # of predicted costs, within which the run with less error is preferred
MAX_SURE_S = 4.0 * FIXED_S  # s of predicted solving, up to which comparing others takes longer than they may save
LEAST_TRIAL_S = 1.6e-3  # s of setting up the two runs with which another description begins, at least
MIN_GAIN = 2.0  # predicted, over a run that keeps the tolerance, of another description that is tried all the same


def priority(study: Study) -> float:
    """Return the predicted cost that orders studies [s].

    It is the time of solving, and a tenth of that of setting up a level.
    """
    description = study.description
    if not description.unit:
        return study.seconds / EXACT_ADVANTAGE
    ahead = [study.next] if study.levels else [study.next, description.coarser(study.next)[0]]
    setup_s = description.setup_s(*ahead)
    return description.cost.margin * study.expected_s + setup_s / MAX_CHOOSING


def is_sure(studies: list[Study], met: tuple[Study, Level] | None) -> bool:
    """Return whether no other description can solve much faster.

    It is compared with a run that keeps the tolerance, or with one that will.
    """
    if met is not None:  # where `is_worth_trying` would allow none of them, none need be described
        least_s = MIN_GAIN * (spent_s(studies) + LEAST_TRIAL_S) / MAX_CHOOSING
        return _solving_s(met) <= max(MAX_SURE_S, least_s)
    return min((study.expected_s for study in studies if not study.closed), default=math.inf) <= MAX_SURE_S


def begins_alone(studies: list[Study]) -> bool:
    """Return whether the preferred description's first run shows the cost of keeping the tolerance."""
    if len(studies) != 1 or studies[0].levels or studies[0].closed or studies[0].takes_two:
        return False
    return math.isfinite(studies[0].description.alone)


def is_worth_trying(study: Study, best: tuple[Study, Level], studies: list[Study]) -> bool:
    """Return whether a study promises a much cheaper run, tried at little cost.

    The run is compared with one within the tolerance. All trials together may take `MAX_CHOOSING` times the solving of
    the chosen run.
    """
    if study is best[0]:  # its estimate includes the errors of its run
        return True
    if _solving_s(best) <= MIN_GAIN * study.expected_s:
        return False
    return spent_s(studies, study) <= MAX_CHOOSING * study.expected_s


def best_of(study: Study, best: tuple[Study, Level] | None, tolerance: float) -> tuple[Study, Level] | None:
    """Return the best of the runs of a study and a run of another one."""
    for level in study.levels:
        if best is None or _better((study, level), best, tolerance):
            best = study, level
    return best


def _better(one: tuple[Study, Level], best: tuple[Study, Level], tolerance: float) -> bool:
    """Return whether a run is to be preferred.

    Within the tolerance it is the cheaper one, else the one with less error.
    """
    finer = one[1].error < best[1].error
    if max(one[1].error, best[1].error) <= tolerance:
        return _solving_s(one) < _solving_s(best) * (SAME_COST_RATIO if finer else 1.0 / SAME_COST_RATIO)
    return finer


def _solving_s(run: tuple[Study, Level]) -> float:
    return run[0].description.seconds(run[1].fineness)
