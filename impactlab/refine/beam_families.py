"""Descriptions of scenes with beams among which the automatic choice picks.

Those of references (`impactlab.refine.beam_descriptions`) refine space and time alike, so that every error falls. Here
each is as fine in space as costs little beside its steps. Two errors add up: the modes or elements left out, of order 3
to 4 in their number where nothing shears, and the steps across a contact, of order 2 and, over the scenes of the
suite, between 3e-4 and 0.7 of the square of a step over a rise of force. A mode costs 1/200 of a step's other work, so
the modes grow slowly, as steps^(2/3), from a number at which they hardly matter; the error is then that of the steps.
A beam that shears has a kink at its force: modes converge as 1/n there, and elements with a node at it as 1/n2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.mesh.beam_elements import lumped, matrices
from impactlab.refine import cost
from impactlab.refine.beam_descriptions import (
    STEPS,
    are_delay_lines,
    continuous,
    is_infinite,
    is_lossy,
    modal_model,
    shortest_time,
)
from impactlab.refine.descriptions import Description, modelled_as
from impactlab.scene.facts import beams_of, rods_of, split_at_contacts
from impactlab.scene.method import Simulation, StepRule, force_jumps
from impactlab.simulate.body_sizes import MAX_BEAM_MODES

UNIT = "steps in the shortest time of the scene"
COARSEST = 3 * STEPS  # steps in the shortest time: three in a rise of force
COARSEST_MODES, COARSEST_ELEMENTS = 24, 10  # at that many steps
ELEMENTS_PER_MODE = 2  # of the mesh behind modes without a closed form
STEPS_PER_ELEMENT = 6  # in the shortest time, of a mesh that shears: its errors in space and time are alike
STABLE_POINTS = 2.0 * math.pi / (2.0 * 0.95)  # steps in a period: 0.95 of the longest stable one
ERROR_OF_MODES, ERROR_OF_MESH, ERROR_OF_EXPLICIT = 0.03, 0.2, 0.4  # median factors of predicted errors


def families(asked: Simulation) -> Iterator[Description]:
    """Give the descriptions of a scene with beams, in no order."""
    beams = beams_of(asked.scene)
    grids = continuous(asked)
    if grids is not None:
        yield _continuous(asked, grids)
        if any(is_infinite(beam) for beam in beams):  # the absorbing layer of a mesh reflects a little at any fineness
            return
    sheared = any(beam.theory == "timoshenko" for beam in beams)
    if not any(is_lossy(beam) for beam in beams) and are_delay_lines(asked.scene):
        yield _modal(asked, sheared)
    yield _implicit(asked, sheared)
    if all(beam.theory == "timoshenko" and not beam.is_damped and beam.rotation is None for beam in beams):
        yield _explicit(asked)


def _continuous(asked: Simulation, grids: Description) -> Description:
    jumps = force_jumps(*asked)
    return Description(
        grids.name,
        grids.unit,
        grids.simulation,
        grids.cost,
        grids.work,
        error=lambda n: 1.0 / n**2,
        order=1.0 if jumps else 2.0,
        safety=3.0,
    )


def _rises(n: float) -> float:
    """Return the steps in a rise of force."""
    return n / STEPS


def _modal(asked: Simulation, sheared: bool) -> Description:
    scene, beams = asked.scene, beams_of(asked.scene)
    shortest = shortest_time(asked)
    transit = min((0.5 * rod.round_trip for rod in rods_of(scene)), default=math.inf)
    order = 1.0 if sheared else 2.0

    def dt(n: int) -> float:
        return min(shortest / n, transit)

    def modes(n: int) -> int:
        return math.ceil(COARSEST_MODES * math.pow(n / COARSEST, 1.0 if sheared else 2.0 / 3.0))

    def simulation(n: int) -> Simulation:
        rods = modelled_as(asked, Continuous(), ExactModal(), StepRule(dt=dt(n)))
        models = {beam.name: modal_model(beam, modes(n), ELEMENTS_PER_MODE) for beam in beams}
        return rods.but(models={**rods.method.models, **models})

    return Description(
        "modes under exact steps",
        UNIT,
        simulation,
        cost.BEAM_MODES,
        lambda n: (scene.duration / dt(n), len(beams) * modes(n)),
        error=lambda n: 1.0 / modes(n) if sheared else ERROR_OF_MODES / _rises(n) ** 2,
        order=order,
        safety=3.0,
        min_fineness=COARSEST,
        max_fineness=int(COARSEST * (MAX_BEAM_MODES / COARSEST_MODES) ** (1.0 / order if sheared else 1.5)),
        detail=lambda n: f"{modes(n)} modes",
    )


def _implicit(asked: Simulation, sheared: bool) -> Description:
    scene = asked.scene
    shortest, meshed = shortest_time(asked), Simulation(split_at_contacts(scene), asked.method)
    jumps = force_jumps(*asked)

    def elements(n: int) -> int:
        if sheared or jumps:
            return math.ceil(n / STEPS_PER_ELEMENT)
        return math.ceil(COARSEST_ELEMENTS * math.sqrt(n / COARSEST))

    def simulation(n: int) -> Simulation:
        return modelled_as(meshed, FiniteElement(elements(n)), Midpoint(), StepRule(dt=shortest / n))

    return Description(
        "consistent mesh under the midpoint rule",
        UNIT,
        simulation,
        cost.BEAM_MESH,
        lambda n: (n * scene.duration / shortest, len(scene.elastic) * elements(n)),
        error=lambda n: ERROR_OF_MESH / _rises(n) ** (1.0 if jumps else 2.0),
        order=1.0 if jumps else 2.0,
        safety=3.0,
        min_fineness=COARSEST,
        detail=lambda n: f"{elements(n)} elements",
    )


def _explicit(asked: Simulation) -> Description:
    meshed = Simulation(split_at_contacts(asked.scene), asked.method)
    jumps = force_jumps(*asked)
    fastest = [_highest(meshed, count) for count in (12, 96)]
    power = math.log(fastest[1] / fastest[0]) / math.log(8.0)

    def work(n: int) -> tuple[float, float]:
        frequency = fastest[0] * (n / 12.0) ** power
        return asked.scene.duration * frequency * STABLE_POINTS / (2.0 * math.pi), len(asked.scene.elastic) * n

    def simulation(n: int) -> Simulation:
        step = StepRule(points_per_period=STABLE_POINTS)
        return modelled_as(meshed, FiniteElement(n, "lumped"), CentralDifference(), step)

    return Description(
        "lumped mesh, central difference",
        "elements a body",
        simulation,
        cost.BEAM_EXPLICIT,
        work,
        error=lambda n: ERROR_OF_EXPLICIT / n ** (1.0 if jumps else 2.0),
        order=1.0 if jumps else 2.0,
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
