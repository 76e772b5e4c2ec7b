"""An impact on a fixed contact spring: each scheme's error falls with the step as on a smooth problem."""

from __future__ import annotations

import math

import pytest

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Flores, Hertz
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.bathe import Bathe
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.contact_stabilised_newmark import ContactStabilisedNewmark
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.generalised_alpha import GeneralisedAlpha
from impactlab.integrators.hht_alpha import HhtAlpha
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.moreau_jean import MoreauJean
from impactlab.integrators.newmark import Newmark
from impactlab.integrators.nonsmooth_generalised_alpha import NonsmoothGeneralisedAlpha
from impactlab.scene import Contact, Mass, Point, Wall
from impactlab.scene.method import StepRule
from impactlab.simulate import run
from impactlab.testing.scenes import STEEL, simulation
from studies.comparison.orders import SPRING, impact_order

# The same force at a typical indentation: 1 m/s over the frequency of the mass on the spring.
CURVED = SPRING * (SPRING / STEEL.mass) ** 0.25


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
        (ExactModal(), 2),
    ],
    ids=str,
)
def test_error_of_the_mass_falls_with_the_step(integrator: AbstractIntegrator, order: int) -> None:
    # The force's slope jumps where contact begins and ends, at any point of a step: the error wobbles by that much.
    assert impact_order(integrator) == pytest.approx(order, abs=0.1)


@pytest.mark.parametrize("law", [Hertz(CURVED), Flores(CURVED, restitution=0.7)], ids=["hertz", "flores"])
@pytest.mark.parametrize(
    "integrator", [Newmark(), CentralDifference(), GeneralisedAlpha(), GeneralisedAlpha(0.0)], ids=str
)
def test_power_laws_keep_the_order_wherever_the_force_acts(
    integrator: AbstractIntegrator, law: AbstractContactLaw
) -> None:
    assert impact_order(integrator, law) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("beyond", [0.0, 0.8], ids=["whole_steps", "last_step_goes_beyond"])
@pytest.mark.parametrize("integrator", [Newmark(), CentralDifference(), Midpoint(), GeneralisedAlpha()], ids=str)
def test_the_peak_of_a_force_that_still_rises_at_the_end_is_of_second_order(
    integrator: AbstractIntegrator, beyond: float
) -> None:
    """A mass on a spring for an eighth of its period: the force is v sqrt(k m) sin(pi/4).

    The last step may go beyond the run, by a share of it that holds its middle.
    """
    mass, stiffness, speed = 2.0, 1e8, 3.0
    duration = 0.25 * math.pi * math.sqrt(mass / stiffness)
    exact = speed * math.sqrt(stiffness * mass) * math.sin(0.25 * math.pi)
    bodies = {"ball": Mass("ball", mass, speed), "wall": Wall("wall")}
    contact = Contact(Point("ball", 0.0, "ball"), Point("wall", 0.0, "wall"), 0.0)
    errors = []
    for steps in (20, 40, 80):
        rule = StepRule(dt=duration / (steps - beyond))
        scene = simulation("ball", bodies, (contact,), duration, integrator, rule, law=Penalty(stiffness))
        errors.append(abs(run(*scene).contacts[0].peak_force / exact - 1.0))
    assert errors[0] < 3e-3
    assert errors[1] < errors[0] / 3.0
    assert errors[2] < errors[1] / 3.0
