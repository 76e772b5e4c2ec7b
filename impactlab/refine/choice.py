"""The automatic choice: the cheapest run within a tolerance, with its record."""

from __future__ import annotations

import itertools
import time as clock
from collections.abc import Iterable, Iterator
from functools import partial

from impactlab.errors import CaseError
from impactlab.history.base import AbstractHistory, Warned
from impactlab.history.choice import Candidate, Choice, Ladder
from impactlab.numerics.garbage_collection import GarbageCollectionPaused
from impactlab.plugins import kind_of
from impactlab.refine import out_of_reach, search
from impactlab.refine.convergence import Level, Study
from impactlab.refine.descriptions.suitable import exact_for
from impactlab.refine.errors import not_converged
from impactlab.refine.errors.level_errors import allowed
from impactlab.refine.ladder import Outcome, candidates, not_run, not_served, words_of_estimate
from impactlab.refine.ranking import priority
from impactlab.refine.studies import in_turn, studies_of
from impactlab.scene.method import Method, Simulation, laws_of
from impactlab.scene.problem import Scene
from impactlab.simulate.checks import add_warnings
from impactlab.simulate.warnings.resolvability import in_a_choice
from impactlab.types import Progress

MIN_KEPT = 0.75  # share of the steps kept by a run that keeps every one: the last may be shorter; else at most 1/2


def first_guess(scene: Scene, method: Method) -> Simulation:
    """Return the description that is predicted to be the cheapest within the tolerance."""
    request = Simulation(scene, method)
    exact, _ = exact_for(request)
    if exact is not None and search.is_taken_at_once(exact):
        return exact.simulation(0)
    studies, why = studies_of(request)
    if not studies:
        raise _nothing_serves(request, why, studies)
    study = min(studies, key=priority)
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
    request = Simulation(scene, method)
    searching, served = search.Search(request, progress), exact_for(request)
    studies: list[Study] = []
    others: Iterator[Study] = iter(())
    best, why = searching.at_once(served[0]), served[1]
    if best is None:
        with GarbageCollectionPaused():
            others, why = in_turn(request, served)
            studies.extend(itertools.islice(others, 1))
            best = searching.best(studies, others)
    is_met = best is not None and best[1].error <= searching.tolerance
    if not is_met and (refused := out_of_reach.refusal(allowed(method), studies, best, search.BUDGET_S)):
        raise refused
    if best is None:
        raise searching.failed[0] if searching.failed else _nothing_serves(request, why, studies)
    study, level = best
    history, description = level.history, study.description
    tried = candidates(studies or [study], study, level)
    if not studies:  # no prediction was needed
        others = _stepped(request)
    rungs = Ladder(partial(_ladder, tried, others, description.seconds(level.fineness), why if studies else ""))
    choosing = clock.perf_counter() - began - level.run_s
    add_warnings(history)
    history.warnings[:] = map(in_a_choice, history.warnings)
    history.warnings.extend(not_converged.warnings(study, level, method.tolerance))
    history.choice = Choice(
        tolerance=allowed(method),
        method=history.method,
        chosen=description.words(level.fineness),
        expected_error=level.error,
        estimate=words_of_estimate(study, level),
        ladder=rungs,
        choosing_s=choosing,
    )
    history.scene, history.method = scene, method
    if not history.choice.met:
        text = (
            f"no description that a choice may try keeps {allowed(method):g}: the best one has an estimated error of "
            f"{level.error:.2g} ({history.choice.chosen}){_mostly(level)}{between_records(history)}"
        )
        history.warnings.append(Warned("tolerance_not_met", text))
    return history


def _mostly(level: Level) -> str:
    """Return as text the quantity with the error of a run, and the key that leaves it out."""
    if not level.worst:
        return ""
    return f", of the {level.worst}; solve.tolerance_on names the quantities that count"


def between_records(history: AbstractHistory) -> str:
    """Return as text that a run keeps only some of its steps; empty where it keeps all."""
    if history.dt is None or history.record_rate * history.dt > MIN_KEPT:
        return ""
    every = round(1.0 / (history.record_rate * history.dt))
    return (
        f". Only one step in {every} is kept, and channels are interpolated between these; a larger solve.records may "
        "lower the error"
    )


def _stepped(request: Simulation) -> Iterator[Study]:
    """Give a study of every description that steps."""
    yield from in_turn(request, (None, ""))[0]


def _ladder(tried: list[Outcome], others: Iterable[Study], seconds: float, why: str) -> list[Candidate]:
    """Return candidates tried and not tried, last why the exact solver does not apply."""
    beside = [not_run(study, seconds)() for study in others]
    return [*(outcome() for outcome in tried), *beside, *not_served(why)]


def _nothing_serves(request: Simulation, why: str, studies: list[Study]) -> CaseError:
    if studies:
        reasons = "; ".join(f"{study.description.name}: {study.closed}" for study in studies)
        return CaseError(
            f"no description can be tried: {reasons}",
            remedy="Give a shorter duration, or model, integrator and step of your own.",
            path="solve.tolerance",
        )
    remedy = "Give the contact a law with a stiffness, or law, model, integrator and step in place of the tolerance."
    for contact, law in zip(request.scene.contacts, laws_of(*request), strict=True):
        if law.two_sided and why:
            why = (
                f"{why}. Methods with steps have no error estimate here, as {contact.name} is joined ('{kind_of(law)}')"
            )
            remedy = (
                "Give model, integrator and step in place of the tolerance, or laws that the exact solver supports."
            )
            break
    return CaseError(
        f"no method within a tolerance suits this scene: {why or 'its contacts have no unique solution'}",
        remedy=remedy,
        path="solve.tolerance",
    )
