"""What a run is judged by: the exact answer where there is one, else a converged one with its uncertainty."""

from __future__ import annotations

import dataclasses
import math
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

from impactlab.errors import ImpactlabError, StepError
from impactlab.history import AbstractHistory
from impactlab.scene import RECORDS, ElasticBody, Scene

# Names in summaries: the exact hard contact, the exact spring and dashpot of the case itself, the converged answer.
HARD, SPRING, CONVERGED = "st_venant", "kelvin_voigt", "converged"

CHEAP = 0.25  # s of predicted solving that a plain run spends on its reference
THOROUGH = 8.0  # s, where a reference is asked for: compare, bench
WANTED = 1e-6  # uncertainty at which refining ends,
EASY = 0.02  # s, unless the next level costs less than this
WORST = 1e-2  # uncertainty beyond which there is no reference
READ = 1e-7  # of a value: what two histories may share that are read on lines between at most 20000 records
COARSEST = 50  # elements, or steps in the shortest transit
NEARER = 0.75  # of a distance: what converges in proportion to the mesh halves it
JUDGED = ("mass_displacement", "face_displacement", "impulse")
"""The metrics by which a reference converges; their largest uncertainty is that of the reference."""
TOLD = ("force", "force_away_from_jumps", "event_times")  # metrics whose uncertainty is kept beside
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


class Way(NamedTuple):
    """A description that can be refined: its words, the scene at a fineness, and the seconds that this will take."""

    words: str
    scene: Callable[[int], Scene]
    seconds: Callable[[int], float]
    witness: Callable[[int], Scene] | None = None  # the same off the special step c dt = h, where the way has that


def find(scene: Scene, budget: float = THOROUGH) -> Reference | None:
    """Return the exact answer to a scene, else a converged one, else None.

    Parameters
    ----------
    scene : Scene
        The physics: bodies, contacts and their laws. Models, integrator and step are those of no answer; a law that is
        hard stands for the hard contact.
    budget : float
        Seconds of predicted solving that a converged answer may take. They are counted by a model of cost and never
        measured, so that the same scene always gets the same answer.
    """
    from impactlab.exact import solve as exact

    if any(theories(scene)):
        return None
    if exact.serves(scene) is None:
        name = HARD if all(contact.law.hard for contact in scene.contacts) else SPRING
        try:
            return Reference(name, exact.solve(scene, whole=True))
        except StepError:  # the run that asked for a reference is none the worse
            pass
    return converged(scene, budget)


def theories(scene: Scene) -> tuple[str, ...]:
    """Return the theory of waves that each body's model declares, empty where it is the body's own.

    The references solve the body's own theory, so that none answers for a model of another.
    """
    bodies = (body for body in scene.bodies.values() if isinstance(body, ElasticBody))
    return tuple("" if body.model is None else body.model.theory for body in bodies)


def content(scene: Scene) -> Any:
    """Return what a reference depends on, so that methods on one scene share it."""
    from impactlab.described import is_relative

    meshed = any(is_relative(contact) for contact in scene.contacts)
    bodies = [
        dataclasses.replace(body, model=None) if isinstance(body, ElasticBody) and not meshed else body
        for body in scene.bodies.values()
    ]
    contacts = [(contact.left, contact.right, contact.gap, contact.overlap_allowed) for contact in scene.contacts]
    laws = tuple(None if contact.law.hard else contact.law for contact in scene.contacts)
    return (
        theories(scene),
        tuple(bodies),
        tuple(contacts),
        laws,
        scene.duration,
        scene.gravity,
        scene.probes,
        scene.snapshots,
    )


_kept: OrderedDict[Any, Reference | None] = OrderedDict()


def converged(scene: Scene, budget: float = THOROUGH) -> Reference | None:
    """Return the scene solved finer and finer until two answers agree, or None where none converges.

    The description is the best that serves: the stepped delay line for laws that are neither hard nor springs, a mesh
    whose waves go one element in a step for hard contact, an implicit mesh for the rest. From level to level it
    doubles; `uncertainty` says what is known of the last one.
    """
    scene = dataclasses.replace(scene, records=RECORDS)
    key = (content(scene), budget)
    try:
        if key in _kept:
            _kept.move_to_end(key)
            return _kept[key]
    except TypeError:  # a part of a plugin that has no hash
        return _refined(scene, budget)
    _kept[key] = _refined(scene, budget)
    while len(_kept) > MOST_KEPT:
        _kept.popitem(last=False)
    return _kept[key]


def uncertainty(coarse: float, fine: float) -> float:
    """Return the uncertainty of the finest of three levels from the two differences between neighbours.

    Differences that shrink by r leave a remainder of fine/(r - 1); where they shrink faster than by half, the last
    difference itself, as one fast step may be luck. Where they do not shrink nothing is known. Below `READ` none goes.
    """
    if fine <= READ:
        return max(READ, min(coarse, 2.0 * READ))
    return math.inf if coarse <= fine else max(fine, fine / (coarse / fine - 1.0))


def _refined(scene: Scene, budget: float) -> Reference | None:
    from impactlab.described import beams_of

    if beams_of(scene):
        from impactlab import reference_beams

        return reference_beams.refined(scene, budget)
    best: Reference | None = None
    left = budget
    for way in _ways(scene):
        if best is not None and best.uncertainty <= 10.0 * WANTED:
            break
        for found, spent in levels(way, left):
            left -= spent
            if found is not None and is_known(found):
                best = found if best is None or found.uncertainty < best.uncertainty else best
    return best


