"""The automatic choice: levels of the cheapest descriptions are run until one keeps the tolerance."""

from __future__ import annotations

import itertools
import math
import time as clock
from collections.abc import Iterable, Iterator
from functools import partial

from impactlab.errors import CaseError, ImpactlabError, StepError
from impactlab.history.base import AbstractHistory, Warned
from impactlab.numerics.garbage_collection import GarbageCollectionPaused
from impactlab.refine import reach, serving
from impactlab.refine.choice_record import Candidate, Choice, Ladder
from impactlab.refine.convergence import Level, Progress, Study
from impactlab.refine.cost import FIXED_S
from impactlab.refine.description import Description
from impactlab.refine.descriptions import EXACT_ERROR
from impactlab.refine.ladder import candidate, candidates, longer, not_served, words_of_estimate
from impactlab.refine.level_errors import (
    DONE,
    MAX_CHOOSING,
    UNSEEN,
    allowed,
    estimate_errors,
    keeps_energy,
    spent_s,
)
from impactlab.refine.serving import exact_for
from impactlab.refine.trial import no_check
from impactlab.scene.method import Method, Simulation
from impactlab.scene.problem import Scene
from impactlab.simulate import driver

BUDGET_S = 3.0  # s of predicted solving that may go into one choice
EXACT_ADVANTAGE = 1.25  # of the exact solver, which needs no trial, over a prediction that is a little lower
SAME_COST_RATIO = 1.25  # of predicted costs, within which the run with less error is preferred
FIRST_S = 12.0 * FIXED_S  # s of predicted solving, at most, of the first run of a description
FIRST_ALIKE_S = 40.0 * FIXED_S  # the same where a third run needs no set-up of its own
MAX_SURE_S = 4.0 * FIXED_S  # s of predicted solving, up to which comparing others takes longer than they may save
MIN_GAIN = 2.0  # predicted, over a run that keeps the tolerance, of another description that is tried all the same
MAX_LEARNT = 10.0  # of an estimated over a predicted error, that other descriptions start with
PROBE_S = 0.05  # s of predicted solving, at most, of the first trial of a description
MAX_FAILURES = 3  # levels of a description that may fail
FINER = 3  # times the fineness of a level that failed is that of the next: the coarser one beside it is finer, too


def first_guess(scene: Scene, method: Method) -> Simulation:
    """Return the description that is predicted to be the cheapest within the tolerance."""
    studies, why = studies_of(Simulation(scene, method))
    if not studies:
        raise _nothing_serves(why, studies)
    study = min(studies, key=_priority)
    return study.description.simulation(study.wanted)


def run(scene: Scene, method: Method, progress: Progress | None = None) -> AbstractHistory:
    """Return the history of the cheapest description that keeps the tolerance.

    Where the exact solver applies and no stepped description promises to be much faster, it is taken without a trial.
    Else the descriptions are studied in order of their predicted cost: each is run at two levels of fineness, and
    finer until its estimated error, times a safety factor, lies within the tolerance.

    Raises
    ------
    CaseError
        Where no description is suitable: two masses in hard contact, or an overlap. Where the tolerance is out of
        reach, with the best that could be reached.
    StepError
        Where every candidate fails on the way.
    """
    began = clock.perf_counter()
    asked = Simulation(scene, method)
    served = exact_for(asked)
    failed: list[ImpactlabError] = []
    studies: list[Study] = []
    others: Iterator[Study] = iter(())
    best, why = at_once(served[0], asked, failed, progress), served[1]
    if best is None:
        with GarbageCollectionPaused():
            others, why = in_turn(asked, served)
            studies.extend(itertools.islice(others, 1))
            best = searched(studies, asked, failed, progress, others)
    is_met = best is not None and best[1].error <= allowed(method)
    if not is_met and (refused := reach.refusal(allowed(method), studies, best, BUDGET_S)):
        raise refused
    if best is None:
        raise failed[0] if failed else _nothing_serves(why, studies)
    study, level = best
    history, description = level.history, study.description
    tried = candidates(studies or [study], study, level)
    if not studies:  # no prediction was needed
        others = _stepped(asked)
    rungs = Ladder(partial(_ladder, tried, others, description.seconds(level.fineness), why if studies else ""))
    choosing = clock.perf_counter() - began - level.run_s
    driver.add_warnings(history)
    history.choice = Choice(
        tolerance=allowed(method),
        method=history.method,
        chosen=description.words(level.fineness),
        expected_error=level.error,
        estimate=words_of_estimate(study, history),
        ladder=rungs,
        choosing_s=choosing,
    )
    history.scene, history.method = scene, method
    if not history.choice.met:
        text = (
            f"no description that a choice may try keeps {allowed(method):g}: the best one has an estimated error of "
            f"{level.error:.2g} ({history.choice.chosen}){_mostly(level)}"
        )
        history.warnings.append(Warned("tolerance_not_met", text))
    return history


def _mostly(level: Level) -> str:
    """Return which quantity has the error of a run, for people, and how it is left out."""
    if not level.worst:
        return ""
    return f", of the {level.worst}; solve.tolerance_on names the quantities that count"


