"""A reference by refinement: independent descriptions of one scene, refined until their errors are known.

Its cost is predicted from the levels that it is expected to need, their steps, records and comparisons.
"""

from __future__ import annotations

import itertools
import math
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from impactlab.errors import ImpactlabError
from impactlab.history.base import AbstractHistory
from impactlab.metrics import norms
from impactlab.refine.convergence import Study, finest_error
from impactlab.refine.descriptions import beams as beam_descriptions
from impactlab.refine.descriptions.description import RATIO, Description
from impactlab.refine.descriptions.rods import MIN_FINENESS
from impactlab.refine.descriptions.suitable import has_unique_solution, stepped
from impactlab.refine.references.reference_record import CONVERGED, FULL_BUDGET_S, Reference, physics_key
from impactlab.scene.facts import beams_of, changes
from impactlab.scene.method import Method, Simulation, laws_of
from impactlab.scene.problem import RECORDS, Scene
from impactlab.scene.sizes import default_records

FIRST_SHARE = 0.7  # of the budget, for the first description
TARGET_UNCERTAINTY = 1e-6  # at which refining ends,
MAX_CHEAP_LEVEL_S = 1.0 / 30.0  # unless the next level is predicted to solve faster than this [s]
COSTLY_UNCERTAINTY = 1e-5  # at which refining ends where the next level is predicted to take longer than
MIN_COSTLY_LEVEL_S = 0.3  # this [s]
STALLED_SHARE = 0.8  # of the uncertainty two levels before: where more than that is left, a level that is not cheap is
# not run. At the first order 0.4 would be left.
MAX_STALLED = 1e-3  # uncertainty above which levels go on: coarse ones may fall unevenly
MIN_CHECK_S = 0.3  # s of predicted solving that the others may take, or as much as the first one took
MIN_UNCERTAINTY = 1e-7  # difference of equal histories that are interpolated linearly between at most 20000 records
MAX_UNCERTAINTY = 1e-2  # of a reference
CHECK_UNCERTAINTY = 3e-5  # at which the second solution is good enough to check the first
UNCHECKED_FACTOR = 3.0  # on the uncertainty of a solution without a second one
SAFETY = 3.0  # factor on the error that three levels show (docs/audit.md: claimed against true over random scenes)
CONVERGED_BY = ("mass_displacement", "face_displacement", "impulse")
"""The metrics by which a reference converges; their largest uncertainty is that of the reference."""
OF_FULL_ORDER = (*CONVERGED_BY, "peak_force")  # other metrics converge at the first order at most
STATED_BESIDE = (
    "peak_force",
    "force",
    "force_away_from_jumps",
    "event_times",
)  # metrics with an uncertainty of their own
MAX_KEPT = 12  # converged references in memory
# Of a predicted cost, in seconds by the time of the processor:
CONTACT_S = 1.5e-7  # a step and contact, beside the first
LEVEL_S = 3e-3  # of a level, for each contact and the first
COMPARISON_S = 4e-3  # of two levels, likewise; each is compared with two others
FIRST_UNCERTAINTY, FIRST_OF_BEAMS = 1e-3, 5e-4  # expected of a reference at its coarsest level
FIRST_OF_YIELDING = 2e-2  # the same where a contact yields; steps that do not end where it begins to are of first order

_kept: OrderedDict[Any, Reference | None] = OrderedDict()


def converged(scene: Scene, method: Method, budget: float = FULL_BUDGET_S) -> Reference | None:
    """Return the better of two independent descriptions refined until their error is known, or None."""
    request = _request(scene, method)
    key = (physics_key(*request), budget)
    try:
        if key in _kept:
            _kept.move_to_end(key)
            return _kept[key]
    except TypeError:  # a part of a plugin that has no hash
        return _converged(request, budget)
    _kept[key] = _converged(request, budget)
    while len(_kept) > MAX_KEPT:
        _kept.popitem(last=False)
    return _kept[key]


def _request(scene: Scene, method: Method) -> Simulation:
    """Return a scene with its default records, as a reference is computed."""
    return Simulation(scene, method).but(records=default_records(scene, RECORDS), frames=())


