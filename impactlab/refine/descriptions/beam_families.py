"""Descriptions of scenes with beams among which the automatic choice picks.

Those of references (`impactlab.refine.descriptions.beams`) refine space and time alike, so that every error falls. Here
each is as fine in space as costs little beside its steps. Two errors add up: the modes or elements left out, of order 3
to 4 in their number where nothing shears, and the steps across a contact, of order 2 and, over the scenes of the
suite, between 3e-4 and 0.7 of the square of a step over a rise of force. A mode costs 1/70 of a step's other work, so
the modes grow slowly, as steps^(2/3), from a number at which they hardly matter; the error is then that of the steps.
The flexibility of the modes left out, beside that of the contact, shows where more are needed: a beam that shears has a
kink at its force, and its modes converge as 1/n there, elements with a node at it as 1/n2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.midpoint import Midpoint
from impactlab.models.finite_element import FiniteElement
from impactlab.models.mesh.absorbing import SENT_BACK, SENT_BACK_LUMPED
from impactlab.models.mesh.beam_elements import lumped, matrices
from impactlab.refine.descriptions import cost
from impactlab.refine.descriptions.beam_modes import COARSEST, UNIT, BeamModesFamily, counted_share, rises
from impactlab.refine.descriptions.beams import (
    STEPS,
    are_delay_lines,
    can_be_set_up,
    continuous,
    is_infinite,
    shortest_time,
)
from impactlab.refine.descriptions.description import Description
from impactlab.refine.descriptions.rods import modelled_as, recorded
from impactlab.scene.bodies import Beam
from impactlab.scene.facts import beams_of, split_at_contacts
from impactlab.scene.method import Simulation, StepRule, force_jumps, laws_of

COARSEST_ELEMENTS = 10  # of a mesh, at the coarsest steps
STEPS_PER_ELEMENT = 6  # in the shortest time, of a mesh that shears: its errors in space and time are alike
STABLE_POINTS = 2.0 * math.pi / (2.0 * 0.95)  # steps in a period: 0.95 of the longest stable one
# Factors of predicted errors: medians over the scenes of benchmarks/choice.py.
ERROR_OF_MESH, ERROR_OF_SHEARED_MESH, ERROR_OF_GRIDS = 0.5, 0.08, 0.12
ERROR_OF_EXPLICIT, ERROR_OF_EXPLICIT_FRONTS = 1.2, 40.0


def families(request: Simulation) -> Iterator[Description]:
    """Give the descriptions of a scene with beams, in no order."""
    beams = beams_of(request.scene)
    grids = continuous(request, force_jumps(*request), unchecked=True)
    if grids is not None:
        yield _continuous(grids)
        grids = grids if can_be_set_up(grids) else None  # looked at only where others are compared
        if grids is not None and any(is_infinite(beam) for beam in beams):  # a mesh reflects a little at any fineness
            return
    sheared = any(beam.theory == "timoshenko" for beam in beams)
    hard = any(law.hard for law in laws_of(*request))
    if all(_has_modes(beam) for beam in beams) and are_delay_lines(request.scene) and not (sheared and hard):
        yield BeamModesFamily(request).description()
    if grids is None:  # a hard contact on a beam that shears: fronts, which its characteristics carry
        yield _implicit(request, sheared)
    if all(beam.theory == "timoshenko" and not beam.is_damped and beam.rotation is None for beam in beams):
        yield _explicit(request)


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


def _implicit(request: Simulation, sheared: bool) -> Description:
    scene = request.scene
    shortest, meshed = shortest_time(request), Simulation(split_at_contacts(scene), request.method)
    jumps = force_jumps(*request)
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
        error=lambda n: (
            counted_share(request) * (ERROR_OF_SHEARED_MESH if sheared else ERROR_OF_MESH) / rises(n) ** order
        ),
        order=order,
        safety=3.0,
        min_fineness=COARSEST,
        unseen=lambda _n, _history: SENT_BACK * any(is_infinite(beam) for beam in beams_of(scene)),
        detail=lambda n: f"{elements(n)} elements",
    )


def _explicit(request: Simulation) -> Description:
    meshed = Simulation(split_at_contacts(request.scene), request.method)
    jumps = force_jumps(*request)
    order = 1.5 if jumps else 2.0  # measured on a free beam under a hard contact: 1.85
    fastest = [_highest(meshed, count) for count in (12, 96)]
    power = math.log(fastest[1] / fastest[0]) / math.log(8.0)

    def work(n: int) -> tuple[float, float]:
        frequency = fastest[0] * (n / 12.0) ** power
        return request.scene.duration * frequency * STABLE_POINTS / (2.0 * math.pi), len(request.scene.elastic) * n

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
        unseen=lambda _n, _history: SENT_BACK_LUMPED * any(is_infinite(beam) for beam in beams_of(request.scene)),
    )


def _highest(meshed: Simulation, elements: int) -> float:
    """Return an upper bound on the highest frequency of a mesh [rad/s].

    It is the highest frequency of a free element; each body has ``elements`` of them.
    """
    found = [2.0 * elements * max(s.wave_speed / rod.length for s in rod.segments) for rod in meshed.scene.wave_bodies]
    for beam in beams_of(meshed.scene):
        for segment in beam.segments:
            h = beam.length / elements
            scale = 1.0 / np.sqrt(lumped(segment, h))
            stiffness = matrices(segment, h).stiffness
            found.append(math.sqrt(float(np.linalg.eigvalsh(scale[:, None] * stiffness * scale)[-1])))
    return max(found)
