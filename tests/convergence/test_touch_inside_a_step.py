"""A dashpot that is touched anywhere inside a step: every scheme keeps its second order, whatever the phase."""

from __future__ import annotations

import math

import pytest

from impactlab import simulate
from impactlab.contact.khulief_shabana import KhuliefShabana
from impactlab.contact.penalty import Penalty
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.generalised_alpha import GeneralisedAlpha
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.newmark import Newmark
from impactlab.scene import Mass, Wall
from impactlab.scene.method import StepRule
from impactlab.testing.scenes import in_a_row

K, M, ZETA = 1e6, 1.0, 0.6
SPAN = 3e-3  # s: the contact ends 2 acos(zeta)/w_d = 2.32 ms after the touch, at the latest 0.1 ms after the start
RESTITUTION = math.exp(-2.0 * ZETA * math.acos(ZETA) / math.sqrt(1.0 - ZETA**2))
LAWS = {"penalty": Penalty(K, 2.0 * ZETA * math.sqrt(K * M)), "khulief_shabana": KhuliefShabana(K, RESTITUTION)}
PHASES = (0.0, 0.13, 0.37, 0.5, 0.71, 0.94)


def worst(law, integrator, dt):
    """The largest error of the exit speed over touches at several places in a step; F = k d + c d', never pulling."""
    errors = []
    for phase in PHASES:
        bodies, gap = (Mass("ball", M, 1.0), Wall("wall")), (2.0 + phase) * dt
        history = simulate.run(*in_a_row(bodies, None, law, integrator, StepRule(dt=dt), gaps=gap, duration=SPAN))
        errors.append(abs(float(history.evaluate([SPAN], "velocity:ball")[0]) + RESTITUTION))
    return max(errors)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize(
    "integrator",
    [ExactModal(), Midpoint(), Newmark(), CentralDifference(), GeneralisedAlpha()],
    ids=lambda each: type(each).__name__,
)
def test_a_dashpot_is_of_second_order_wherever_in_a_step_it_is_touched(law, integrator):
    coarse, fine = worst(law, integrator, 2e-5), worst(law, integrator, 2.5e-6)
    assert fine < 2e-6
    assert math.log(coarse / fine) / math.log(8.0) > 1.8
