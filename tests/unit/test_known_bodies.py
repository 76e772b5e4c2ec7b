"""Bodies that a scene has in common with the one before it are not built again, and all others are."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
import pytest

from impactlab.bases.craig_bampton import CraigBampton
from impactlab.bases.eigenvectors import Eigenvectors
from impactlab.bases.macneal import Macneal
from impactlab.bases.ritz import Ritz
from impactlab.bases.striker_attached import StrikerAttached
from impactlab.bases.substructured import Substructured
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import Mass
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate.plan import Plan, prepare
from impactlab.testing.scenes import mass_on_rod

STEP = StepRule(dt=1e-7)


def struck(model: AbstractRodModel, mass: float = 1.0, velocity: float = 1.0) -> Simulation:
    """Return a mass on a rod."""
    asked = mass_on_rod(model, Penalty(stiffness=1e8), Newmark(), STEP)
    bodies: Mapping[str, object] = asked.scene.bodies
    struck_by = {name: Mass(name, mass, velocity) for name, body in bodies.items() if isinstance(body, Mass)}
    return asked.but(bodies={**bodies, **struck_by})


def after(known: Simulation, sought: Simulation) -> tuple[Plan, Plan]:
    """Return the plans of two runs, the second of which knows the first."""
    first = prepare(*known)
    return first, prepare(*sought, first.known_bodies)


def rod_of(plan: Plan) -> str:
    return next(iter(plan.scene.elastic))


@pytest.mark.parametrize(
    "model",
    [
        FiniteElement(8),
        FiniteElement(8, mass="lumped"),
        FiniteElement(8, mass="redistributed"),
        Modal(modes=5),
        *(Modal(16, 10, basis=basis) for basis in (Eigenvectors(), CraigBampton(), Macneal(), Ritz(), Substructured())),
    ],
)
@pytest.mark.parametrize("change", [{"velocity": 2.0}, {"mass": 3.0}])
def test_a_rod_that_another_mass_strikes_is_built_once(model: AbstractRodModel, change: dict[str, float]) -> None:
    first, second = after(struck(model), struck(model, **change))
    rod = rod_of(first)
    assert second.built[rod].system is first.built[rod].system
    assert second.steppers[rod] is first.steppers[rod]
    assert second.built[rod].body is second.scene.bodies[rod]
    fresh = prepare(*struck(model, **change))  # as if no run had been before
    for one, other in zip(second.steppers.values(), fresh.steppers.values(), strict=True):
        assert np.array_equal(one.parameters, other.parameters)
        assert np.array_equal(one.state, other.state)
        assert np.array_equal(one.force_response, other.force_response)


def test_a_basis_that_holds_the_mass_of_the_striker_is_built_for_each() -> None:
    model = Modal(8, 5, basis=StrikerAttached())
    first, second = after(struck(model), struck(model, mass=3.0))
    assert second.built[rod_of(first)].system is not first.built[rod_of(first)].system
    first, second = after(struck(model), struck(model, velocity=3.0))
    assert second.built[rod_of(first)].system is first.built[rod_of(first)].system


@pytest.mark.parametrize(
    ("known", "sought"),
    [
        (struck(FiniteElement(8)), struck(FiniteElement(9))),
        (struck(FiniteElement(8)), struck(FiniteElement(8)).but(gravity=9.81)),
        (struck(FiniteElement(8)), struck(FiniteElement(8)).but(duration=3.0)),
        (
            struck(Continuous(elements=8)).but(law=Hertz(1e9)),
            struck(Continuous(elements=8), velocity=2.0).but(law=Hertz(1e9)),
        ),
    ],
)
def test_bodies_of_another_description_are_built(known: Simulation, sought: Simulation) -> None:
    first, second = after(known, sought)
    assert second.built[rod_of(first)].system is not first.built[rod_of(first)].system


def test_another_step_takes_the_matrices_and_makes_its_own_steppers() -> None:
    known = struck(FiniteElement(8))
    sought = Simulation(known.scene, dataclasses.replace(known.method, step=StepRule(dt=2e-7)))
    first, second = after(known, sought)
    rod = rod_of(first)
    assert second.built[rod].system is first.built[rod].system
    assert second.steppers[rod] is not first.steppers[rod]
