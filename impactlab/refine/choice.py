"""The automatic choice: levels of the cheapest descriptions are run until one keeps the tolerance."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Sequence
from functools import partial

from impactlab.errors import CaseError, ImpactlabError, StepError
from impactlab.history.base import AbstractHistory, Warned
from impactlab.refine import reach
from impactlab.refine.choice_record import Candidate, Choice, Ladder, Verdict
from impactlab.refine.convergence import (
    SHOWN_SAFETY,
    TWO_LEVEL_SAFETY,
    Level,
    Progress,
    Reach,
    Study,
    error_of_two,
    finest_error,
)
from impactlab.refine.cost import FIXED_S
from impactlab.refine.descriptions import EXACT_ERROR, Description
from impactlab.refine.distances import counted, difference, distances
from impactlab.refine.serving import exact_for, for_choice
from impactlab.scene.method import Method, Simulation, laws_of
from impactlab.scene.problem import Scene
from impactlab.simulate import driver
from impactlab.simulate.checks import gain_of

BUDGET_S = 3.0  # s of predicted solving that may go into one choice
MIN_SPEEDUP = 1.6  # predicted, of a description that is tried although a run keeps the tolerance
MAX_CHOOSING = 10.0  # times the solving of a run may go into choosing it
EXACT_ADVANTAGE = 1.25  # of the exact solver, which needs no trial, over a prediction that is a little lower
SAME_COST_RATIO = 1.25  # of predicted costs, within which the run with less error is preferred
MAX_TELLING = 0.1  # of an error: coarser runs say nothing of how it falls
FIRST_S = 6.0 * FIXED_S  # s of predicted solving, at most, of the first run of a description
MIN_SAVING = 2.5  # times cheaper a run must promise to be, to be tried although the choice has taken long
MAX_LEARNT = 10.0  # of an estimated over a predicted error, that other descriptions start with
MIN_GROWTH = 2.0  # of the same where no level keeps the tolerance: a finer run also shows the errors of coarser ones
MAX_GROWTH = 2.6  # of the fineness from level to level: across a longer step no order shows
MARGIN = 1.1  # factor on the fineness that an estimate asks for
PROBE_S = 0.05  # s of predicted solving, at most, of the first trial of a description
MAX_LEVELS = 12  # of one description
EXTRA_ORDER = 1.0  # over the declared order, with which errors may fall at first
ORDER_MARGIN = 1.5  # on the order that the errors of a description show, before it is ended for its cost
MIN_SHOWN_ORDER = 0.1
MAX_FAILURES = 3  # levels of a description that may fail, each followed by one of twice the fineness
MAX_GAIN_RATIO = 10.0  # of the energy that a run gains, over the reference energy, to the error that is stated
MIN_CONTACT_STEPS = 6  # in a period of contact: with fewer of them no order shows
MIN_IMPULSE_SHARE = 1e-2  # of the impulse of a contact: shorter periods that give less need no such resolution
PEAK_MARGIN = 1.5  # on distances of peak forces, which converge less evenly than displacements (docs/audit.md)
CHEAPEST = "the cheapest found within the tolerance"
NOT_CONVERGING = "does not converge to the tolerance"
DONE = "done"  # of a study that needs no further level


def first_guess(scene: Scene, method: Method) -> Simulation:
    """Return the description that is predicted to be the cheapest within the tolerance."""
    studies, why = studies_of(Simulation(scene, method))
    if not studies:
        raise _nothing_serves(why, studies)
    study = min(studies, key=_priority)
    return study.description.simulation(study.next)


def run(scene: Scene, method: Method, progress: Progress | None = None) -> AbstractHistory:
    """Return the history of the cheapest description that keeps the tolerance.

    Where the exact solver serves and no stepped description promises to be much faster, it is taken without a trial.
    Else the descriptions are studied in order of their predicted cost: each is run at two levels of fineness, and
    finer until its estimated error, times a safety factor, lies within the tolerance.

    Raises
    ------
    CaseError
        Where no description serves: two masses in hard contact, or an overlap. Where the tolerance is out of reach,
        with the best that could be reached.
    StepError
        Where every candidate fails on the way.
    """
    began = clock.perf_counter()
    asked = Simulation(scene, method)
    served = exact_for(asked)
    failed: list[ImpactlabError] = []
    studies: list[Study] = []
    best, why = at_once(served[0], asked, failed, progress), served[1]
    if best is None:
        studies, why = studies_of(asked, served)
        best = searched(studies, asked, failed, progress)
    if best is None:
        raise failed[0] if failed else _nothing_serves(why, studies)
    study, level = best
    if level.error > allowed(method) and (refused := reach.refusal(allowed(method), studies, best, BUDGET_S)):
        raise refused
    history, description = level.history, study.description
    if studies:
        candidates: Sequence[Candidate] = tuple(_candidates(studies, study, level, why))
    else:  # no prediction was needed: they are made where someone reads them
        chosen = candidate(study, level, "chosen", level.reason or CHEAPEST)
        candidates = Ladder(partial(_beside, chosen, study.description.seconds(0), asked))
    choosing = clock.perf_counter() - began - level.run_s
    driver.add_warnings(history)
    history.choice = Choice(
        tolerance=allowed(method),
        method=history.method,
        chosen=description.words(level.fineness),
        expected_error=level.error,
        estimate=_words_of_estimate(study, history),
        ladder=candidates,
        choosing_s=choosing,
    )
    history.scene, history.method = scene, method
    if not history.choice.met:
        text = (
            f"no description that a choice may try keeps {allowed(method):g}: the best one has an estimated error of "
            f"{level.error:.2g} ({history.choice.chosen})"
        )
        history.warnings.append(Warned("tolerance_not_met", text))
    return history


def studies_of(asked: Simulation, served: tuple[Description | None, str] | None = None) -> tuple[list[Study], str]:
    """Return a study of every description, and why the exact solver does not serve, unless ``served`` has it."""
    descriptions, why = for_choice(asked, served)
    error = allowed(asked.method)
    return [Study(each, _start(each, error), wanted=each.start_for(error)) for each in descriptions], why


def _start(description: Description, error: float) -> int:
    """Return the first fineness of a description: no finer than a run that is cheap, as its prediction may be wrong."""
    start = description.start_for(error)
    if not description.unit or description.seconds(start) <= FIRST_S:
        return start
    low, high = description.min_fineness, start
    while high - low > max(1, low // 16):
        middle = (low + high) // 2
        low, high = (middle, high) if description.seconds(description.whole(middle)) <= FIRST_S else (low, middle)
    return description.whole(low)


def at_once(
    exact: Description | None, asked: Simulation, failed: list[ImpactlabError], progress: Progress | None = None
) -> tuple[Study, Level] | None:
    """Return the exact run where its march is predicted to cost no more than the least of any run with steps."""
    if exact is None or exact.seconds(0) > EXACT_ADVANTAGE * FIXED_S:
        return None
    return searched([Study(exact, 0)], asked, failed, progress)


def allowed(method: Method) -> float:
    """Return the relative error that a method allows; 0 without a tolerance."""
    return 0.0 if method.tolerance is None else method.tolerance.error


def searched(
    studies: list[Study], asked: Simulation, failed: list[ImpactlabError], progress: Progress | None = None
) -> tuple[Study, Level] | None:
    """Run levels, the cheapest first, until one keeps the tolerance; return the best."""
    tolerance, left = allowed(asked.method), BUDGET_S
    best: tuple[Study, Level] | None = None
    while waiting := [study for study in studies if not study.closed]:
        _learn(studies, tolerance)
        study = min(waiting, key=_priority)
        met = best is not None and best[1].error <= tolerance
        if best is not None and met and not _worth_trying(study, best, studies):
            break
        if not met and study.description.unit:
            if not study.levels and _cost_of_trial(study) > min(PROBE_S, left):
                study.next = _affordable(study, min(PROBE_S, left)) or study.next
            elif reach.needed_s(study) > left:
                study.closed = reach.reason(study, left)
                continue
        if _cost_of_trial(study) > left:
            study.closed = _beyond_budget(study)
            continue
        left -= _cost_of_trial(study)
        try:
            _tried(study, asked, progress)
        except StepError as error:
            failed.append(error)
            study.failures += 1
            study.next = study.description.whole(2 * study.next)
            if study.failures > MAX_FAILURES:
                study.closed = f"failed: {error.text}"
            continue
        except ImpactlabError as error:
            failed.append(error)
            study.closed = f"refused: {error.text}"
            continue
        for level in study.levels:  # a finer run may have lowered the errors of coarser ones
            if best is None or _better((study, level), best, tolerance):
                best = study, level
    return best


def _priority(study: Study) -> float:
    """Return the predicted cost that orders studies: seconds of solving, and a tenth of those of setting up a level."""
    description = study.description
    if not description.unit:
        return study.seconds / EXACT_ADVANTAGE
    return description.cost.margin * study.expected_s + description.cost.setup_s / MAX_CHOOSING


def _learn(studies: list[Study], tolerance: float) -> None:
    """Begin untried descriptions as much finer as the tried ones, at their best, are wrong beyond their predictions.

    The cause is mostly common to all: a contact that rises faster than predicted, or touches again.
    """
    known = [study for study in studies if study.reach is not None]
    if not known:
        return
    ratios = [study.reach.error / study.description.error(study.reach.fineness) for study in known if study.reach]
    ratio = min(max(min(ratios), 1.0), MAX_LEARNT)
    for study in studies:
        if study.description.unit and not study.levels and not study.failures:
            study.next = max(study.next, _start(study.description, tolerance / ratio))
            study.wanted = max(study.wanted, study.description.start_for(tolerance / ratio))


def _cost_of_trial(study: Study) -> float:
    """Return the predicted seconds of solving the next level, and the coarser one that the first one needs."""
    first = study.description.unit and not study.levels
    return study.seconds + (study.description.seconds(study.description.coarser(study.next)[0]) if first else 0.0)


def _affordable(study: Study, seconds: float) -> int | None:
    """Return a fineness near the largest whose trial takes so long [s], at most the next one; None where none does."""
    description, fineness = study.description, study.next
    while fineness >= description.min_fineness:
        trial = Study(description, description.whole(fineness), study.levels)
        if _cost_of_trial(trial) <= seconds:
            return trial.next
        fineness = int(0.8 * fineness)
    return None


def _beyond_budget(study: Study) -> str:
    return f"would take {_cost_of_trial(study):.2g} s of solving, beyond the {BUDGET_S:g} s that a choice may take"


def _worth_trying(study: Study, best: tuple[Study, Level], studies: list[Study]) -> bool:
    """Return whether a study promises a much cheaper run than one within the tolerance, and trying it costs little.

    All trials together may take `MAX_CHOOSING` times the solving of the chosen run.
    """
    if _seconds(best) <= MIN_SPEEDUP * study.expected_s:
        return False
    return spent_s(studies, study) <= MAX_CHOOSING * study.expected_s


def spent_s(studies: list[Study], following: Study) -> float:
    """Return the predicted seconds of all runs so far, and of the set-up of one that follows."""
    runs = [(each.description, level.fineness) for each in studies for level in each.levels]
    return following.description.cost.setup_s + sum(each.cost.setup_s + each.seconds(n) for each, n in runs)


def _seconds(run: tuple[Study, Level]) -> float:
    return run[0].description.seconds(run[1].fineness)


def _better(one: tuple[Study, Level], best: tuple[Study, Level], tolerance: float) -> bool:
    """Return whether a run is to be preferred: within the tolerance the cheaper one, else the one with less error."""
    finer = one[1].error < best[1].error
    if max(one[1].error, best[1].error) <= tolerance:
        return _seconds(one) < _seconds(best) * (SAME_COST_RATIO if finer else 1.0 / SAME_COST_RATIO)
    return finer


def _tried(study: Study, asked: Simulation, progress: Progress | None) -> None:
    """Run the next level, the first time one that is coarser after it; estimate errors and set the next fineness.

    The finer one comes first: its modes serve the coarser one too.
    """
    description = study.description
    if not description.unit:
        level = study.run(0, progress)
        level.error, study.closed = EXACT_ERROR, DONE
        return
    wanted = [study.next]
    if not study.levels:
        wanted.append(description.coarser(study.next)[0])
        study.next = wanted[0] = max(study.next, description.whole(wanted[1] + 1))
    for fineness in wanted:
        study.run(fineness, progress)
    estimate_errors(study, asked)


def estimate_errors(study: Study, asked: Simulation) -> None:
    """Set the error of every level, and the next fineness or why none follows."""
    description, levels, tolerance = study.description, study.levels, allowed(asked.method)
    finest = levels[-1]
    errors, by_order = _extrapolated(levels, asked, description)
    least = _distance_to_check(study)
    for level, error in zip(levels, errors, strict=True):
        level.error, level.reason = max(error, least), ""
        gain = gain_of(level.history)
        if gain / MAX_GAIN_RATIO > max(level.error, tolerance):
            level.error, level.reason = gain / MAX_GAIN_RATIO, f"gains {gain:.2g} of the reference energy"
        elif not _resolves_contacts(level.history, asked):
            level.error, level.reason = math.inf, f"fewer than {MIN_CONTACT_STEPS} steps in a period of contact"
        elif level.error > tolerance:
            level.reason = f"expected error {level.error:.2g} beyond the tolerance"
    # By the declared order: one that has not shown yet may still do so, and a run too fine costs more.
    needed = finest.fineness * MARGIN * (max(by_order, 1e-300) / tolerance) ** (1.0 / description.order)
    if not math.isfinite(needed) or finest.error > errors[-1]:
        needed = 2.0 * finest.fineness
    elif by_order <= MAX_TELLING:
        study.reach = _reach(study, by_order, tolerance)
    met = [level.fineness for level in levels if level.error <= tolerance]
    study.next = max(description.min_fineness, math.ceil(min(needed, MAX_GROWTH * finest.fineness)))
    if not met:
        study.next = max(study.next, math.ceil(MIN_GROWTH * finest.fineness))
    study.next = min(description.whole(study.next), description.max_fineness)
    # A run that is cheaper by little is not worth the time of another level.
    cheapest = description.seconds(min(met)) if met else math.inf
    needless = cheapest <= MIN_SPEEDUP * study.seconds
    if needless or (cheapest <= MIN_SAVING * study.seconds and spent_s([study], study) > MAX_CHOOSING * study.seconds):
        study.closed = DONE
    if study.next in [level.fineness for level in levels]:
        study.closed = DONE if met else NOT_CONVERGING
    if len(levels) > MAX_LEVELS or (not met and finest.fineness >= description.max_fineness):
        study.closed = NOT_CONVERGING


def _reach(study: Study, error: float, tolerance: float) -> Reach:
    """Return how far a study gets; of four runs and more, by the order that their errors show, with a margin."""
    finest, order = study.levels[-1], study.description.order + EXTRA_ORDER
    study.falling[finest.fineness] = error
    first = min(study.falling)
    if len(study.falling) > 2 and first < finest.fineness:
        shown = math.log(max(study.falling[first] / error, 1.0)) / math.log(finest.fineness / first)
        order = min(order, max(ORDER_MARGIN * shown, MIN_SHOWN_ORDER))
    return Reach(finest.fineness, error, order, finest.fineness * math.pow(max(error / tolerance, 1.0), 1.0 / order))


def _extrapolated(levels: list[Level], asked: Simulation, description: Description) -> tuple[list[float], float]:
    """Return the error of each level, by its distance to the finest one, and the error of that by the declared order.

    Each is the largest over the quantities that count. The second one says how fine the next level must be; of three
    levels and more it is the stated error of the finest.
    """
    last = len(levels) - 1
    fineness = [level.fineness for level in levels]
    order, safety = description.order, description.safety
    found, by_order = [], []
    for pairs in distances([level.history for level in levels], *counted(asked), PEAK_MARGIN) if last else ():
        if last == 1:
            error = error_of_two(pairs[0, 1], fineness[0], fineness[1], order) * max(safety, TWO_LEVEL_SAFETY)
            by_order.append(SHOWN_SAFETY * pairs[0, 1] / ((fineness[1] / fineness[0]) ** order - 1.0))
        else:
            error = finest_error(pairs, fineness, order).with_safety(safety)
            by_order.append(error)
        found.append((pairs, error))
    if not found:
        return [math.inf] * len(levels), math.inf
    errors = [max((pairs[i, last] if i < last else 0.0) + error for pairs, error in found) for i in range(len(levels))]
    return errors, max(by_order)


def _distance_to_check(study: Study) -> float:
    """Return the distance of the finest level to a run off the special step.

    It is 0 where it is within the error of that run.

    Levels with c dt = h have an advantage in common, so that two of them may agree by luck.
    """
    description, finest = study.description, study.levels[-1]
    if description.check is None:
        return 0.0
    # Peak forces are left out: those of an ordinary mesh ring behind a front.
    scene, method = description.check(finest.fineness)
    beside = driver.run(scene, method, with_warnings=False)
    apart = difference(finest.history, beside, scene, method.laws, ("displacements", "impulses"))
    return apart if apart > description.check_error(finest.fineness) else 0.0


def _resolves_contacts(history: AbstractHistory, asked: Simulation) -> bool:
    """Return whether each period of contact under a compliant law spans enough steps for the order to show."""
    if history.dt is None:
        return True
    for contact, law in zip(asked.scene.contacts, laws_of(*asked), strict=True):
        if law.hard or not law.answers_force:
            continue
        spans = history.spans(contact.name)
        total = sum(span.impulse for span in spans)
        for span in spans:
            counts = span.impulse > MIN_IMPULSE_SHARE * total
            if counts and span.end is not None and span.end - span.start < MIN_CONTACT_STEPS * history.dt:
                return False
    return True


def _candidates(studies: list[Study], chosen: Study, best: Level, why: str) -> list[Candidate]:
    """Return the outcome of every candidate, those of the chosen description first."""
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
            reason = _longer(study.seconds, chosen.description.seconds(best.fineness))
            found.append(candidate(study, None, "not run", reason))
    return found + not_served(why)


def _beside(chosen: Candidate, seconds: float, asked: Simulation) -> list[Candidate]:
    """Return the exact run that was chosen at once, and the descriptions that were not run beside it."""
    found = [chosen]
    for study in studies_of(asked, (None, ""))[0]:
        found.append(candidate(study, None, "not run", _longer(study.seconds, seconds)))
    return found


def _longer(seconds: float, chosen: float) -> str:
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
    """Return the record of the exact solver where it does not serve, for a reason."""
    return [Candidate("continuous, from event to event", None, None, verdict="refused", reason=why)] if why else []


def _words_of_estimate(study: Study, history: AbstractHistory) -> str:
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


def _nothing_serves(why: str, studies: list[Study]) -> CaseError:
    if studies:
        reasons = "; ".join(f"{study.description.name}: {study.closed}" for study in studies)
        return CaseError(
            f"no description can be tried: {reasons}",
            remedy="Give a shorter duration, or model, integrator and step of your own.",
            path="solve.tolerance",
        )
    return CaseError(
        f"no description serves this scene: {why or 'its contacts have no unique solution'}",
        remedy="Give the contact a law with a stiffness or a restitution, or model, integrator and step of your own.",
        path="solve.tolerance",
    )