def _converged(request: Simulation, budget: float) -> Reference | None:
    """Return the better of two refined solutions, or None where none converges.

    The two descriptions share nothing except the physics. Where they differ by more than both claim, that difference is
    the uncertainty; a solution without a second one is `UNCHECKED_FACTOR` times less certain.
    """
    found: list[Reference] = []
    descriptions = list(descriptions_of(request))
    enough = allowed = 0.0  # of checks, once there is a solution
    for description in descriptions:
        if not found and description is descriptions[-1] and least_s(description) > FIRST_SHARE * budget:
            break  # its three levels would not end
        most = min(allowed, budget) if found else FIRST_SHARE * budget
        reference, spent = refine(description, most, enough, alone=len(descriptions) == 1)
        budget, allowed = budget - spent, allowed - spent
        if reference is not None and reference.uncertainty <= MAX_UNCERTAINTY:
            found.append(reference)
            enough, allowed = max(CHECK_UNCERTAINTY, 3.0 * reference.uncertainty), max(MIN_CHECK_S, spent)
        if len(found) == 2:
            break
    if not found:
        return None
    best = min(found, key=lambda each: each.uncertainty)
    if len(found) == 2:
        best = checked(best, found[0] if best is found[1] else found[1])
    else:
        uncertainties = {name: UNCHECKED_FACTOR * value for name, value in best.uncertainties.items()}
        best = best._replace(uncertainty=UNCHECKED_FACTOR * best.uncertainty, uncertainties=uncertainties)
    return best if best.uncertainty <= MAX_UNCERTAINTY else None


def descriptions_of(request: Simulation) -> Iterator[Description]:
    """Yield the descriptions that references use, the best first; none without a unique solution."""
    beams = beams_of(request.scene)
    if beams and not changes(request.scene) and has_unique_solution(request):
        continuous = beam_descriptions.continuous(request)
        if continuous is not None:
            yield continuous
            # The absorbing layer of a mesh is no second description of an infinite end.
            if any(beam_descriptions.is_infinite(beam) for beam in beams):
                return
    yield from (description for description in stepped(request) if description.reference_order > 0.0)


def least_s(description: Description) -> float:
    """Return the predicted time of the first three levels, which an estimate needs [s]."""
    levels = MIN_FINENESS, round(RATIO * MIN_FINENESS), round(RATIO * round(RATIO * MIN_FINENESS))
    return sum(description.seconds(description.per_level * level) for level in levels)


def refine(
    description: Description, budget: float, enough: float = 0.0, alone: bool = False
) -> tuple[Reference | None, float]:
    """Return the solution at the finest level within a budget, and the predicted seconds.

    Levels end early at an uncertainty of ``enough``, at that of `target`, where they do not lower it, or where nothing
    moves. ``alone`` is a description that no other one will check.
    """
    study = Study(description, description.per_level * MIN_FINENESS)
    level, spent, found = MIN_FINENESS, 0.0, None
    shown: list[float] = []  # uncertainties
    apart: dict[tuple[int, int], dict[str, float]] = {}  # metrics of two levels, by their fineness
    while spent + study.seconds <= budget:
        try:
            newest = study.run(study.next)
        except (ImpactlabError, ArithmeticError):
            break
        spent += study.seconds
        del study.levels[:-3]
        for other in study.levels[:-1]:
            apart[other.fineness, newest.fineness] = differences(other.history, newest.history)
        if len(study.levels) == 3:
            fineness = [each.fineness for each in study.levels]
            stated = uncertainties(apart, fineness, description.reference_order)
            unseen = description.unseen(newest.fineness, newest.history)
            stated = {name: max(value, unseen) for name, value in stated.items()}
            worst = max((stated[name] for name in CONVERGED_BY if name in stated), default=math.inf)
            found = Reference(CONVERGED, newest.history, worst, stated, description.words(newest.fineness))
            shown.append(worst)
            if not any(apart.values()):  # nothing moves: no finer level differs from these
                break
        level = round(RATIO * level)
        study.next = description.per_level * level
        if found is not None and found.uncertainty <= max(enough, target(study.seconds, alone)):
            break
        stalled = len(shown) > 2 and MAX_STALLED >= shown[-1] > STALLED_SHARE * shown[-3]
        if stalled and study.seconds > MAX_CHEAP_LEVEL_S:
            break
    return found, spent


def target(next_s: float, alone: bool = False) -> float:
    """Return the uncertainty at which refining ends, by the predicted time of the next level [s]."""
    if next_s <= MAX_CHEAP_LEVEL_S:
        return MIN_UNCERTAINTY
    if next_s <= MIN_COSTLY_LEVEL_S:
        return TARGET_UNCERTAINTY
    return COSTLY_UNCERTAINTY / UNCHECKED_FACTOR if alone else COSTLY_UNCERTAINTY