def studies_of(asked: Simulation) -> tuple[list[Study], str]:
    """Return a study of every description, and why the exact solver does not apply."""
    studies, why = in_turn(asked)
    return list(studies), why


def in_turn(asked: Simulation, served: tuple[Description | None, str] | None = None) -> tuple[Iterator[Study], str]:
    """Return a study of every description, each made when it is asked for, and why the exact solver does not apply.

    The preferred one is the first; ``served`` is the exact solver where it has been sought.
    """
    descriptions, why = serving.in_turn(asked, served)
    error = allowed(asked.method)
    return (_begun(each, error) for each in descriptions), why


def _begun(description: Description, error: float) -> Study:
    """Return a study of a description for an error, the fineness of its first run and the one wanted."""
    if not description.unit:
        return Study(description, 0)
    start = description.start_for(error)
    begun = Study(description, _cheap(description, start), wanted=description.wanted_of(start, error))
    if (least := reach.in_common(description)) > error:
        begun.closed = reach.reason_in_common(least)
    return begun


def _cheap(description: Description, start: int) -> int:
    """Return the first fineness of a description: no finer than a run that is cheap, as its prediction may be wrong."""
    most = FIRST_ALIKE_S if description.alike else FIRST_S
    if description.seconds(start) <= most:
        return start
    low, high = description.min_fineness, start
    while high - low > max(1, low // 16):
        middle = (low + high) // 2
        low, high = (middle, high) if description.seconds(description.whole(middle)) <= most else (low, middle)
    return description.whole(low)


def at_once(
    exact: Description | None, asked: Simulation, failed: list[ImpactlabError], progress: Progress | None = None
) -> tuple[Study, Level] | None:
    """Return the exact run where its march is predicted to cost no more than the least of any run with steps."""
    if exact is None or exact.seconds(0) > EXACT_ADVANTAGE * FIXED_S:
        return None
    return searched([Study(exact, 0)], asked, failed, progress)


def searched(
    studies: list[Study],
    asked: Simulation,
    failed: list[ImpactlabError],
    progress: Progress | None = None,
    others: Iterable[Study] = (),
) -> tuple[Study, Level] | None:
    """Run levels, the cheapest first, until one keeps the tolerance; return the best.

    ``others`` are made and compared where the studies that are given do not promise a run that costs little more than
    the least of any run.
    """
    while True:
        best = _searched(studies, asked, failed, progress, others)
        if best is None or _holds(best, allowed(asked.method), failed):
            return best


def _holds(best: tuple[Study, Level], tolerance: float, failed: list[ImpactlabError]) -> bool:
    """Return whether a run keeps its balances; a study whose run failed begins again, finer."""
    study, level = best
    began = clock.perf_counter()
    try:
        level.check()
    except StepError as error:
        failed.append(error)
        study.levels, study.first, study.reach, study.falling = [], None, None, {}
        _failed(study, level.fineness, error)
        return False
    level.run_s, level.check = level.run_s + clock.perf_counter() - began, no_check
    return keeps_energy(study, level, tolerance)


def _failed(study: Study, fineness: int, error: StepError) -> None:
    """Set what follows a level that failed: a finer one, a few times; nothing after an exact run."""
    study.failures += 1
    study.next = study.description.whole(FINER * fineness)
    study.closed = f"failed: {error.text}" if study.failures > MAX_FAILURES or not study.description.unit else ""


def _searched(
    studies: list[Study],
    asked: Simulation,
    failed: list[ImpactlabError],
    progress: Progress | None,
    others: Iterable[Study],
) -> tuple[Study, Level] | None:
    """Return the best run as `searched`, its balances not checked yet."""
    tolerance, left = allowed(asked.method), BUDGET_S
    best: tuple[Study, Level] | None = None
    for study in studies:
        best = _best_of(study, best, tolerance)
    while True:
        met = best is not None and best[1].error <= tolerance
        if not _is_sure(studies, best if met else None):
            studies += others
        waiting = [study for study in studies if not study.closed]
        if not waiting:
            break
        _learn(studies, tolerance)
        study = min(waiting, key=_priority)
        if best is not None and met and not _worth_trying(study, best, studies):
            break
        if not met and study.description.unit:
            if not study.levels and _cost_of_trial(study) > min(PROBE_S, left):
                study.next = _affordable(study, min(PROBE_S, left)) or study.next
            elif reach.needed_s(study) > left:
                study.closed = reach.reason(study, left)
                continue
        if _cost_of_trial(study) > left:
            study.closed = _beyond_budget(study, left)
            continue
        left -= _cost_of_trial(study)
        if not _succeeds(study, asked, failed, progress):
            continue
        if study.closed == UNSEEN and study.description.otherwise is not None:
            other = study.description.otherwise(study.levels[-1].history)
            studies += [_begun(other, tolerance)] if other.alike else []
        best = _best_of(study, best, tolerance)  # a finer run may have lowered the errors of coarser ones
    return best


def _best_of(study: Study, best: tuple[Study, Level] | None, tolerance: float) -> tuple[Study, Level] | None:
    """Return the best of the runs of a study and a run of another one."""
    for level in study.levels:
        if best is None or _better((study, level), best, tolerance):
            best = study, level
    return best


def _is_sure(studies: list[Study], met: tuple[Study, Level] | None) -> bool:
    """Return whether no other description can solve much faster than a run that keeps the tolerance, or will do so."""
    if met is not None:
        return _seconds(met) <= MAX_SURE_S
    return min((study.expected_s for study in studies if not study.closed), default=math.inf) <= MAX_SURE_S


def _priority(study: Study) -> float:
    """Return the predicted cost that orders studies: seconds of solving, and a tenth of those of setting up a level."""
    description = study.description
    if not description.unit:
        return study.seconds / EXACT_ADVANTAGE
    ahead = [study.next] if study.levels else [study.next, description.coarser(study.next)[0]]
    setup_s = description.setup_s(*ahead)
    return description.cost.margin * study.expected_s + setup_s / MAX_CHOOSING


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
            again = _begun(study.description, tolerance / ratio)
            study.next, study.wanted = max(study.next, again.next), max(study.wanted, again.wanted)


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


def _beyond_budget(study: Study, left: float) -> str:
    needed = f"would take {_cost_of_trial(study):.2g} s of solving"
    if left < BUDGET_S:
        return f"{needed}, and {max(left, 0.0):.2g} s are left of the {BUDGET_S:g} s that a choice may take"
    return f"{needed}, beyond the {BUDGET_S:g} s that a choice may take"


def _worth_trying(study: Study, best: tuple[Study, Level], studies: list[Study]) -> bool:
    """Return whether a study promises a much cheaper run than one within the tolerance, and trying it costs little.

    All trials together may take `MAX_CHOOSING` times the solving of the chosen run.
    """
    if study is best[0]:  # its estimate has seen what a run promises
        return True
    if _seconds(best) <= MIN_GAIN * study.expected_s:
        return False
    return spent_s(studies, study) <= MAX_CHOOSING * study.expected_s


def _seconds(run: tuple[Study, Level]) -> float:
    return run[0].description.seconds(run[1].fineness)


def _better(one: tuple[Study, Level], best: tuple[Study, Level], tolerance: float) -> bool:
    """Return whether a run is to be preferred: within the tolerance the cheaper one, else the one with less error."""
    finer = one[1].error < best[1].error
    if max(one[1].error, best[1].error) <= tolerance:
        return _seconds(one) < _seconds(best) * (SAME_COST_RATIO if finer else 1.0 / SAME_COST_RATIO)
    return finer


def _tried(study: Study, asked: Simulation, progress: Progress | None) -> None:
    """Run the next level, the first time one that is coarser, too; estimate errors and set the next fineness.

    The finer one comes first where its modes are of use to the coarser one.
    """
    description = study.description
    if not description.unit:
        level = study.run(0, progress)
        level.error, study.closed = EXACT_ERROR, DONE
        return
    wanted = [study.next]
    if not study.levels:
        coarser = description.coarser(study.next)[0]
        study.next = max(study.next, description.whole(coarser + 1))
        wanted = [coarser, study.next] if description.alike else [study.next, coarser]
    for fineness in wanted:
        study.run(fineness, progress, checked=False)
    estimate_errors(study, asked)


def _succeeds(study: Study, asked: Simulation, failed: list[ImpactlabError], progress: Progress | None) -> bool:
    """Run the next level and return whether it came to its end; a study whose levels fail is closed."""
    try:
        _tried(study, asked, progress)
    except StepError as error:
        failed.append(error)
        _failed(study, study.next, error)
        return False
    except ImpactlabError as error:
        failed.append(error)
        study.closed = f"refused: {error.text}"
        return False
    return True


def show_order(study: Study, asked: Simulation) -> None:
    """Run a third level below two, so that errors are estimated by the order that a description shows."""
    if len(study.levels) != 2 or not study.description.unit:
        return
    below = study.description.coarser(study.levels[0].fineness)[1]
    if below < study.levels[0].fineness:
        study.run(below)
        estimate_errors(study, asked)


def _stepped(asked: Simulation) -> Iterator[Study]:
    """Give a study of every description that steps."""
    yield from in_turn(asked, (None, ""))[0]


def _ladder(tried: list[Candidate], others: Iterable[Study], seconds: float, why: str) -> list[Candidate]:
    """Return the candidates that were tried, those that were not, and why the exact solver does not apply."""
    beside = [candidate(study, None, "not run", longer(study.seconds, seconds)) for study in others]
    return [*tried, *beside, *not_served(why)]


def _nothing_serves(why: str, studies: list[Study]) -> CaseError:
    if studies:
        reasons = "; ".join(f"{study.description.name}: {study.closed}" for study in studies)
        return CaseError(
            f"no description can be tried: {reasons}",
            remedy="Give a shorter duration, or model, integrator and step of your own.",
            path="solve.tolerance",
        )
    return CaseError(
        f"no description suits this scene: {why or 'its contacts have no unique solution'}",
        remedy="Give the contact a law with a stiffness, or model, integrator and step of your own.",
        path="solve.tolerance",
    )
