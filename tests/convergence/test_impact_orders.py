"""An impact on a fixed contact spring: each scheme's error falls with the step as on a smooth problem."""

from __future__ import annotations

import pytest

from impactlab.contact.base import AbstractContactLaw
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
from impactlab.testing.scenes import STEEL
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
