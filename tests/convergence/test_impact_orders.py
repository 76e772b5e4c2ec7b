"""An impact on a fixed contact spring: each scheme's error falls with the step as on a smooth problem."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest

from impactlab import simulate
from impactlab.contact.penalty import Penalty
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.bathe import Bathe
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.contact_stabilised_newmark import ContactStabilisedNewmark
from impactlab.integrators.generalised_alpha import GeneralisedAlpha
from impactlab.integrators.hht_alpha import HhtAlpha
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.moreau_jean import MoreauJean
from impactlab.integrators.newmark import Newmark
from impactlab.integrators.nonsmooth_generalised_alpha import NonsmoothGeneralisedAlpha
from impactlab.models.finite_element import FiniteElement
from impactlab.scene import Contact, End, Mass, Point, Rod, Scene, Segment, StepRule
from impactlab.types import Array

PIECE = Segment(0.3, 9e-4, 2.1e11, 7900.0)
ELEMENTS, POINTS = 8, 150
SPRING = 0.5 * PIECE.young * PIECE.area * ELEMENTS / PIECE.length


def positions(integrator: AbstractIntegrator, steps: int) -> Array:
    """Positions of the mass at fixed instants, all of them ends of steps, through contact and flight."""
    rod = Rod("rod", (PIECE,), End("free"), End("clamped"), model=FiniteElement(ELEMENTS, "lumped"))
    contact = Contact(Point("hammer", 0.0, "hammer"), Point("rod", 0.0, "rod.left"), 0.0, Penalty(SPRING))
    duration = 2.5 * rod.round_trip
    bodies = {"hammer": Mass("hammer", PIECE.mass, 1.0), "rod": rod}
    step = StepRule(dt=duration / (POINTS * steps))
    scene = Scene("struck", bodies, (contact,), duration, integrator, step, round_trip=rod.round_trip)
    history = simulate.run(scene)
    assert [event.kind for event in history.events] == ["close", "open"]
    return history.evaluate(np.linspace(0.0, duration, POINTS + 1), "position:hammer")


@functools.cache
def reference() -> tuple[float, ...]:
    """The same semi-discrete problem at steps of a sixteenth of the finest tested, the h^2 of its error taken off."""
    coarse, fine = (positions(Midpoint(), steps) for steps in (256, 512))
    return tuple(fine + (fine - coarse) / 3.0)


@pytest.mark.parametrize(
    ("integrator", "order"),
    [
        (Newmark(), 2),
        (CentralDifference(), 2),
        (Midpoint(), 2),
        (HhtAlpha(), 2),
        (HhtAlpha(-1.0 / 3.0), 2),
        (GeneralisedAlpha(0.0), 2),
        (GeneralisedAlpha(), 2),
        (GeneralisedAlpha(1.0), 2),
        (NonsmoothGeneralisedAlpha(0.0), 2),
        (NonsmoothGeneralisedAlpha(), 2),
        (Bathe(), 2),
        (MoreauJean(), 2),
        (MoreauJean(1.0), 1),
        (ContactStabilisedNewmark(), 2),
    ],
    ids=str,
)
def test_error_of_the_mass_falls_with_the_step(integrator: AbstractIntegrator, order: int) -> None:
    errors = [float(np.linalg.norm(positions(integrator, steps) - np.array(reference()))) for steps in (16, 64)]
    # The force's slope jumps where contact begins and ends, at any point of a step: the error wobbles by that much.
    assert math.log2(errors[0] / errors[1]) / 2.0 == pytest.approx(order, abs=0.1)
