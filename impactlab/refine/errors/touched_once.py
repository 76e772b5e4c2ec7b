"""Runs that touch once under a smooth force: their errors by their own records, and how fine the next one must be.

A first run is coarse. The error that its records state falls as the square of the step, so that a second one as fine as
the tolerance needs is mostly the last (`impactlab.refine.errors.smooth_touch`).
"""

from __future__ import annotations

import math

from impactlab.refine.convergence import Level, Reach, Study, error_of_two
from impactlab.refine.descriptions.cost import FIXED_S
from impactlab.refine.descriptions.description import MIN_GROWTH, MIN_ORDER_SHARE
from impactlab.refine.errors.distances import counted, distances
from impactlab.refine.errors.level_errors import (
    DONE,
    MARGIN,
    MAX_CHOOSING,
    MAX_LEVELS,
    MAX_SHOWN_ERROR,
    MAX_UNSEEN,
    MIN_LEFT,
    NOT_CONVERGING,
    PEAK_MARGIN,
    UNSEEN,
    allowed,
    choosing_s,
    resolves_contacts,
)
from impactlab.refine.errors.smooth_touch import LEAST_SHARE, SAFETY_OF_TWO, error_alone
from impactlab.scene.method import Simulation

MIN_SAVING_ALONE = 1.6  # predicted, of a coarser run after one that keeps the tolerance
MIN_SAVING_OF_SHORT = 2.0  # the same where choosing takes long already
MIN_RATIO = 2.3  # of the fineness of two runs whose difference states an error
LONG_S = 4.0 * FIXED_S  # s of predicted solving, from which a run is as fine as two runs need to state its error
SHARE_OF_TWO = 0.5  # of the error that one run states, that two do: about the median


def estimate_alone(study: Study, level: Level, request: Simulation) -> bool:
    """Set the error of a level by its own records, and the next fineness or why none follows.

    Return False, with nothing set, where it takes two runs to know the error.
    """
    description, tolerance = study.description, allowed(request.method)
    if math.isinf(description.alone) or not resolves_contacts(level.history, request):
        return False
    by_steps = error_alone(level.history, request)
    unseen = description.unseen(level.fineness, level.history)
    if not math.isfinite(by_steps + unseen):
        return False
    level.by_steps, error = by_steps, by_steps
    before = [each for each in study.levels if MIN_RATIO * each.fineness <= level.fineness and each.by_steps > by_steps]
    if by_steps + unseen > tolerance and before:
        error = _by_two(before[-1], level, description.order, request)
    needed = _needed(study, level, error, tolerance) if before else _aimed(study, level, tolerance)
    holds = error + unseen <= tolerance
    if not needed and not holds:
        if description.otherwise is None:
            return False
        study.closed = UNSEEN
    level.error, level.worst, level.alone, level.by_two = error + unseen, "", True, error < by_steps
    level.reason = "" if holds else f"expected error {level.error:.2g} beyond the tolerance"
    if holds:
        study.next = needed or level.fineness
        study.closed = "" if _saves(study, level) else DONE
    elif needed:
        study.next = study.wanted = max(needed, description.whole(math.ceil(MARGIN * level.fineness)))
        if error <= MAX_SHOWN_ERROR:
            study.reach = Reach(level.fineness, error, description.order, study.next)
        if study.next > description.max_fineness:
            study.closed = f"needs more than {description.max_fineness} {description.unit}, its most"
        elif len(study.levels) > MAX_LEVELS:
            study.closed = NOT_CONVERGING
    return True


def _by_two(coarse: Level, fine: Level, order: float, request: Simulation) -> float:
    """Return the error of the finer of two runs of very unequal fineness by the whole order, at most its own one."""
    found = distances((coarse.history, fine.history), *counted(request), PEAK_MARGIN, allowed(request.method))
    apart = max((each.pairs[0, 1] for each in found), default=math.inf)
    by_two = SAFETY_OF_TWO * error_of_two(apart, coarse.fineness, fine.fineness, order, 1.0)
    return min(fine.by_steps, max(by_two, LEAST_SHARE * fine.by_steps))


def _aimed(study: Study, level: Level, tolerance: float) -> int:
    """Return how fine the run after a first one must be: where that is long, as fine as two runs need."""
    alone = _needed(study, level, level.by_steps, tolerance)
    if not alone or study.description.seconds(alone) <= LONG_S:
        return alone
    of_two = _needed(study, level, SHARE_OF_TWO * level.by_steps, tolerance)
    return min(alone, max(of_two, study.description.whole(math.ceil(MIN_RATIO * level.fineness))))


def _needed(study: Study, level: Level, error: float, tolerance: float) -> int:
    """Return about the least fineness with which an error falls within the tolerance; 0 where it takes more modes."""
    description, order = study.description, _shown_order(study, level)

    def unseen_at(fineness: int) -> float:
        return description.unseen(fineness, level.history)

    def falls_to(left: float) -> int:
        sought = MARGIN * level.fineness * math.pow(error / left, 1.0 / order)
        return description.whole(max(description.min_fineness, math.ceil(sought)))

    here = unseen_at(level.fineness)
    if here <= MAX_UNSEEN * tolerance and unseen_at(found := falls_to(tolerance - here)) <= here:
        return found
    low, high = falls_to(tolerance), falls_to(MIN_LEFT * tolerance)  # finer steps resolve static shapes
    if unseen_at(high) > MAX_UNSEEN * tolerance:
        return 0
    while high > MIN_GROWTH * low:
        middle = description.whole(round(math.sqrt(low * high)))
        unseen = unseen_at(middle)
        keeps = unseen <= MAX_UNSEEN * tolerance and falls_to(tolerance - unseen) <= middle
        if middle in (low, high):
            break
        low, high = (low, middle) if keeps else (middle, high)
    return high


def _shown_order(study: Study, level: Level) -> float:
    """Return the order with which the errors of single runs fall, at most the declared one."""
    order, first = study.description.order, study.levels[0]
    if first.fineness >= level.fineness or 0.0 in (first.by_steps, level.by_steps):
        return order  # a run that ends as the faces meet may show no error at all
    shown = math.log(first.by_steps / level.by_steps) / math.log(level.fineness / first.fineness)
    return min(max(shown, MIN_ORDER_SHARE * order), order)


def _saves(study: Study, level: Level) -> bool:
    """Return whether a coarser run in place of one that keeps the tolerance is worth its time."""
    if any(each.fineness == study.next for each in study.levels):
        return False
    least = MIN_SAVING_ALONE if choosing_s(study) <= MAX_CHOOSING * study.seconds else MIN_SAVING_OF_SHORT
    return study.description.seconds(level.fineness) > least * study.seconds
