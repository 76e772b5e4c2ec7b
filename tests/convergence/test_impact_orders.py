"""An impact on a fixed contact spring: each scheme's error falls with the step as on a smooth problem."""

from __future__ import annotations

import pytest

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
from impactlab.testing.impact_orders import impact_order


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
