"""Descriptions of a scene that one number refines: candidates of the automatic choice, levels of converged answers."""

from __future__ import annotations

import math
from typing import Literal

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.integrators.adaptive import Adaptive
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.refine.described import described
from impactlab.scene.facts import rods_of, shortest_transit
from impactlab.scene.method import Method, Simulation, StepRule
from impactlab.scene.problem import RECORDS, Scene

MAX_RECORDS = 200_000  # instants that are kept, 14 MB for a contact
ORDINARY = 0.95  # courant number at which no wave goes just one element in a step


def as_waves(asked: Simulation) -> Simulation:
    """Return the scene on continuous rods, solved from event to event."""
    return described(asked, Continuous(), None, StepRule(points_per_period=10.0), AdditionDeletion())


def as_delay_line(asked: Simulation, steps: int) -> Simulation:
    """Return the scene on continuous rods, with so many steps in the shortest transit."""
    dt = shortest_transit(asked.scene) / steps
    return _recorded(described(asked, Continuous(), None, StepRule(dt=dt)), math.ceil(asked.scene.duration / dt))


def as_lumped_mesh(asked: Simulation, elements: int, courant: float) -> Simulation:
    """Return the scene on 2-node bars of lumped mass under central differences."""
    rule = StepRule(courant=courant)
    return described(asked, FiniteElement(elements, "lumped"), CentralDifference(), rule, AdditionDeletion())


def as_implicit_mesh(
    asked: Simulation, elements: int, mass: Literal["consistent", "lumped"] = "consistent"
) -> Simulation:
    """Return the scene on 2-node bars under the midpoint rule, half an element in a step."""
    return described(asked, FiniteElement(elements, mass), Midpoint(), StepRule(courant=0.5), AdditionDeletion())


def as_rigid_bodies(asked: Simulation, steps: int) -> Simulation:
    """Return a scene without rods in so many steps, its bodies moved exactly under a constant force."""
    rule = StepRule(dt=asked.scene.duration / steps)
    return _recorded(Simulation(asked.scene, Method(asked.method.laws, {}, ExactModal(), rule)), steps)


def _recorded(made: Simulation, steps: int) -> Simulation:
    """Return the scene with up to `MAX_RECORDS` steps kept, unless the case limits them: records give the forces."""
    if made.scene.records != RECORDS:
        return made
    return made.but(records=max(RECORDS, min(steps, MAX_RECORDS)))


def as_adaptive_bodies(asked: Simulation, tolerance: float, most_steps: int) -> Simulation:
    """Return a scene without rods under adaptive steps between located events, with a relative tolerance."""
    integrator = Adaptive(relative_tolerance=max(tolerance, 1e-12), most_steps=most_steps)
    rule = StepRule(points_per_period=10.0)
    return Simulation(asked.scene, Method(asked.method.laws, {}, integrator, rule))


def is_special(scene: Scene) -> bool:
    """Return whether waves go one element in a step on every rod at courant 1, whatever the number of elements.

    Then a mesh disperses nothing, and its error is that of its contacts alone: two meshes of such a step share what
    flatters them and do not stand for each other.
    """
    ways = [segment.length / segment.wave_speed for rod in rods_of(scene) for segment in rod.segments]
    return max(ways) - min(ways) <= 1e-9 * max(ways)
