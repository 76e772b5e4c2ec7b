"""Errors of single runs from their own records, and the next fineness.

They are runs of beams in modes and of rigid bodies. Forces without jumps act between beams in modes and rigid bodies.
The error by the steps follows from its linear equation (`impactlab.refine.errors.error_equation`), that by the modes
left out from their flexibility. A first run is as fine as is likely to do. The error that it states falls as the square
of the step, so that a second one as fine as the tolerance needs is mostly the last.

Measured on random scenes by `studies.error_equation`; the figures are in docs/theory/error-estimates.md.
"""

from __future__ import annotations

import math

from impactlab.history.base import AbstractHistory
from impactlab.refine.convergence import Level, Reach, Study
from impactlab.refine.descriptions.description import MIN_GROWTH, MIN_ORDER_SHARE
from impactlab.refine.errors.error_equation import contact_errors
from impactlab.refine.errors.level_errors import (
    DONE,
    MARGIN,
    MAX_CHOOSING,
    MAX_LEVELS,
    MAX_SHOWN_ERROR,
    MAX_UNSEEN,
    MIN_LEFT,
    NOT_CONVERGING,
    UNSEEN,
    allowed,
    choosing_s,
    resolves_contacts,
)
from impactlab.refine.errors.magnification import (
    MAX_SIZE,
    magnified_by_sensitive_touches,
    magnified_by_touches,
)
from impactlab.refine.errors.near_misses import may_close
from impactlab.refine.errors.raw_records import records_of
from impactlab.refine.errors.relative_errors import largest_error, laws_in
from impactlab.refine.errors.smooth_touch import SAFETY_ALONE
from impactlab.scene.method import Simulation

MIN_SAVING_ALONE = 1.6  # predicted, of a coarser run after one that keeps the tolerance
MIN_SAVING_OF_SHORT = 2.0  # the same where choosing takes long already
OF_SECOND_ORDER = 30.0  # share of it by which errors may exceed those of the equation


def error_alone(history: AbstractHistory, request: Simulation) -> float:
    """Return the relative error of one run from its records.

    `stated_alone` must allow it. The error is inf where the equation does not give it. That is where the error of a
    touch is not small, or a gap nearly closes. The force of a law with hysteresis depends on the speed of the approach:
    where a touch begins with no speed of its own, nothing is stated.
    """
    records = records_of(history)
    if records is None or not history.contacts or not records.of_every_step:
        return math.inf
    laws = laws_in(request)
    found = contact_errors(records.record, records.dt, laws, records.arrays)
    size = max(max(each.in_touch, each.missed) for each in found)
    if not math.isfinite(sum(each.force for each in found)) or size > MAX_SIZE:
        return math.inf
    return SAFETY_ALONE * (1.0 + OF_SECOND_ORDER * size) * largest_error(history, request, records, found)


def estimate_alone(study: Study, level: Level, request: Simulation) -> bool:
    """Set the error of a level by its own records.

    Also set the next fineness, or the reason why none follows. Return False, with nothing set, where it takes two runs
    to know the error.
    """
    description, tolerance = study.description, allowed(request.method)
    if math.isinf(description.alone) or not resolves_contacts(level.history, request):
        return False
    by_steps = error_alone(level.history, request)
    study.magnified = magnified_by_touches(description, level, by_steps)
    unseen = study.magnified * description.unseen(level.fineness, level.history)
    if by_steps + unseen <= tolerance:
        study.magnified *= magnified_by_sensitive_touches(description, level.history, request, unseen)
        unseen = study.magnified * description.unseen(level.fineness, level.history)
    if not math.isfinite(by_steps + unseen):
        return False
    level.by_steps, error = by_steps, by_steps + unseen
    needed, holds = _needed(study, level, tolerance), error <= tolerance
    if holds and may_close(level.history, request, error):
        return False
    if not needed and not holds:
        if description.otherwise is None:
            return False
        study.closed = UNSEEN
    level.error, level.worst, level.alone = error, "", True
    level.reason = "" if holds else f"expected error {error:.2g} beyond the tolerance"
    if holds:
        study.next = needed or level.fineness
        study.closed = "" if _saves(study, level) else DONE
    elif needed:
        study.next = study.wanted = max(needed, description.whole(math.ceil(MARGIN * level.fineness)))
        if by_steps <= MAX_SHOWN_ERROR:
            study.reach = Reach(level.fineness, by_steps, description.order, study.next)
        if study.next > description.max_fineness:
            study.closed = f"needs more than {description.max_fineness} {description.unit}, its most"
        elif len(study.levels) > MAX_LEVELS:
            study.closed = NOT_CONVERGING
    return True


def _needed(study: Study, level: Level, tolerance: float) -> int:
    """Return about the least fineness within the tolerance; 0 where more modes are needed."""
    description, order = study.description, _shown_order(study, level)

    def unseen_at(fineness: int) -> float:
        return study.magnified * description.unseen(fineness, level.history)

    def falls_to(left: float) -> int:
        sought = MARGIN * level.fineness * math.pow(level.by_steps / left, 1.0 / order)
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
    """Return the order that errors of single runs show, at most the declared one."""
    order, first = study.description.order, study.levels[0]
    if first.fineness >= level.fineness or 0.0 in (first.by_steps, level.by_steps):
        return order  # a run that ends as the faces meet may show no error at all
    shown = math.log(first.by_steps / level.by_steps) / math.log(level.fineness / first.fineness)
    return min(max(shown, MIN_ORDER_SHARE * order), order)


def _saves(study: Study, level: Level) -> bool:
    """Return whether a coarser run in place of one within the tolerance is worth its time."""
    if any(each.fineness == study.next for each in study.levels):
        return False
    least = MIN_SAVING_ALONE if choosing_s(study) <= MAX_CHOOSING * study.seconds else MIN_SAVING_OF_SHORT
    return study.description.seconds(level.fineness) > least * study.seconds
