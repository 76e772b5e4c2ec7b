"""The order of a scheme on an impact: a mass meets a clamped rod through a fixed spring, the mesh staying as it is."""

from __future__ import annotations

import functools
import math

import numpy as np

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.penalty import Penalty
from impactlab.integrators.base import AbstractIntegrator, AbstractScheme
from impactlab.integrators.midpoint import Midpoint
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene.bodies import Body, End, Mass, Rod, Segment
from impactlab.scene.problem import Contact, Point, Scene, StepRule
from impactlab.simulate import driver as simulate
from impactlab.types import Array

PIECE = Segment(0.3, 9e-4, 2.1e11, 7900.0)
ELEMENTS, POINTS = 8, 150
SPRING = 0.5 * PIECE.young * PIECE.area * ELEMENTS / PIECE.length
LINEAR = Penalty(SPRING)
STEPS = (16, 64)  # between two points; the second four times finer


def positions(integrator: AbstractScheme, steps: int, law: AbstractContactLaw = LINEAR) -> Array:
    """Return positions of the mass at fixed instants, all of them ends of steps, through contact and flight, (151,).

    Schemes that need modes get all those of the mesh, which is the same problem; adaptive ones choose their steps.
    """
    needs_modes = isinstance(integrator, AbstractIntegrator) and integrator.needs_modes
    model: AbstractRodModel = Modal(ELEMENTS, None, "lumped") if needs_modes else FiniteElement(ELEMENTS, "lumped")
    rod = Rod("rod", (PIECE,), End("free"), End("clamped"), model=model)
    contact = Contact(Point("hammer", 0.0, "hammer"), Point("rod", 0.0, "rod.left"), 0.0, law)
    duration = 2.5 * rod.round_trip
    bodies: dict[str, Body] = {"hammer": Mass("hammer", PIECE.mass, 1.0), "rod": rod}
    fixed = isinstance(integrator, AbstractIntegrator)
    step = StepRule(dt=duration / (POINTS * steps)) if fixed else StepRule(points_per_period=10.0)
    scene = Scene("struck", bodies, (contact,), duration, integrator, step, round_trip=rod.round_trip)
    history = simulate.run(scene)
    assert [event.kind for event in history.events] == ["close", "open"]
    return history.evaluate(np.linspace(0.0, duration, POINTS + 1), "position:hammer")


@functools.cache
def reference(law: AbstractContactLaw = LINEAR) -> tuple[float, ...]:
    """Return the same of the semi-discrete problem: fine midpoint steps, the h^2 of their error taken off."""
    coarse, fine = (positions(Midpoint(), steps, law) for steps in (256, 512))
    return tuple(fine + (fine - coarse) / 3.0)


def error(integrator: AbstractScheme, steps: int, law: AbstractContactLaw = LINEAR) -> float:
    """Return the error of the positions in the Euclidean norm [m]."""
    return float(np.linalg.norm(positions(integrator, steps, law) - np.array(reference(law))))


def impact_order(integrator: AbstractScheme, law: AbstractContactLaw = LINEAR) -> float:
    """Return the order at which the error falls from 16 to 64 steps between two points."""
    coarse, fine = (error(integrator, steps, law) for steps in STEPS)
    return math.log(coarse / fine) / math.log(STEPS[1] / STEPS[0])
