"""The search: run as few candidates as it takes, the cheapest first, until one keeps the tolerance."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field

from impactlab.errors import CaseError, ImpactlabError, PairingError, StepError
from impactlab.history.base import AbstractHistory, Warned
from impactlab.refine import beam_families
from impactlab.refine.choice_record import Choice, Rung, Verdict
from impactlab.refine.estimates import MIN_STEPS, estimated, resolves_contacts
from impactlab.refine.extrapolation import SHOWN_SAFETY
from impactlab.refine.families import EXACT_ERROR, Family, exact, stepped
from impactlab.refine.quantities import difference
from impactlab.scene.facts import beams_of
from impactlab.scene.method import Method, Simulation
from impactlab.scene.problem import Scene
from impactlab.simulate import driver as simulate
from impactlab.simulate.checks import gain_of

BUDGET = 3.0  # s of predicted solving that may go into one choice
DEAR = 1.6  # a run that keeps the tolerance is taken unless another promises to solve this many times faster
GAIN = 10.0  # a run that gains energy, over that at stake, is expected to be wrong by no less than this part of it
MOST_GROWTH = 2.6  # of the fineness from trial to trial: across a longer step no order shows
MARGIN = 1.1  # on the fineness that an estimate asks for
HEAD_START = 1.25  # of the exact solver before what promises to be a little faster
NEARLY_AS_CHEAP = 1.25  # within this ratio of predicted cost the run with less error is preferred
MOST_TRIALS = 12  # of one family
MOST_CHOOSING = 10.0  # times the solving of a run may go into choosing it
MOST_FAILS = 3  # trials of a family that may fail, each followed by one of twice the fineness
DONE = "done"  # a family that needs no further run

Progress = Callable[[float], None]


@dataclass
class Trial:
    """One run of a family."""

    fineness: int
    history: AbstractHistory
    expected: float  # estimate times safety; inf where nothing is known
    reason: str = ""
    whole_s: float = 0.0  # of the run, set-up and checks included


@dataclass
class Search:
    """A family under trial: its runs so far, how fine it would have to be, and why it was given up."""

    family: Family
    next: int
    asked: Simulation
    trials: list[Trial] = field(default_factory=list)
    closed: str = ""
    fails: int = 0  # trials that ended as failed
    final: str = ""  # why the next trial is the last one

    @property
    def tried(self) -> set[int]:
        """Fineness of the runs so far."""
        return {trial.fineness for trial in self.trials}

    @property
    def cost(self) -> float:
        """Predicted seconds of solving at the fineness that is needed."""
        return self.family.seconds(self.next)

    @property
    def price(self) -> float:
        """Predicted seconds of solving of the next trial, and of the coarser ones that the first one needs."""
        coarser = self.family.coarser(self.next) if self.family.unit and len(self.trials) < 2 else ()
        return self.cost + sum(self.family.seconds(fineness) for fineness in coarser)

    def affordable(self, seconds: float) -> int | None:
        """Return a fineness near the largest whose trials take so long [s]; None where no useful one does."""
        if not self.family.unit:
            return None
        least = max([self.family.coarsest, *(round(1.2 * trial.fineness) for trial in self.trials)])
        needed, fineness = self.next, self.next
        while fineness >= least:
            self.next = self.family.whole(fineness)
            if self.price <= seconds:
                self.next, fineness = needed, self.next
                return fineness
            fineness = int(0.8 * fineness)
        self.next = needed
        return None

    @property
    def urge(self) -> float:
        """What families are ordered by: predicted seconds of solving, and a tenth of those of setting up a trial.

        The exact solver needs no trial, and goes before what promises to be a little faster.
        """
        if not self.family.unit:
            return self.cost / HEAD_START
        return self.family.doubt * self.cost + self.family.setup_s / MOST_CHOOSING


def first_guess(scene: Scene, method: Method) -> Simulation:
    """Return the description that facts of its class predict to be the cheapest within the tolerance."""
    searches, why = searches_of(Simulation(scene, method))
    if not searches:
        raise _nothing(why, searches)
    search = min(searches, key=lambda each: each.urge)
    return search.family.run(search.next)


def run(scene: Scene, method: Method, progress: Progress | None = None) -> AbstractHistory:
    """Return the history of the cheapest description that keeps the method's tolerance; its ``choice`` says why.

    Where the exact solver serves and no stepped description promises to be much faster, it is taken without a trial.
    Else candidates are run, the one with the least predicted cost first, each beside two that are coarser: the
    estimate is extrapolated from three resolutions by the order that they show, times a safety factor.

    Raises
    ------
    CaseError
        Where no description serves: two masses in hard contact, or an overlap.
    StepError
        Where every candidate fails on the way.
    """
    began = clock.perf_counter()
    tolerance = allowed(method)
    searches, why = searches_of(Simulation(scene, method))
    failed: list[ImpactlabError] = []
    best = searched(searches, tolerance, failed, progress)
    if best is None:
        raise failed[0] if failed else _nothing(why, searches)
    search, trial = best
    history = trial.history
    chosen, rungs = history.method, tuple(ladder(searches, search, trial, why))
    choosing = clock.perf_counter() - began - trial.whole_s
    simulate.add_warnings(history)
    history.scene, history.method = scene, method
    history.choice = Choice(
        tolerance=tolerance,
        method=chosen,
        chosen=search.family.words(trial.fineness),
        expected_error=trial.expected,
        estimate=_words_of_estimate(search.family, history),
        ladder=rungs,
        choosing_s=choosing,
    )
    if not history.choice.met:
        text = (
            f"no description that a choice may try keeps {tolerance:g}: the best one has an estimated error of "
            f"{trial.expected:.2g} ({search.family.words(trial.fineness)})"
        )
        history.warnings.append(Warned("tolerance_not_met", text))
    return history


def searched(
    searches: list[Search], tolerance: float, failed: list[ImpactlabError], progress: Progress | None = None
) -> tuple[Search, Trial] | None:
    """Try the families, the cheapest first, until one keeps the tolerance; return the best run, None if none ended."""
    best: tuple[Search, Trial] | None = None
    left = BUDGET
    while waiting := [search for search in searches if not search.closed]:
        search = min(waiting, key=lambda each: each.urge)
        if best is not None and best[1].expected <= tolerance and not _worth_trying(search, best, searches):
            break
        if search.price > left:
            needed = f"would take {search.price:.2g} s of solving, beyond the {BUDGET:g} s that a choice may take"
            affordable = search.affordable(left if len(waiting) == 1 else 0.5 * left)
            if affordable is None or (best is not None and best[1].expected <= tolerance):
                search.closed = needed
                continue
            search.next, search.final = affordable, needed
        left -= search.price
        try:
            found = _tried(search, tolerance, progress)
        except StepError as error:
            failed.append(error)
            search.fails += 1
            search.next = search.family.whole(2 * search.next)
            if search.fails > MOST_FAILS:
                search.closed = f"failed: {error.text}"
            continue
        except ImpactlabError as error:
            failed.append(error)
            search.closed = f"refused: {error.text}"
            continue
        search.closed = search.closed or search.final
        for trial in found:
            if best is None or _better((search, trial), best, tolerance):
                best = search, trial
    return best


def _worth_trying(search: Search, best: tuple[Search, Trial], searches: list[Search]) -> bool:
    """Return whether a family promises to be much cheaper than what keeps the tolerance, for what trying it takes.

    Its two runs come on top of all runs so far, and choosing may take `MOST_CHOOSING` times the solving of the chosen.
    """
    if _seconds(best) <= DEAR * search.cost:
        return False
    spent = sum(each.family.setup_s * len(each.trials) for each in searches)
    return spent + search.family.setup_s <= MOST_CHOOSING * search.cost


def ladder(searches: list[Search], search: Search, trial: Trial, why: str) -> list[Rung]:
    """Return what became of every candidate, those of the chosen family first."""
    rungs = []
    family = search.family
    for each in sorted(searches, key=lambda other: other is not search):
        for run_ in sorted(each.trials, key=lambda one: one.fineness):
            chosen = run_ is trial
            verdict: Verdict = "chosen" if chosen else "trial" if each is search else "rejected"
            reason = run_.reason or ("the cheapest found within the tolerance" if chosen else "")
            if not reason and each is not search:
                reason = "solves longer than the chosen one"
            rungs.append(_rung(each.family, run_.fineness, run_, verdict, reason))
        if each.closed and each.closed != DONE:
            rungs.append(_rung(each.family, each.next, None, "rejected", each.closed))
        elif not each.trials:
            of_chosen = family.seconds(trial.fineness)
            reason = f"predicted to solve for {1e3 * each.cost:.2g} ms, the chosen one for {1e3 * of_chosen:.2g} ms"
            rungs.append(_rung(each.family, each.next, None, "not run", reason))
    if why:
        rungs.append(Rung("continuous, from event to event", None, None, verdict="refused", reason=why))
    return rungs


def _rung(family: Family, fineness: int, trial: Trial | None, verdict: Verdict, reason: str) -> Rung:
    return Rung(
        candidate=family.words(fineness),
        predicted_error=family.error(fineness),
        predicted_s=family.seconds(fineness),
        estimated_error=trial.expected if trial is not None and math.isfinite(trial.expected) else None,
        solve_s=trial.history.cost.solve_s if trial is not None else None,
        verdict=verdict,
        reason=reason,
    )


def searches_of(asked: Simulation) -> tuple[list[Search], str]:
    """Return a search for every family that serves a scene, and why the exact solver does not ("" where it does)."""
    families, why = serving(asked)
    return [Search(family, family.start_for(allowed(asked.method)), asked) for family in families], why


def allowed(method: Method) -> float:
    """Return the relative error that a method allows; 0 without a tolerance."""
    return 0.0 if method.tolerance is None else method.tolerance.error


def _nothing(why: str, searches: list[Search]) -> CaseError:
    if searches:
        reasons = "; ".join(f"{search.family.name}: {search.closed}" for search in searches)
        return CaseError(
            f"no description can be tried: {reasons}",
            remedy="Give a shorter duration, or model, integrator and step of your own.",
            path="solve.tolerance",
        )
    return CaseError(
        f"no description serves this scene: {why or 'its contacts have no single answer'}",
        remedy="Give the contact a law with a stiffness or a restitution, or model, integrator and step of your own.",
        path="solve.tolerance",
    )


def _seconds(best: tuple[Search, Trial]) -> float:
    return best[0].family.seconds(best[1].fineness)


def _better(one: tuple[Search, Trial], best: tuple[Search, Trial], tolerance: float) -> bool:
    """Return whether a run is to be preferred: within the tolerance the cheaper one, else the one with less error."""
    if one[1].expected <= tolerance and best[1].expected <= tolerance:
        finer = one[1].expected < best[1].expected
        return _seconds(one) < _seconds(best) * (NEARLY_AS_CHEAP if finer else 1.0 / NEARLY_AS_CHEAP)
    return one[1].expected < best[1].expected


def _tried(search: Search, tolerance: float, progress: Progress | None) -> list[Trial]:
    """Run a family at the fineness that it needs, the first time at two coarser ones too; set the next fineness."""
    family = search.family
    if not family.unit:
        began = clock.perf_counter()
        trial = Trial(0, simulate.run(*family.run(0), progress), EXACT_ERROR)
        trial.whole_s = clock.perf_counter() - began
        search.trials.append(trial)
        search.closed = DONE
        return [trial]
    new = []
    if len(search.trials) < 2:
        first, second = family.coarser(search.next)
        search.next = max(search.next, family.whole(second + 1))
        new += [_run(search, each, progress) for each in (first, second) if each not in search.tried]
    new.append(_run(search, search.next, progress))
    _judge(search, tolerance)
    return new


def _run(search: Search, fineness: int, progress: Progress | None) -> Trial:
    began = clock.perf_counter()
    trial = Trial(fineness, simulate.run(*search.family.run(fineness), progress, with_warnings=False), math.inf)
    trial.whole_s = clock.perf_counter() - began
    search.trials.append(trial)
    search.trials.sort(key=lambda each: each.fineness)
    return trial


def _judge(search: Search, tolerance: float) -> None:
    """Estimate the error of every run of a family from its three finest, and the fineness that the tolerance needs."""
    family, trials = search.family, search.trials
    finest = trials[-1]
    estimates = estimated(
        [(trial.fineness, trial.history) for trial in trials], search.asked, family.order, family.safety
    )
    doubt = _beyond_witness(search)
    for trial, (apart, estimate) in zip(trials, estimates, strict=True):
        trial.expected, trial.reason = max(apart + estimate.error, doubt), ""
        gain = gain_of(trial.history) / GAIN
        if gain > max(trial.expected, tolerance):
            trial.expected, trial.reason = gain, f"gains {GAIN * gain:.2g} of the energy at stake"
        elif not resolves_contacts(trial.history, search.asked):
            trial.expected, trial.reason = math.inf, f"fewer than {MIN_STEPS} steps in a period of contact"
        elif trial.expected > tolerance:
            trial.reason = f"expected error {trial.expected:.2g} beyond the tolerance"
    last = estimates[-1][1]
    # By the declared order: one that has not shown yet may still do so, and a run too fine is dearer than a trial more.
    needed = finest.fineness * MARGIN * (max(last.error, 1e-300) / tolerance) ** (1.0 / family.order)
    if not math.isfinite(needed) or not finest.expected <= last.error:
        needed = 2.0 * finest.fineness
    met = [trial.fineness for trial in trials if trial.expected <= tolerance]
    search.next = max(family.coarsest, math.ceil(min(needed, MOST_GROWTH * finest.fineness)))
    if not met:
        search.next = max(search.next, math.ceil(1.5 * finest.fineness))
    search.next = min(family.whole(search.next), family.finest)
    # A run that is cheaper by little is not worth the time of another trial.
    if met and family.seconds(min(met)) <= DEAR * family.seconds(search.next):
        search.closed = DONE
    if len(trials) > MOST_TRIALS or (not met and finest.fineness >= family.finest):
        search.closed = "does not converge to the tolerance"


def _beyond_witness(search: Search) -> float:
    """Return how much further the finest run lies from one off the special step than that one may be wrong.

    Runs with c dt = h share what flatters them, so two of them may agree by luck: the third must not contradict them.
    """
    family, finest = search.family, search.trials[-1]
    if family.witness is None:
        return 0.0
    # Peak forces stay out: those of an ordinary mesh ring behind a front.
    scene, method = family.witness(finest.fineness)
    beside = simulate.run(scene, method, with_warnings=False)
    apart = difference(finest.history, beside, scene, method.laws, ("displacements", "impulses"))
    return apart if apart > family.witness_error(finest.fineness) else 0.0


def _words_of_estimate(family: Family, history: AbstractHistory) -> str:
    if not family.unit:
        return "solved from event to event: exact but for rounding and for touches that nearly miss"
    return (
        f"three resolutions, extrapolated by the order they show (at most {family.order:g}), times a safety of "
        f"{family.safety:g}, or {SHOWN_SAFETY:g} where that order shows; "
        f"the run gained {gain_of(history):.1g} of the energy at stake"
    )


def serving(asked: Simulation) -> tuple[list[Family], str]:
    """Return the families that serve a scene, and why the exact solver does not ("" where it does)."""
    families, why = [], ""
    if beams_of(asked.scene):
        return beam_families.serving(asked)
    try:
        families.append(exact(asked))
    except (CaseError, PairingError) as error:
        why = error.text
    families += stepped(asked)
    return families, why
