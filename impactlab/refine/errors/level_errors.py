"""Richardson extrapolation over all quantities that count, and the next level."""

from __future__ import annotations

import math

from impactlab.history.base import AbstractHistory
from impactlab.metrics.fronts import MIN_JUMP
from impactlab.refine import trial
from impactlab.refine.convergence import (
    SHOWN_SAFETY,
    Level,
    Reach,
    Study,
    error_of_two,
    finest_error,
)
from impactlab.refine.descriptions.cost import ALIKE_S
from impactlab.refine.descriptions.description import MIN_ORDER_SHARE, RATIO, TWO_LEVEL_SAFETY, Description
from impactlab.refine.errors.distances import counted, difference, distances
from impactlab.refine.errors.magnification import magnified_by_sensitive_touches, magnified_by_touches
from impactlab.refine.errors.near_misses import may_close
from impactlab.refine.errors.smooth_touch import order_share
from impactlab.scene.method import Method, Simulation, laws_of
from impactlab.simulate.checks import gain_of

MIN_SPEEDUP = 1.25  # predicted, of a further run over one within the tolerance, while choosing stays short
MAX_CHOOSING = 10.0  # predicted time of choosing over that of solving the chosen run, up to which it is short
MIN_SAVING = 1.6  # as MIN_SPEEDUP where choosing takes longer than that
MIN_SAVING_OF_SETUP = 2.5  # as MIN_SAVING for a run with a set-up of its own
ESTIMATE_S = 4e-4  # s, of an estimate of errors, and of a run beside its set-up and steps
DESCRIBED_S = 3e-4  # s, of describing a scene
MIN_LEFT = 0.1  # of a tolerance: least share left for the steps beside the error that all levels have in common
MAX_SHOWN_ERROR = 0.1  # largest error that falls by its order; those of coarser runs follow none
MIN_GROWTH = 1.6  # of the fineness, to the next level while none is within the tolerance
MAX_GROWTH = 2.6  # of the fineness from level to level: across a larger ratio no order shows
MIN_BETWEEN = 0.8  # fineness needed, over that of the coarser of two runs, from which a third is run between them
MARGIN = 1.1  # factor on the fineness that an estimate requires
MAX_LEVELS = 12  # of one description
EXTRA_ORDER = 1.0  # over the declared order, with which errors may fall at first
ORDER_MARGIN = 1.5  # on the order that the errors of a description show, before it is ended for its cost
MIN_SHOWN_ORDER = 0.1
MANY_RUNS = 5  # of one description: fewer of them, which fall unevenly, do not show an order below the least assumed
MAX_GAIN_RATIO = 10.0  # energy that a run gains, over the reference energy, over the error that is stated
MIN_CONTACT_STEPS = 6  # in a period of contact: with fewer of them no order shows
MIN_IMPULSE_SHARE = 1e-2  # of the impulse of a contact: periods with less need no such resolution
PEAK_MARGIN = 1.5  # on distances of peak forces, which converge less evenly than displacements (docs/audit.md)
UNEVEN_SAFETY = 3.0  # safety of descriptions whose errors fall unevenly: fronts lie elsewhere in an element in each run
UNEVEN_MARGIN = 1.5  # on the distance of their runs from the finest one, which may share much of its error
NOT_CONVERGING = "does not converge to the tolerance"
MIN_FALLING = 4  # runs, from which an error that no longer falls is not taken for magnified by touches
MAX_UNSEEN = 0.6  # of a tolerance: with more of it in common to all runs, no room is left for the errors that runs show
UNSEEN = "the error that its runs have in common is too large"
DONE = "done"  # of a study that needs no further level


def allowed(method: Method) -> float:
    """Return the relative error that a method allows; 0 without a tolerance."""
    return 0.0 if method.tolerance is None else method.tolerance.error


def spent_s(studies: list[Study], following: Study | None = None) -> float:
    """Return the predicted time of all runs so far [s].

    The set-up of one that follows is included, if any.
    """
    found = 0.0
    for each in studies:
        runs = [level.fineness for level in each.levels]
        if each is following:
            runs += [each.next] if runs else [each.next, each.description.coarser(each.next)[0]]
        found += each.description.setup_s(*runs) + sum(
            each.description.seconds(level.fineness) for level in each.levels
        )
    return found


def choosing_s(study: Study) -> float:
    """Return the predicted time of choosing with one more run [s].

    It is that of all runs except the one that is chosen.
    """
    description, count = study.description, len(study.levels)
    one_s = ESTIMATE_S + (ALIKE_S if description.alike else description.cost.setup_s)
    return DESCRIBED_S + count * one_s + sum(description.seconds(level.fineness) for level in study.levels)