def levels(way: Way, budget: float) -> Iterator[tuple[Reference | None, float]]:
    """Give the answer after each level with the seconds that the level was to take, until wanted or spent."""
    from impactlab import simulate

    before: AbstractHistory | None = None
    first: dict[str, float] = {}
    fineness, spent = COARSEST, 0.0
    while spent + way.seconds(fineness) <= budget:
        spent += way.seconds(fineness)
        try:
            fine = way.scene(fineness)
            history = simulate.run(fine)
        except (ImpactlabError, ArithmeticError):
            return
        found = None
        if before is not None:
            second = differences(before, history, fine)
            if first:
                worst = least_known(first, second)
                told = {name: max(first.get(name, math.inf), value) for name, value in second.items()}
                told |= {name: min(worst, told[name]) for name in JUDGED if name in told}
                found = _witnessed(Reference(CONVERGED, history, worst, told, f"{way.words} {fineness}"), way, fineness)
            first = second
        yield found, way.seconds(fineness)
        before, fineness = history, 2 * fineness
        if found is not None and found.uncertainty <= (WANTED if way.seconds(fineness) > EASY else READ):
            return


def _witnessed(found: Reference, way: Way, fineness: int) -> Reference:
    """Return an answer with what meshes off the special step say of it, where it was found on that step alone.

    Answers with c dt = h share what flatters them, so that two may agree by luck. Meshes of an ordinary step converge
    slower, but to the truth: where the finer of two does not come nearer to the answer, the answer is no better known
    than by their distance.
    """
    from impactlab import simulate

    if way.witness is None or not found.uncertainty <= WORST:
        return found
    apart = []
    for part in (4, 2):
        scene = way.witness(max(2, fineness // part))
        try:
            apart.append(differences(simulate.run(scene), found.history, scene))
        except (ImpactlabError, ArithmeticError):  # nothing stands for the answer
            return found._replace(uncertainty=math.inf)
    judged = [name for name in JUDGED if name in apart[1]]
    name = max(judged, key=lambda each: apart[1][each], default="")
    if not name or apart[1][name] <= max(found.uncertainty, NEARER * apart[0].get(name, math.inf)):
        return found
    doubt = apart[1][name]
    told = {each: max(value, doubt) if each in JUDGED else value for each, value in found.uncertainties.items()}
    return found._replace(uncertainty=max(found.uncertainty, doubt), uncertainties=told)


def is_known(found: Reference) -> bool:
    """Return whether an answer is known well enough to judge by."""
    return found.uncertainty <= WORST


def differences(coarse: AbstractHistory, fine: AbstractHistory, scene: Scene) -> dict[str, float]:
    """Return the metrics of one answer against another; inf for event times where their events differ in number."""
    from impactlab import metrics

    known = metrics.installed()
    found = {name: known[name](coarse, fine, scene) for name in (*JUDGED, *TOLD)}
    if len(coarse.events) != len(fine.events):
        found["event_times"] = math.inf
    return {name: float(value) for name, value in found.items() if value is not None}


def least_known(first: Mapping[str, float], second: Mapping[str, float]) -> float:
    """Return the uncertainty of the metric that is least known: it must converge itself, whatever the others do."""
    judged = [name for name in JUDGED if name in second]
    if not judged:
        return math.inf
    name = max(judged, key=lambda each: second[each])
    return uncertainty(first.get(name, math.inf), second[name])


def _ways(scene: Scene) -> Iterator[Way]:
    """Give the descriptions that may serve a scene, the best first; none where the physics has no single answer."""
    from impactlab.described import has_one_answer, is_a_delay_line, is_coupled, rods_of, split_at_contacts

    if not has_one_answer(scene):
        return
    scene = split_at_contacts(scene)
    rods = rods_of(scene)
    if not rods:
        yield _rigid(scene)
        return
    hard = any(contact.law.hard for contact in scene.contacts)
    if not hard and is_a_delay_line(scene):
        yield _delay_line(scene, len(rods))
    if hard and not any(is_coupled(rod) for rod in rods):
        yield _explicit(scene, len(rods))
    yield _implicit(scene, len(rods))


def _delay_line(scene: Scene, rods: int) -> Way:
    from impactlab.described import shortest_transit, without_places
    from impactlab.descriptions import as_delay_line

    shortest, bare = shortest_transit(scene), without_places(scene)
    return Way(
        "stepped delay line, steps in the shortest transit:",
        lambda n: as_delay_line(bare, n),
        lambda n: 3e-7 * (1 + rods) * n * scene.duration / shortest,
    )


def _explicit(scene: Scene, rods: int) -> Way:
    from impactlab.described import shortest_transit
    from impactlab.descriptions import ORDINARY, as_lumped_mesh

    # On a rod of one wave speed, and wherever pieces share their elements by travel time without a remainder, waves go
    # one element in a step: no dispersion.
    shortest = shortest_transit(scene)
    return Way(
        "lumped mesh at courant 1, elements:",
        lambda n: as_lumped_mesh(scene, n, 1.0),
        lambda n: 6e-9 * rods * n * n * scene.duration / shortest,
        lambda n: as_lumped_mesh(scene, n, ORDINARY),
    )


def _implicit(scene: Scene, rods: int) -> Way:
    from impactlab.described import shortest_transit
    from impactlab.descriptions import as_consistent_mesh

    shortest = shortest_transit(scene)
    return Way(
        "consistent mesh at courant 1/2, elements:",
        lambda n: as_consistent_mesh(scene, n),
        lambda n: 16e-9 * rods * n * n * scene.duration / shortest,
    )


def _rigid(scene: Scene) -> Way:
    from impactlab.descriptions import as_rigid_bodies

    return Way("rigid bodies, steps:", lambda n: as_rigid_bodies(scene, 20 * n), lambda n: 3e-7 * 20 * n)
