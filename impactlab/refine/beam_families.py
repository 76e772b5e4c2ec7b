"""Descriptions of scenes with beams among which the automatic choice picks.

Those of references (`impactlab.refine.beam_descriptions`) refine space and time alike, so that every error falls. Here
each is as fine in space as costs little beside its steps. Two errors add up: the modes or elements left out, of order 3
to 4 in their number where nothing shears, and the steps across a contact, of order 2 and, over the scenes of the
suite, between 3e-4 and 0.7 of the square of a step over a rise of force. A mode costs 1/70 of a step's other work, so
the modes grow slowly, as steps^(2/3), from a number at which they hardly matter; the error is then that of the steps.
The flexibility of the modes left out, beside that of the contact, says where more are needed: a beam that shears has a
kink at its force, and its modes converge as 1/n there, elements with a node at it as 1/n2.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator

import numpy as np

from impactlab.bases.beams.modes import has_closed_form
from impactlab.history.base import AbstractHistory
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.newmark import Newmark
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.mesh.beam_elements import lumped, matrices
from impactlab.refine import cost, left_out
from impactlab.refine.beam_descriptions import (
    MAX_DENSE_ELEMENTS,
    STEPS,
    are_delay_lines,
    can_be_set_up,
    continuous,
    is_infinite,
    is_lossy,
    modal_model,
    shortest_time,
)
from impactlab.refine.contact_times import times_of
from impactlab.refine.description import Description
from impactlab.refine.descriptions import modelled_as, recorded
from impactlab.refine.distances import counted
from impactlab.scene.bodies import Beam
from impactlab.scene.facts import beams_of, rods_of, split_at_contacts
from impactlab.scene.method import Simulation, StepRule, force_jumps, laws_of

UNIT = "steps in the shortest time of the scene"
COARSEST = 3 * STEPS  # steps in the shortest time: three in a rise of force
COARSEST_MODES, FEWEST_MESHED, COARSEST_ELEMENTS = 24, 18, 10  # at that many steps; modes in closed form, of a mesh
COARSEST_KNOWN = 18  # modes at that many steps where the flexibility of the others is known at every contact
ELEMENTS_PER_MODE = 1.5  # of the mesh behind modes without a closed form
EIGENVECTORS_S = 1e-10  # s, over the cube of the coordinates of that mesh
CLOSED_FORM_S = 1e-5  # s, of a mode in closed form
STEPS_PER_ELEMENT = 6  # in the shortest time, of a mesh that shears: its errors in space and time are alike
STABLE_POINTS = 2.0 * math.pi / (2.0 * 0.95)  # steps in a period: 0.95 of the longest stable one
MOST_MODES = 1500  # in closed form, some 0.1 ms each to find
MAX_STEPS = 1_000_000  # in the shortest time
MISSING_SHARE = 0.3  # of the tolerance, that modes left out may take
STATED_SHARE, STATED_SHARE_OF_SHEAR = 0.25, 0.45  # the same where it is stated: of errors of order 3 and of order 1
MAX_UNSEEN_SHARE = 0.5  # the same where no more modes may be taken, and their error is stated by their flexibility
DEFAULT_TOLERANCE = 1e-3  # where a scene has none: for trials of the cost model
# Factors of predicted errors: medians over the scenes of benchmarks/choice.py.
ERROR_OF_MODES, ERROR_OF_SPRINGS, ERROR_OF_MESH, ERROR_OF_SHEARED_MESH, ERROR_OF_GRIDS = 0.15, 0.04, 0.5, 0.08, 0.12
ERROR_OF_EXPLICIT, ERROR_OF_EXPLICIT_FRONTS = 1.2, 40.0
ERROR_OF_IMPULSES = 0.2  # of these where impulses alone count: a force that is wrong one way and the other has its sum
MISSING_MARGIN = 1.5  # on errors by modes left out: measured, 0.1 to 1.2 of the flexibility beside the contact's


def families(asked: Simulation) -> Iterator[Description]:
    """Give the descriptions of a scene with beams, in no order."""
    beams = beams_of(asked.scene)
    grids = continuous(asked, force_jumps(*asked), unchecked=True)
    if grids is not None:
        yield _continuous(grids)
        grids = grids if can_be_set_up(grids) else None  # looked at only where others are compared
        if grids is not None and any(is_infinite(beam) for beam in beams):  # a mesh reflects a little at any fineness
            return
    sheared = any(beam.theory == "timoshenko" for beam in beams)
    hard = any(law.hard for law in laws_of(*asked))
    if all(_has_modes(beam) for beam in beams) and are_delay_lines(asked.scene) and not (sheared and hard):
        yield _modal(asked)
    if grids is None:  # a hard contact on a beam that shears: fronts, which its characteristics carry
        yield _implicit(asked, sheared)
    if all(beam.theory == "timoshenko" and not beam.is_damped and beam.rotation is None for beam in beams):
        yield _explicit(asked)


def _has_modes(beam: Beam) -> bool:
    """Return whether a beam has modes that its losses leave uncoupled."""
    plain = not any(end.kind in ("dashpot", "infinite") for end in (beam.left, beam.right))
    return plain and not any(segment.viscosity for segment in beam.segments)


def _continuous(grids: Description) -> Description:
    return Description(
        grids.name,
        grids.unit,
        grids.simulation,
        grids.cost,
        grids.work,
        error=lambda n: ERROR_OF_GRIDS / n**2,
        safety=3.0,
        min_fineness=6,
    )


def _share(asked: Simulation) -> float:
    """Return the share of a predicted error that the quantities which count have."""
    return ERROR_OF_IMPULSES if counted(asked)[2] == ("impulses",) else 1.0


def _rises(n: float) -> float:
    """Return the steps in a rise of force."""
    return n / STEPS


def _modal(asked: Simulation, seen: AbstractHistory | None = None) -> Description:
    """Give modes; ``seen`` is a run with too few of them, whose displacements say how many it takes."""
    scene, beams = asked.scene, beams_of(asked.scene)
    shortest, missing = shortest_time(asked), left_out.beside_contacts(asked)
    if seen is not None:
        missing += left_out.beside_displacements(asked, seen)
    transit = min((0.5 * rod.round_trip for rod in rods_of(scene)), default=math.inf)
    lossy, closed = any(is_lossy(beam) for beam in beams), all(has_closed_form(beam) for beam in beams)
    tolerance = asked.method.tolerance.error if asked.method.tolerance else DEFAULT_TOLERANCE
    factor = _share(asked) * (ERROR_OF_SPRINGS if all(law.is_spring for law in laws_of(*asked)) else ERROR_OF_MODES)
    enough = STEPS * math.sqrt(3.0 * factor / tolerance)
    most = MOST_MODES if closed else int(MAX_DENSE_ELEMENTS / ELEMENTS_PER_MODE)
    known = not any(math.isnan(times.tangent) for times in times_of(*asked).values())
    # All runs have the same modes, whose error is stated: they are found once, and a run that differs in its step alone
    # is set up in a tenth of the time. Where this would take too many modes, they grow with the steps.
    fixed = known and MISSING_MARGIN * left_out.total(missing, most) <= MAX_UNSEEN_SHARE * tolerance
    coarsest = COARSEST_KNOWN if known else COARSEST_MODES

    def dt(n: int) -> float:
        return min(shortest / n, transit)

    @functools.cache
    def wanted(n: int) -> int:
        fine = (max(enough, COARSEST) if fixed else n) / COARSEST
        few = coarsest * math.pow(fine, 2.0 / 3.0) if closed else FEWEST_MESHED * math.pow(fine, 1.0 / 3.0)
        if fixed:
            return math.ceil(max([few, *(share.modes_for(_stated(share) * tolerance) for share in missing)]))
        # As the steps that the tolerance is predicted to need grow finer or coarser, so do the modes.
        needed = [
            share.modes_for(MISSING_SHARE * tolerance) * math.pow(n / enough, 1.0 / min(share.power, 1.5))
            for share in missing
        ]
        return math.ceil(max([few, *needed]))

    def modes(n: int) -> int:
        return min(wanted(n), most)

    @functools.lru_cache(maxsize=1)
    def beside(history: AbstractHistory) -> list[left_out.Share]:
        return left_out.beside_displacements(asked, history)

    def unseen(n: int, history: AbstractHistory | None = None) -> float:
        if not fixed and wanted(n) <= most:
            return 0.0
        found = left_out.total(missing, modes(n))
        if history is not None and "displacements" in counted(asked)[2]:
            found = max(found, left_out.total(beside(history), modes(n)))
        return MISSING_MARGIN * found

    def finding(n: int) -> float:
        if closed:  # once for all runs that have the same modes: whichever is chosen needs them
            return 0.0 if fixed else CLOSED_FORM_S * modes(n)
        return EIGENVECTORS_S * (2.0 * ELEMENTS_PER_MODE * modes(n)) ** 3

    def simulation(n: int) -> Simulation:
        if lossy:
            rods = modelled_as(asked, Continuous(), Newmark(), StepRule(dt=dt(n)))
        else:
            rods = modelled_as(asked, Continuous(), ExactModal(), StepRule(dt=dt(n)))
        models = {beam.name: modal_model(beam, modes(n), ELEMENTS_PER_MODE) for beam in beams}
        return recorded(rods.but(models={**rods.method.models, **models}), scene.duration / dt(n))

    return Description(
        "modes under Newmark's method" if lossy else "modes under exact steps",
        UNIT,
        simulation,
        cost.BEAM_DAMPED_MODES if lossy else cost.BEAM_MODES,
        lambda n: (scene.duration / dt(n), len(beams) * modes(n)),
        error=lambda n: factor / _rises(n) ** 2 + (0.0 if fixed else left_out.total(missing, modes(n))),
        safety=2.0,
        min_fineness=COARSEST,
        # Two runs with as many modes do not show the error of the others, which is then stated by their flexibility.
        max_fineness=MAX_STEPS if fixed else _finest(wanted, most),
        unseen=unseen,
        alike=fixed,
        otherwise=functools.partial(_modal, asked) if fixed and seen is None else None,
        detail=lambda n: f"{modes(n)} modes",
        finding=finding,
    )


def _stated(share: left_out.Share) -> float:
    """Return the share of a tolerance for modes left out that costs least: more modes, or more steps for the rest."""
    return (STATED_SHARE if share.power > 1.0 else STATED_SHARE_OF_SHEAR) / MISSING_MARGIN


def _finest(modes: Callable[[int], int], most: int) -> int:
    """Return the greatest fineness with no more modes than may be: two runs with as many would not show the others."""
    low, high = COARSEST, MAX_STEPS
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if modes(middle) <= most else (low, middle)
    return low


def _implicit(asked: Simulation, sheared: bool) -> Description:
    scene = asked.scene
    shortest, meshed = shortest_time(asked), Simulation(split_at_contacts(scene), asked.method)
    jumps = force_jumps(*asked)
    order = 1.0 if jumps and sheared else 2.0

    def elements(n: int) -> int:
        if sheared or jumps:
            return math.ceil(n / (STEPS_PER_ELEMENT if sheared else STEPS))
        return math.ceil(COARSEST_ELEMENTS * math.sqrt(n / COARSEST))

    def simulation(n: int) -> Simulation:
        made = modelled_as(meshed, FiniteElement(elements(n)), Midpoint(), StepRule(dt=shortest / n))
        return recorded(made, n * scene.duration / shortest)

    return Description(
        "consistent mesh under the midpoint rule",
        UNIT,
        simulation,
        cost.BEAM_DAMPED_MESH if any(beam.is_damped for beam in beams_of(scene)) else cost.BEAM_MESH,
        lambda n: (n * scene.duration / shortest, len(scene.elastic) * elements(n)),
        error=lambda n: _share(asked) * (ERROR_OF_SHEARED_MESH if sheared else ERROR_OF_MESH) / _rises(n) ** order,
        order=order,
        safety=3.0,
        min_fineness=COARSEST,
        detail=lambda n: f"{elements(n)} elements",
    )


def _explicit(asked: Simulation) -> Description:
    meshed = Simulation(split_at_contacts(asked.scene), asked.method)
    jumps = force_jumps(*asked)
    order = 1.5 if jumps else 2.0  # measured on a free beam under a hard contact: 1.85
    fastest = [_highest(meshed, count) for count in (12, 96)]
    power = math.log(fastest[1] / fastest[0]) / math.log(8.0)

    def work(n: int) -> tuple[float, float]:
        frequency = fastest[0] * (n / 12.0) ** power
        return asked.scene.duration * frequency * STABLE_POINTS / (2.0 * math.pi), len(asked.scene.elastic) * n

    def simulation(n: int) -> Simulation:
        step = StepRule(points_per_period=STABLE_POINTS)
        return recorded(modelled_as(meshed, FiniteElement(n, "lumped"), CentralDifference(), step), work(n)[0])

    return Description(
        "lumped mesh, central difference",
        "elements a body",
        simulation,
        cost.BEAM_EXPLICIT,
        work,
        error=lambda n: (ERROR_OF_EXPLICIT_FRONTS if jumps else ERROR_OF_EXPLICIT) / n**order,
        order=order,
        safety=3.0,
        min_fineness=12,
    )


def _highest(meshed: Simulation, elements: int) -> float:
    """Return about the highest frequency of a mesh with so many elements a body [rad/s], by elements cut free."""
    found = [2.0 * elements * max(s.wave_speed / rod.length for s in rod.segments) for rod in rods_of(meshed.scene)]
    for beam in beams_of(meshed.scene):
        for segment in beam.segments:
            h = beam.length / elements
            scale = 1.0 / np.sqrt(lumped(segment, h))
            stiffness = matrices(segment, h).stiffness
            found.append(math.sqrt(float(np.linalg.eigvalsh(scale[:, None] * stiffness * scale)[-1])))
    return max(found)
