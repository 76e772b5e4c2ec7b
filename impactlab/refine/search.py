"""The search for the cheapest run within a tolerance, by ever finer trials within a budget of time."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Iterable
from dataclasses import dataclass, field

from impactlab.errors import ImpactlabError, StepError
from impactlab.refine import out_of_reach
from impactlab.refine.convergence import Level, Study
from impactlab.refine.descriptions.cost import FIXED_S
from impactlab.refine.descriptions.description import RATIO, Description
from impactlab.refine.descriptions.rods import EXACT_ERROR
from impactlab.refine.errors.level_errors import DONE, UNSEEN, allowed, estimate_errors, keeps_energy
from impactlab.refine.errors.one_run import estimate_alone
from impactlab.refine.ranking import EXACT_ADVANTAGE, begins_alone, best_of, is_sure, is_worth_trying, priority
from impactlab.refine.studies import begun, start_finer
from impactlab.refine.trial import no_check
from impactlab.scene.method import Simulation
from impactlab.types import Progress

BUDGET_S = 3.0  # s of predicted solving that may go into one choice
PROBE_S = 0.05  # s of predicted solving, at most, of the first trial of a description
MAX_FAILURES = 3  # levels of a description that may fail
FINER = 3  # times the fineness of a level that failed is that of the next: the coarser one beside it is finer, too


def is_taken_at_once(exact: Description | None) -> bool:
    """Return whether the exact march costs no more than any stepped run.

    Both costs are predicted; that of the steps is the least possible.
    """
    return exact is not None and exact.seconds(0) <= EXACT_ADVANTAGE * FIXED_S


@dataclass
class Search:
    """A search for the cheapest run of a scene within the tolerance of its method."""

    request: Simulation
    progress: Progress | None = None
    failed: list[ImpactlabError] = field(default_factory=list)  # by runs that were refused or ended as failed

    @property
    def tolerance(self) -> float:
        """Relative error that is allowed; 0 without a tolerance."""
        return allowed(self.request.method)

    def at_once(self, exact: Description | None) -> tuple[Study, Level] | None:
        """Return the exact run where it is taken without a comparison."""
        if exact is None or not is_taken_at_once(exact):
            return None
        return self.best([Study(exact, 0)])

    def best(self, studies: list[Study], others: Iterable[Study] = ()) -> tuple[Study, Level] | None:
        """Run levels, the cheapest first, until one keeps the tolerance; return the best.

        ``others`` are made and compared where the studies that are given do not promise a run that costs little more
        than the least of any run.
        """
        while True:
            best = self._unchecked(studies, others)
            if best is None or self._holds(*best):
                return best

    def _unchecked(self, studies: list[Study], others: Iterable[Study]) -> tuple[Study, Level] | None:
        """Return the best run, its balances not checked yet."""
        tolerance, left = self.tolerance, BUDGET_S
        best: tuple[Study, Level] | None = None
        for study in studies:
            best = best_of(study, best, tolerance)
        while True:
            met = best is not None and best[1].error <= tolerance
            if not begins_alone(studies) and not is_sure(studies, best if met else None):
                studies += others
            waiting = [study for study in studies if not study.closed]
            if not waiting:
                break
            start_finer(studies, tolerance)
            study = min(waiting, key=priority)
            if best is not None and met and not is_worth_trying(study, best, studies):
                break
            if not met and study.description.unit:
                if not study.levels and _cost_of_trial(study) > min(PROBE_S, left):
                    study.next = _affordable(study, min(PROBE_S, left)) or study.next
                elif out_of_reach.needed_s(study) > left:
                    study.closed, study.out_of_reach = out_of_reach.reason(study, left), True
                    continue
            if _cost_of_trial(study) > left:
                study.closed = beyond_budget(study, left)
                continue
            left -= _cost_of_trial(study)
            if not self._succeeds(study):
                continue
            if study.closed == UNSEEN and study.description.otherwise is not None:
                other = study.description.otherwise(study.levels[-1].history, study.magnified)
                studies += [begun(other, tolerance)] if other.alike else []
            best = best_of(study, best, tolerance)  # a finer run may have lowered the errors of coarser ones
        return best

    def _holds(self, study: Study, level: Level) -> bool:
        """Return whether a run keeps its balances; a study whose run failed begins again, finer."""
        began = clock.perf_counter()
        try:
            level.check()
        except StepError as error:
            self.failed.append(error)
            study.levels, study.first, study.reach, study.falling = [], None, None, {}
            _failed(study, level.fineness, error)
            return False
        level.run_s, level.check = level.run_s + clock.perf_counter() - began, no_check
        return keeps_energy(study, level, self.tolerance)

    def _succeeds(self, study: Study) -> bool:
        """Run the next level, or close its study; return whether it was completed."""
        try:
            _tried(study, self.request, self.progress)
        except StepError as error:
            self.failed.append(error)
            _failed(study, study.next, error)
            return False
        except ImpactlabError as error:
            self.failed.append(error)
            study.closed = f"refused: {error.text}"
            return False
        return True


def _failed(study: Study, fineness: int, error: StepError) -> None:
    """Set the level after a failed one: a finer one.

    This is done a few times; no level follows a failed exact run.
    """
    study.failures, study.out_of_reach = study.failures + 1, False
    study.next = study.description.whole(FINER * fineness)
    study.closed = f"failed: {error.text}" if study.failures > MAX_FAILURES or not study.description.unit else ""


def _tried(study: Study, request: Simulation, progress: Progress | None) -> None:
    """Run the next level, estimate errors and set the next fineness.

    The first time a coarser level is run, too. The finer one comes first where its modes are of use to the coarser one.
    Where the records of one run state its error, it is alone, and gives the next fineness.
    """
    description = study.description
    if not description.unit:
        level = study.run(0, progress)
        level.error, study.closed = EXACT_ERROR, DONE
        return
    if study.levels:
        alone = all(level.alone for level in study.levels)
        level = study.run(study.next, progress, checked=False)
        if alone and estimate_alone(study, level, request):
            return
    else:
        first = 0 if study.failures or study.takes_two else description.first_alone(allowed(request.method))
        if first:
            level = study.run(min(first, study.next), progress, checked=False)
            if not estimate_alone(study, level, request):  # others may be preferred to two runs
                study.takes_two = True
                if RATIO * level.fineness < description.coarser(study.next)[0]:
                    study.levels.remove(level)  # too coarse for an estimate beside another one
                elif study.next < RATIO * level.fineness:
                    study.next = description.whole(math.ceil(RATIO**2 * level.fineness))
            return
        coarser = description.coarser(study.next)[0]
        study.next = finer = max(study.next, description.whole(coarser + 1))
        for fineness in (coarser, finer) if description.alike else (finer, coarser):
            study.run(fineness, progress, checked=False)
    estimate_errors(study, request)


def show_order(study: Study, request: Simulation) -> None:
    """Run a third, coarser level to show the order of convergence, and estimate errors by it."""
    if len(study.levels) != 2 or not study.description.unit:
        return
    below = study.description.coarser(study.levels[0].fineness)[1]
    if below < study.levels[0].fineness:
        study.run(below)
        estimate_errors(study, request)


def _cost_of_trial(study: Study) -> float:
    """Return the predicted time of solving the next level [s].

    The first level needs a coarser one, which is included.
    """
    first = study.description.unit and not study.levels
    return study.seconds + (study.description.seconds(study.description.coarser(study.next)[0]) if first else 0.0)


def _affordable(study: Study, seconds: float) -> int | None:
    """Return about the largest fineness whose trial is within a time [s].

    It is at most the next one; None where no trial is.
    """
    description, fineness = study.description, study.next
    while fineness >= description.min_fineness:
        trial = Study(description, description.whole(fineness), study.levels)
        if _cost_of_trial(trial) <= seconds:
            return trial.next
        fineness = int(0.8 * fineness)
    return None


def beyond_budget(study: Study, left: float) -> str:
    """Return as text why the next level of a study is not run.

    ``left`` is the rest of the budget [s].
    """
    needed = f"would take {_cost_of_trial(study):.2g} s of solving"
    if left < BUDGET_S:
        return f"{needed}, and {max(left, 0.0):.2g} s are left of the {BUDGET_S:g} s that a choice may take"
    return f"{needed}, beyond the {BUDGET_S:g} s that a choice may take"
