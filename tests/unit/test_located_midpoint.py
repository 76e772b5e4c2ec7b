"""Located events on finite elements with a consistent mass: the midpoint rule cuts its steps."""

from __future__ import annotations

import numpy as np
import pytest

from impactlab import simulate
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.penalty import Penalty
from impactlab.history import AbstractHistory
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import Rod
from impactlab.scene.method import StepRule
from impactlab.testing.scenes import CLAMPED, FREE, STEEL, mass_on_rod

ELEMENTS = 8
GAP = 1e-6  # at 1 m/s it closes after 1e-6 s
SPRING = Penalty(0.5 * STEEL.young * STEEL.area * ELEMENTS / STEEL.length)


def struck(
    law: AbstractContactLaw,
    steps: int,
    model: AbstractRodModel | None = None,
    integrator: AbstractIntegrator | None = None,
) -> AbstractHistory:
    step = StepRule(dt=2.5 * 2.0 * STEEL.length / STEEL.wave_speed / steps)
    model, integrator = model or FiniteElement(ELEMENTS), integrator or Midpoint()
    return simulate.run(*mass_on_rod(model, law, integrator, step, gap=GAP, round_trips=2.5, events="located"))


def first_kick(restitution: float) -> float:
    """(1 + e) v0/(1/M + b M^-1 b) of the mass and the mesh."""
    model = FiniteElement(ELEMENTS).build(Rod("rod", (STEEL,), FREE, CLAMPED), 0.0)
    system = model.operators()
    mass = np.diag(system.mass[0]) + np.diag(system.mass[1, :-1], 1) + np.diag(system.mass[1, :-1], -1)
    return (1.0 + restitution) / (1.0 / STEEL.mass + float(np.linalg.inv(mass)[0, 0]))


def test_a_spring_closes_on_time_and_opens_as_the_exact_motion_of_the_mesh_does() -> None:
    exact = struck(SPRING, 4800, Modal(ELEMENTS), ExactModal()).events[1].time
    errors = []
    for steps in (300, 1200):
        history = struck(SPRING, steps)
        assert [event.kind for event in history.events] == ["close", "open"]
        # Free flight at constant velocity: the root is found to 1e-13 of a step.
        assert history.events[0].time == pytest.approx(GAP, rel=1e-11)
        # Steps of any length conserve; 1200 of them, each rounded a few times.
        assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12
        errors.append(abs(history.events[1].time - exact))
    # Second order: sixteen times less; the root moves with the phase of the last step.
    assert errors[0] > 8.0 * errors[1]


def test_a_constraint_closes_by_the_exact_impulse_and_gains_nothing() -> None:
    history = struck(AdditionDeletion(), 300)
    close, impulse = history.events[:2]
    assert (close.kind, impulse.kind) == ("close", "impulse")
    assert close.time == pytest.approx(GAP, rel=1e-11)
    # The inverse of a well-conditioned mass of nine rows.
    assert impulse.impulse == pytest.approx(first_kick(0.0), rel=1e-12)
    assert history.energy.largest_gain < 1e-12


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_kicks_fall_on_the_touch_and_keep_the_energy_that_they_do_not_book(restitution: float) -> None:
    history = struck(ImpulseMomentum(restitution), 300)
    assert history.events[0].time == pytest.approx(GAP, rel=1e-11)
    assert history.events[0].impulse == pytest.approx(first_kick(restitution), rel=1e-12)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12
