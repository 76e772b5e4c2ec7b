"""Arrays of a model or an integrator that do not fit are refused: compiled code would read beyond their ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from impactlab.contact.penalty import Penalty
from impactlab.errors import PairingError
from impactlab.integrators.base import AbstractIntegrator, Step
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractDiscreteModel, AbstractRodModel, Face, Operators
from impactlab.models.finite_element import FiniteElement
from impactlab.scene import Contact, ElasticBody, End, Mass, Point, Rod, Segment, WaveBody
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import driver
from impactlab.simulate.planning.model_shapes import ARRAYS, OPTIONAL
from impactlab.testing.scenes import simulation
from impactlab.types import Array, Quantity

ELEMENTS = 12
ROD = Rod("rod", (Segment(0.3, 9e-4, 2.1e11, 7900.0),), End("free"), End("clamped"))
Changed = Callable[[Any], Any]


def same(value: Any) -> Any:
    return value


@dataclass(frozen=True)
class AnyModel(AbstractRodModel):
    """Bars whose arrays are changed before they are given."""

    name: str = "none"
    change: Changed = field(default=same)

    def element_length(self, body: ElasticBody) -> float:
        return body.length / ELEMENTS

    def build(self, rod: WaveBody, gravity: float, faces: tuple[Face, ...] = ()) -> AbstractDiscreteModel:
        return AnyBody(FiniteElement(ELEMENTS, "lumped").build(rod, gravity, faces), self.name, self.change)


@dataclass(frozen=True)
class AnyBody(AbstractDiscreteModel):
    mesh: AbstractDiscreteModel
    name: str
    change: Changed

    def operators(self) -> Operators:
        found = self.mesh.operators()
        if self.name not in Operators._fields:
            return found._replace(momentum=None)
        return found._replace(**{self.name: self.change(getattr(found, self.name))})

    def row(self, x: float, quantity: Quantity) -> Array:
        found = self.mesh.row(x, quantity)
        return self.change(found) if self.name == "row" else found

    def momentum_row(self) -> Array:
        found = self.mesh.momentum_row()
        return self.change(found) if self.name == "momentum_row" else found

    def grid(self) -> Array:
        return self.mesh.grid()


@dataclass(frozen=True)
class AnyIntegrator(AbstractIntegrator):
    """Newmark's method whose step is changed before it is given."""

    change: Changed = field(default=same)

    order = 2
    gains_energy = 0.05

    def step(self, system: Operators, dt: float) -> Step:
        return self.change(Newmark().step(system, dt))


def scene(model: AbstractRodModel, integrator: AbstractIntegrator) -> Simulation:
    contact = Contact(Point("hammer", 0.0, "hammer"), Point("rod", 0.0, "rod.left"), 0.0)
    bodies = {"hammer": Mass("hammer", 2.0, 1.0), "rod": ROD}
    return simulation("shapes", bodies, (contact,), 2e-4, integrator, StepRule(dt=2e-6), model=model, law=Penalty(1e8))


def message(made: Simulation) -> str:
    with pytest.raises(PairingError) as raised:
        driver.run(*made)
    return raised.value.text


def shorter(array: Array) -> Array:
    return array[..., :-1]


def longer(array: Array) -> Array:
    return np.concatenate((array, array[..., :1]), axis=-1)


def test_a_model_whose_arrays_fit_runs_as_the_mesh_does() -> None:
    found = [
        driver.run(*scene(model, Newmark())).contacts[0].impulse
        for model in (AnyModel(), FiniteElement(ELEMENTS, "lumped"))
    ]
    assert found[0] == pytest.approx(found[1], rel=1e-9)


@pytest.mark.parametrize("change", [shorter, longer])
@pytest.mark.parametrize("name", sorted({*ARRAYS} - OPTIONAL))
def test_operators_of_another_length_are_refused(name: str, change: Changed) -> None:
    text = message(scene(AnyModel(name, change), Newmark()))
    assert "in the operators of 'rod' has the shape" in text
    assert "Allowed: (" in text


@pytest.mark.parametrize(
    ("change", "shown"),
    [(np.ndarray.tolist, "a list"), (lambda array: array.astype("float32"), "an array of float32")],
)
def test_operators_that_are_no_arrays_of_floats_are_refused(change: Changed, shown: str) -> None:
    text = message(scene(AnyModel("velocity", change), Newmark()))
    assert text == f"`velocity` in the operators of 'rod' is {shown}, and must be an array of floats"


@pytest.mark.parametrize(
    ("method", "change", "given"),
    [
        ("row", shorter, f"the shape ({ELEMENTS - 1},)"),
        ("row", np.ndarray.tolist, "a list"),
        ("row", lambda _row: None, "None"),
        ("momentum_row", longer, f"the shape ({ELEMENTS + 1},)"),
    ],
)
def test_a_row_of_another_length_is_refused(method: str, change: Changed, given: str) -> None:
    text = message(scene(AnyModel(method, change), Newmark()))
    assert text.startswith(
        f"`{method}` of the model of 'rod' returned {given}, and the body has {ELEMENTS} coordinates"
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda step: step._replace(state=shorter(step.state[: 2 * (step.state.size // 3)])), "a state of"),
        (lambda step: step._replace(load=slice(step.load.start, step.load.start)), "its load at the parameters"),
        (lambda step: step._replace(load=slice(10**6, 10**6 + 100)), "its load at the parameters"),
    ],
)
def test_a_step_that_is_too_short_for_its_body_is_refused(change: Changed, words: str) -> None:
    text = message(scene(FiniteElement(ELEMENTS), AnyIntegrator(change)))
    assert f"returned {words}" in text
    assert "Allowed: at least" in text