def uncertainties(
    apart: Mapping[tuple[int, int], Mapping[str, float]], fineness: Sequence[int], order: float
) -> dict[str, float]:
    """Return the uncertainty of the finest of three levels by metric.

    Parameters
    ----------
    apart : mapping
        Metrics of one level against a finer one, by the fineness of the two.
    fineness : sequence of int
        Of the three levels, rising.
    order : float
        Declared order of displacements and impulses; events and forces are of the first order at most.

    Returns
    -------
    dict
        Estimated error times `SAFETY`, at least `MIN_UNCERTAINTY`; inf of a metric that a pair lacks.
    """
    found = {}
    for name in apart[fineness[1], fineness[2]]:
        pairs = {
            (i, j): apart[fineness[i], fineness[j]].get(name, math.inf) for i, j in itertools.combinations(range(3), 2)
        }
        error = finest_error(pairs, fineness, order if name in OF_FULL_ORDER else 1.0).error
        found[name] = max(MIN_UNCERTAINTY, SAFETY * error)
    return found


def checked(best: Reference, other: Reference) -> Reference:
    """Return a solution with the uncertainty that remains beside an independent one."""
    stated = dict(best.uncertainties)
    for name, value in differences(other.history, best.history).items():
        if value > stated.get(name, best.uncertainty) + other.uncertainties.get(name, other.uncertainty):
            stated[name] = value
    uncertainty = max([best.uncertainty, *(stated[name] for name in CONVERGED_BY if name in stated)])
    found = f"{best.found}; checked by {other.found}"
    return best._replace(uncertainty=uncertainty, uncertainties=stated, found=found)


def differences(coarse: AbstractHistory, fine: AbstractHistory) -> dict[str, float]:
    """Return the metrics of two solutions; event times inf where the events differ in number."""
    installed = norms.installed()
    found = {name: installed[name](coarse, fine, fine.scene) for name in (*CONVERGED_BY, *STATED_BESIDE)}
    if len(coarse.events) != len(fine.events):
        found["event_times"] = math.inf
    return {name: float(value) for name, value in found.items() if value is not None}


def predicted_s(scene: Scene, method: Method) -> float | None:
    """Return the predicted time of a converged reference [s]; None for none within the budget."""
    request = _request(scene, method)
    found = list(descriptions_of(request))
    if not found or all(least_s(each) > FIRST_SHARE * FULL_BUDGET_S for each in found):
        return None
    contacts, first, most = max(1, len(scene.contacts)), FIRST_UNCERTAINTY, math.inf
    if any(not law.smooth and not law.hard for law in laws_of(scene, method)):
        first, most = FIRST_OF_YIELDING, 1.0
    elif beams_of(scene):
        first = FIRST_OF_BEAMS
    total, solving = _levels_s(found[0], contacts, first, most, FIRST_SHARE * FULL_BUDGET_S, alone=len(found) == 1)
    if len(found) > 1:
        total += _levels_s(found[1], contacts, first, most, max(MIN_CHECK_S, solving), CHECK_UNCERTAINTY)[0]
    return total


def _levels_s(
    description: Description,
    contacts: int,
    first: float,
    most: float,
    budget: float,
    enough: float = 0.0,
    alone: bool = False,
) -> tuple[float, float]:
    """Return the predicted times of all levels and of their solving [s].

    The levels end at an uncertainty. They end at a budget of solving. ``first`` is the uncertainty that is expected of
    the coarsest level, ``most`` the largest order with which it falls.
    """
    level, solving, total, count = MIN_FINENESS, 0.0, 0.0, 0
    while True:
        fineness = description.per_level * level
        seconds, steps = description.seconds(fineness), description.work(fineness)[0]
        if solving + seconds > budget:
            return total, solving
        solving += seconds
        of_contacts = CONTACT_S * (contacts - 1) * steps
        total += (
            seconds + description.finding(fineness) + of_contacts + contacts * (LEVEL_S + min(2, count) * COMPARISON_S)
        )
        count += 1
        level = round(RATIO * level)
        order = min(most, max(1.0, description.reference_order))
        uncertainty = first * (MIN_FINENESS * description.per_level / fineness) ** order
        next_s = description.seconds(description.per_level * level)
        if count >= 3 and uncertainty <= max(enough, target(next_s, alone)):
            return total, solving
