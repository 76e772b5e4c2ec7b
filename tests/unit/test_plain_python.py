"""The same source as plain Python: run in both modes (coverage sees inside with NUMBA_DISABLE_JIT=1)."""

from __future__ import annotations

import os

import pytest

from impactlab import metrics
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.penalty import Penalty
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.exact.solve import solve
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.numerics.addresses import COMPILED
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import run
from impactlab.testing.scenes import mass_on_rod

pytestmark = pytest.mark.nojit


def scene(
    model: AbstractRodModel, law: AbstractContactLaw, integrator: AbstractIntegrator, step: StepRule
) -> Simulation:
    return mass_on_rod(model, law, integrator, step, round_trips=1.9)


def test_the_mode_is_that_of_the_environment_variable() -> None:
    asked = os.environ.get("NUMBA_DISABLE_JIT", "0")
    assert (asked in ("", "0")) == COMPILED


@pytest.mark.parametrize(
    ("model", "law", "integrator", "step", "mass"),
    [
        (Modal(10, 10), WaveIdentification(), Newmark(), StepRule(points_per_period=10), 0.025),
        (FiniteElement(20, "lumped"), AdditionDeletion(), CentralDifference(), StepRule(courant=1.0), 0.002),
        (FiniteElement(20), Penalty(stiffness=4e10), Newmark(), StepRule(points_per_period=10), 0.03),
        (Modal(None, 10), ImpulseMomentum(1.0), ExactModal(), StepRule(points_per_period=10), 0.15),
    ],
)
def test_each_law_and_scheme_stays_near_the_exact_solution(
    model: AbstractRodModel, law: AbstractContactLaw, integrator: AbstractIntegrator, step: StepRule, mass: float
) -> None:
    case = scene(model, law, integrator, step)
    measured = metrics.errors(run(*case), "exact", solve(*case.but(law=AdditionDeletion())), case.scene)
    assert measured["mass_displacement"] < mass


def test_located_events() -> None:
    case = scene(Modal(None, 5), Penalty(stiffness=4e9), ExactModal(), StepRule(points_per_period=10))
    history = run(*case.but(events="located"))
    assert [event.kind for event in history.events] == ["close", "open"]
    assert history.energy.largest_gain < 1e-12
