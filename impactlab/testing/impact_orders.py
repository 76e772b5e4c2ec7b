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
from impactlab.scene.method import StepRule
from impactlab.simulate import driver as simulate
from impactlab.testing.scenes import STEEL, mass_on_rod
from impactlab.types import Array

ELEMENTS, POINTS = 8, 150
SPRING = 0.5 * STEEL.young * STEEL.area * ELEMENTS / STEEL.length
LINEAR = Penalty(SPRING)
STEPS = (16, 64)  # between two points; the second four times finer


def positions(integrator: AbstractScheme, steps: int, law: AbstractContactLaw = LINEAR) -> Array:
    """Return positions of the mass at fixed instants, all of them ends of steps, through contact and flight, (151,).

    Schemes that need modes get all those of the mesh, which is the same problem; adaptive ones choose their steps.
    """
    needs_modes = isinstance(integrator, AbstractIntegrator) and integrator.needs_modes
    model: AbstractRodModel = Modal(ELEMENTS, None, "lumped") if needs_modes else FiniteElement(ELEMENTS, "lumped")
    fixed, duration = isinstance(integrator, AbstractIntegrator), 2.5 * 2.0 * STEEL.length / STEEL.wave_speed
    step = StepRule(dt=duration / (POINTS * steps)) if fixed else StepRule(points_per_period=10.0)
    history = simulate.run(*mass_on_rod(model, law, integrator, step, round_trips=2.5))
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
