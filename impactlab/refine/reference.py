"""What a run is judged by: the exact answer where there is one, else a converged one with its uncertainty."""

from __future__ import annotations

import dataclasses
import math
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from impactlab.errors import ImpactlabError, StepError
from impactlab.exact import solve as exact
from impactlab.history.base import AbstractHistory
from impactlab.metrics import norms as metrics
from impactlab.refine import reference_beams
from impactlab.refine.described import has_one_answer
from impactlab.refine.extrapolation import RATIO, Differences, finest_error
from impactlab.refine.ways import COARSEST, Way, rod_ways
from impactlab.scene.facts import beams_of
from impactlab.scene.method import Method, Simulation, is_relative, laws_of, modelled, theories
from impactlab.scene.problem import RECORDS, Scene
from impactlab.simulate import driver as simulate

# Names in summaries: the exact hard contact, the exact spring and dashpot of the case itself, the converged answer.
HARD, SPRING, CONVERGED = "st_venant", "kelvin_voigt", "converged"

CHEAP = 0.25  # s of predicted solving that a plain run spends on its reference
THOROUGH = 8.0  # s, where a reference is asked for: compare, bench
WANTED = 1e-6  # uncertainty at which refining ends,
EASY = 0.05  # s, unless the next level costs less than this
WORST = 1e-2  # uncertainty beyond which there is no reference
READ = 1e-7  # of a value: what two histories may share that are read on lines between at most 20000 records
FIRST = 0.7  # of the budget that the first description may take
CHECKING = 3e-5  # uncertainty at which the second answer is good enough to check the first
UNWITNESSED = 3.0  # times less known: an answer without a second one
SAFETY = 3.0  # on the error that three levels show (docs/audit.md: claimed against true over random scenes)
JUDGED = ("mass_displacement", "face_displacement", "impulse")
"""The metrics by which a reference converges; their largest uncertainty is that of the reference."""
SMOOTH = (*JUDGED, "peak_force")
TOLD = ("peak_force", "force", "force_away_from_jumps", "event_times")  # metrics whose uncertainty is kept beside
MOST_KEPT = 12  # converged references in memory


class Reference(NamedTuple):
    """An answer to judge by.

    ``uncertainties`` are those of the metrics of the summary, each in the unit of its metric; none for an exact answer.
    """

    name: str  # st_venant | kelvin_voigt | converged
    history: AbstractHistory
    uncertainty: float = 0.0  # the largest relative one of displacements and impulse
    uncertainties: Mapping[str, float] = {}
    found: str = "event to event"  # how, in words


def find(scene: Scene, method: Method, budget: float = THOROUGH) -> Reference | None:
    """Return the exact answer to a scene, else a converged one, else None.

    Parameters
    ----------
    scene : Scene
        The physics; its contacts have the laws of the method.
    method : Method
        Its laws: one that is hard stands for the hard contact. Its models give the theory, and the elements of a
        relative stiffness; integrator and step are not used.
    budget : float
        Seconds of predicted solving that a converged answer may take. They are counted by a model of cost and never
        measured, so that the same scene always gets the same answer.
    """
    if any(theories(scene, method)):
        return None
    if exact.serves(scene, method) is None:
        name = HARD if all(law.hard for law in laws_of(scene, method)) else SPRING
        try:
            return Reference(name, exact.solve(scene, method, whole=True))
        except StepError:  # the run that asked for a reference is none the worse
            pass
    return converged(scene, method, budget)


def content(scene: Scene, method: Method) -> Any:
    """Return what a reference depends on, so that methods on one scene share it."""
    laws = laws_of(scene, method)
    meshed = any(is_relative(law) for law in laws)
    return (
        theories(scene, method),
        tuple(scene.bodies.values()),
        tuple(model for _, model in modelled(scene, method)) if meshed else (),
        scene.contacts,
        tuple(None if law.hard else law for law in laws),
        scene.duration,
        scene.gravity,
        scene.probes,
        scene.snapshots,
    )


_kept: OrderedDict[Any, Reference | None] = OrderedDict()


def converged(scene: Scene, method: Method, budget: float = THOROUGH) -> Reference | None:
    """Return the scene solved finer and finer until two answers agree, or None where none converges.

    The description is the best that serves: the stepped delay line for laws that are neither hard nor springs, a mesh
    whose waves go one element in a step for hard contact, an implicit mesh for the rest. From level to level it
    doubles; `uncertainty` says what is known of the last one.
    """
    scene = dataclasses.replace(scene, records=RECORDS)
    key = (content(scene, method), budget)
    asked = Simulation(scene, method)
    try:
        if key in _kept:
            _kept.move_to_end(key)
            return _kept[key]
    except TypeError:  # a part of a plugin that has no hash
        return _refined(asked, budget)
    _kept[key] = _refined(asked, budget)
    while len(_kept) > MOST_KEPT:
        _kept.popitem(last=False)
    return _kept[key]