def estimate_errors(study: Study, request: Simulation) -> None:
    """Set the errors of all levels, and the fineness of the next.

    Where no level follows, set the reason.
    """
    description, levels, tolerance = study.description, study.levels, allowed(request.method)
    finest = levels[-1]
    study.order_share = order_share(description, [level.history for level in levels], request)
    errors, by_order = _extrapolated(levels, request, description, study.order_share)
    least = _distance_to_check(study) if min(errors)[0] <= tolerance else 0.0
    magnified = magnified_by_touches(description, finest, errors[-1][0])
    if len(levels) >= MIN_FALLING and not _falls(study, finest.fineness, by_order):
        magnified = min(magnified, study.magnified)  # an uneven error, which no touch magnified
    study.magnified = magnified
    unseen = study.magnified * description.unseen(finest.fineness, finest.history)
    if min(errors)[0] + unseen <= tolerance:
        study.magnified *= magnified_by_sensitive_touches(description, finest.history, request, unseen)
        unseen = study.magnified * description.unseen(finest.fineness, finest.history)
    for level, (error, worst) in zip(levels, errors, strict=True):
        level.worst, level.alone = worst if error >= least else "", False
        unseen_here = study.magnified * description.unseen(level.fineness, finest.history)
        level.error, level.reason = max(error, least) + unseen_here, ""
        if level.gain / MAX_GAIN_RATIO > max(level.error, tolerance):
            level.error, level.worst, level.reason = level.gain / MAX_GAIN_RATIO, "", gains(level)
        elif not resolves_contacts(level.history, request):
            level.error, level.worst = math.inf, ""
            level.reason = f"fewer than {MIN_CONTACT_STEPS} steps in a period of contact"
        elif level.error > tolerance:
            level.reason = f"expected error {level.error:.2g} beyond the tolerance"
        elif contact := may_close(level.history, request, level.error):
            level.error, level.worst = math.inf, ""
            level.reason = f"the least gap of {contact} is smaller than its error, so that the contact may close"
    # By the declared order: it may show later even if it has not yet, and too fine a run costs more.
    left = max(tolerance - unseen, MIN_LEFT * tolerance)
    needed = finest.fineness * MARGIN * (max(by_order, 1e-300) / left) ** (1.0 / description.order)
    if not math.isfinite(needed) or finest.error > errors[-1][0] + unseen:
        needed = 2.0 * finest.fineness
    elif by_order <= MAX_SHOWN_ERROR:
        study.reach = _reach(study, by_order, left)
    met = [level.fineness for level in levels if level.error <= tolerance]
    study.next = max(description.min_fineness, math.ceil(min(needed, MAX_GROWTH * finest.fineness)))
    promised = study.next  # fineness of the run that the next one may show to be within the tolerance
    coarsest = levels[0].fineness
    shows = coarsest >= min(description.min_fineness, finest.fineness // 2)
    beside = needed > MIN_BETWEEN * coarsest
    again = beside and needed * MIN_BETWEEN < coarsest  # a run about as fine as the coarser one shows no order
    third = len(levels) == 2 and needed <= finest.fineness
    if third and ((description.alike and (met or shows)) or (met and again)):
        # Three runs show the order, and the third may be cheaper than the finest one.
        if beside:
            study.next = round(finest.fineness / RATIO)
            promised = coarsest if needed <= coarsest else max(study.next, math.ceil(needed))
        else:
            study.next = promised = max(math.ceil(needed), round(coarsest / MAX_GROWTH))
        study.next = max(study.next, description.min_fineness // 3)
    elif not met:
        study.next = promised = max(study.next, math.ceil(MIN_GROWTH * finest.fineness))
    study.next = min(description.whole(study.next), description.max_fineness)
    study.closed = _why_closed(study, met, promised, unseen > MAX_UNSEEN * tolerance)


def _falls(study: Study, fineness: int, error: float) -> bool:
    """Return whether an error fell by half the declared order from the finest estimate before."""
    last = max(study.falling, default=fineness)
    order = MIN_ORDER_SHARE * study.description.order
    return error <= study.falling.get(last, math.inf) * math.pow(last / fineness, order)


def _why_closed(study: Study, met: list[int], promised: int, too_few: bool) -> str:
    """Return the reason why no level follows; empty where one does.

    Parameters
    ----------
    study : Study
        With its next fineness.
    met : list of int
        Fineness of the levels within the tolerance.
    promised : int
        Fineness of the run that the next level may show to be within the tolerance.
    too_few : bool
        Whether the error that all levels have in common is too large.
    """
    description, levels = study.description, study.levels
    if len(levels) > MAX_LEVELS:
        return NOT_CONVERGING
    if not met and levels[-1].fineness >= description.max_fineness:
        return f"needs more than {description.max_fineness} {description.unit}, its most"
    if description.otherwise is not None and not met and too_few:
        return UNSEEN
    if study.next in [level.fineness for level in levels]:
        return DONE if met else NOT_CONVERGING
    # A slightly cheaper run is not worth the time of another level.
    promised_s = description.seconds(promised)
    least = MIN_SAVING if description.alike else MIN_SAVING_OF_SETUP
    if choosing_s(study) <= MAX_CHOOSING * promised_s:
        least = MIN_SPEEDUP
    return DONE if met and description.seconds(min(met)) <= least * promised_s else study.closed


def keeps_energy(study: Study, level: Level, tolerance: float) -> bool:
    """Return whether a checked run's energy gain suits its error.

    Otherwise raise its error. A study that was done then continues.
    """
    level.gain = gain_of(level.history) if study.description.unit else 0.0
    if level.gain / MAX_GAIN_RATIO <= max(level.error, tolerance):
        return True
    level.error, level.worst, level.reason = level.gain / MAX_GAIN_RATIO, "", gains(level)
    if study.closed == DONE:
        study.closed = ""
        study.next = study.description.whole(math.ceil(MIN_GROWTH * study.levels[-1].fineness))
    return False


def gains(level: Level) -> str:
    """Return the energy gain of a run as text for a message."""
    return f"gains {level.gain:.2g} of the reference energy"


def _reach(study: Study, error: float, tolerance: float) -> Reach:
    """Return the fineness that a study needs for a tolerance.

    It follows from the declared order or, from four runs on, from the one that shows.
    """
    finest, order = study.levels[-1], study.description.order + EXTRA_ORDER
    study.falling[finest.fineness] = error
    first = min(study.falling)
    if len(study.falling) > 2 and first < finest.fineness:
        shown = math.log(max(study.falling[first] / error, 1.0)) / math.log(finest.fineness / first)
        least = MIN_SHOWN_ORDER if len(study.falling) >= MANY_RUNS else MIN_ORDER_SHARE * study.description.order
        order = min(order, max(ORDER_MARGIN * shown, least))
    return Reach(finest.fineness, error, order, finest.fineness * math.pow(max(error / tolerance, 1.0), 1.0 / order))


def _extrapolated(
    levels: list[Level], request: Simulation, description: Description, share: float
) -> tuple[list[tuple[float, str]], float]:
    """Return the error of each level, and the finest one's by order.

    The first follow from the distances to the finest level, the second from the declared order. Each is the largest
    over the quantities that count; those of the levels carry the name of that quantity. The second result determines
    the next fineness; from three levels on it is the stated error of the finest level.
    """
    last = len(levels) - 1
    fineness = [level.fineness for level in levels]
    order, safety = description.order, description.safety
    found, by_order = [], []
    histories, least_jump = [level.history for level in levels], allowed(request.method) or MIN_JUMP
    apart = distances(histories, *counted(request), PEAK_MARGIN, least_jump) if last else []
    if last and not apart and not any(history.contacts for history in histories):
        scene, laws, _ = counted(request)  # nothing that counts: the displacements show whether a contact may close
        apart = distances(histories, scene, laws, ("displacements",))
        if not apart:
            return [(0.0, "")] * len(levels), 0.0  # all bodies stay at rest
    for of, pairs in apart:
        if last == 1:
            of_two = error_of_two(pairs[0, 1], fineness[0], fineness[1], order, share)
            error = of_two * max(safety, TWO_LEVEL_SAFETY)
            margin = 1.0
            by_order.append(SHOWN_SAFETY * pairs[0, 1] / ((fineness[1] / fineness[0]) ** order - 1.0))
        else:
            estimate = finest_error(pairs, fineness, order)
            error = estimate.with_safety(safety)
            margin = UNEVEN_MARGIN if safety >= UNEVEN_SAFETY and not estimate.shown else 1.0
            by_order.append(error)
        found.append((of, pairs, error, margin))
    if not found:
        return [(math.inf, "")] * len(levels), math.inf
    errors = [
        max(((margin * pairs[i, last] if i < last else 0.0) + error, of) for of, pairs, error, margin in found)
        for i in range(len(levels))
    ]
    return errors, max(by_order)


def _distance_to_check(study: Study) -> float:
    """Return the distance of the finest level to a check run.

    The check run is off the special step c dt = h. The distance is 0 if within the error of that run. Levels with c dt
    = h share an advantage, so that two of them may agree by chance.
    """
    description, finest = study.description, study.levels[-1]
    if description.check is None:
        return 0.0
    # Peak forces are left out: those of an ordinary mesh ring behind a front.
    scene, method = description.check(finest.fineness)
    beside, _ = trial.run(Simulation(scene, method), None, None, None)  # it is compared alone: no balance is checked
    apart = difference(finest.history, beside, scene, method.laws, ("displacements", "impulses"))
    return apart if apart > description.check_error(finest.fineness) else 0.0


def resolves_contacts(history: AbstractHistory, request: Simulation) -> bool:
    """Return whether contact periods under compliant laws have enough steps for an order."""
    if history.dt is None:
        return True
    for contact, law in zip(request.scene.contacts, laws_of(*request), strict=True):
        if law.hard or not law.answers_force:
            continue
        spans = history.spans(contact.name)
        total = sum(span.impulse for span in spans)
        for span in spans:
            counts = span.impulse > MIN_IMPULSE_SHARE * total
            if counts and span.end is not None and span.end - span.start < MIN_CONTACT_STEPS * history.dt:
                return False
    return True