def _refined(asked: Simulation, budget: float) -> Reference | None:
    """Return the better of two refined answers, or None where none converges.

    Two descriptions that share nothing but the physics are refined; where they differ by more than they claim, that
    difference is the uncertainty. An answer that no second one stands beside counts as `UNWITNESSED` times less known.
    """
    found: list[Reference] = []
    for way in _ways(asked):
        last, share = None, budget if found else FIRST * budget
        for each, spent in levels(way, share):
            budget -= spent
            last = each if each is not None else last
            if found and each is not None and each.uncertainty <= max(CHECKING, 3.0 * found[0].uncertainty):
                break
        if last is not None and is_known(last):
            found.append(last)
        if len(found) == 2:
            break
    if not found:
        return None
    best = min(found, key=lambda each: each.uncertainty)
    other = next((each for each in found if each is not best), None)
    checked = _less_known(best, UNWITNESSED) if other is None else _beside(best, other, asked.scene)
    return checked if is_known(checked) else None


def _less_known(found: Reference, factor: float) -> Reference:
    told = {name: factor * value for name, value in found.uncertainties.items()}
    return found._replace(uncertainty=factor * found.uncertainty, uncertainties=told)


def _beside(best: Reference, other: Reference, scene: Scene) -> Reference:
    """Return an answer with the uncertainty that a second one leaves it."""
    told = dict(best.uncertainties)
    for name, value in differences(other.history, best.history, scene).items():
        claimed = told.get(name, best.uncertainty) + other.uncertainties.get(name, other.uncertainty)
        if value > claimed:
            told[name] = value
    uncertainty = max([best.uncertainty, *(told[name] for name in JUDGED if name in told)])
    return best._replace(uncertainty=uncertainty, uncertainties=told, found=f"{best.found}, checked by {other.found}")


def levels(way: Way, budget: float) -> Iterator[tuple[Reference | None, float]]:
    """Give the answer after each level with the seconds that the level was to take, until wanted or spent.

    From level to level the fineness grows by the golden section, so that no step is a multiple of another; the error of
    the last of three is extrapolated with the order that they show.
    """
    runs: list[tuple[int, AbstractHistory]] = []
    nearer: dict[str, float] = {}  # of the two runs before the last
    fineness, spent = COARSEST, 0.0
    while spent + way.seconds(fineness) <= budget:
        spent += way.seconds(fineness)
        try:
            fine, method = way.run(fineness)
            runs.append((fineness, simulate.run(fine, method)))
        except (ImpactlabError, ArithmeticError):
            return
        found = None
        if len(runs) > 1:
            last = differences(runs[-2][1], runs[-1][1], fine)
            if len(runs) > 2:
                apart = {"coarse_middle": nearer, "coarse_fine": differences(runs[-3][1], runs[-1][1], fine)}
                told = uncertainties(apart | {"middle_fine": last}, [n for n, _ in runs[-3:]], way.order)
                worst = max((told[name] for name in JUDGED if name in told), default=math.inf)
                found = Reference(CONVERGED, runs[-1][1], worst, told, f"{way.words} {fineness}")
            nearer = last
        yield found, way.seconds(fineness)
        runs = runs[-2:]
        fineness = round(RATIO * fineness)
        if found is not None and found.uncertainty <= (WANTED if way.seconds(fineness) > EASY else READ):
            return


def uncertainties(
    apart: Mapping[str, Mapping[str, float]], fineness: Sequence[float], order: float
) -> dict[str, float]:
    """Return the uncertainty of the finest of three runs by metric, from the metrics of their differences.

    Parameters
    ----------
    apart : mapping
        Metrics of each pair: keys are the fields of `impactlab.refine.extrapolation.Differences`.
    fineness : sequence of float
        Of the three runs, rising.
    order : float
        Declared order of displacements and impulses; events and forces are of the first order at most.

    Returns
    -------
    dict
        Estimated error times `SAFETY`, never below `READ`; inf of a metric that a pair lacks.
    """
    found = {}
    for name in apart["middle_fine"]:
        pairs = Differences(*(apart[field].get(name, math.inf) for field in Differences._fields))
        error = finest_error(pairs, (fineness[0], fineness[1], fineness[2]), order if name in SMOOTH else 1.0).error
        found[name] = max(READ, SAFETY * error)
    return found


def is_known(found: Reference) -> bool:
    """Return whether an answer is known well enough to judge by."""
    return found.uncertainty <= WORST


def differences(coarse: AbstractHistory, fine: AbstractHistory, scene: Scene) -> dict[str, float]:
    """Return the metrics of one answer against another; inf for event times where their events differ in number."""
    known = metrics.installed()
    found = {name: known[name](coarse, fine, scene) for name in (*JUDGED, *TOLD)}
    if len(coarse.events) != len(fine.events):
        found["event_times"] = math.inf
    return {name: float(value) for name, value in found.items() if value is not None}


def _ways(asked: Simulation) -> Iterator[Way]:
    """Give the descriptions that may serve a scene, the best first; none where the physics has no unique solution."""
    if beams_of(asked.scene):
        yield from reference_beams.every_way(asked)
    elif has_one_answer(asked):
        yield from rod_ways(asked)
