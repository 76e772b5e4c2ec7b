"""Models of plugins: what has no coordinates is refused, another theory of waves has no reference of ours."""

from __future__ import annotations

import dataclasses
import sys
import types

import pytest

from impactlab import PairingError, PluginError
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.integrators.newmark import Newmark
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.plugins import MODELS, Entry, Registry
from impactlab.reference import content, find
from impactlab.scene import Contact, End, Mass, Point, Rayleigh, Rod, Scene, Segment, StepRule
from impactlab.simulate import run


@dataclasses.dataclass(frozen=True)
class Magic(Continuous):
    """A model that does not step."""


@dataclasses.dataclass(frozen=True)
class Lateral(FiniteElement):
    """Bars that stand for a rod with lateral inertia."""

    theory = "love"


def scene(model, drag=0.0):
    rod = Rod(
        "rod",
        (Segment(0.3, 9e-4, 2.1e11, 7900.0),),
        End("free"),
        End("clamped"),
        model=model,
        damping=Rayleigh(drag, 0.0),
    )
    contact = Contact(Point("m", 0.0, "m"), Point("rod", 0.0, "rod.left"), 0.0, AdditionDeletion())
    bodies = {"m": Mass("m", 2.0, 1.0), "rod": rod}
    return Scene("x", bodies, (contact,), 1e-4, Newmark(), StepRule(dt=1e-6))


def test_a_model_without_steps_is_never_built_and_another_runs_in_its_place(monkeypatch):
    with pytest.raises(PairingError, match="model 'magic' of 'rod' says steps = False"):
        run(scene(Magic()))
    module = types.ModuleType("of_a_stranger")
    module.Magic = dataclasses.dataclass(frozen=True)(
        type("Magic", (Continuous,), {"__module__": "of_a_stranger", "__doc__": "A model that does not step."})
    )
    monkeypatch.setitem(sys.modules, "of_a_stranger", module)
    registry = Registry([Entry(MODELS.name, "magic", "of_a_stranger:Magic", "stranger")])
    with pytest.raises(PluginError, match="it says steps = False"):
        registry.load(MODELS, "magic")


def test_a_rod_of_another_theory_is_measured_against_st_venant():
    plain, lateral = scene(FiniteElement(20)), scene(Lateral(20))
    assert find(plain).name == "st_venant"
    assert find(lateral) is None
    assert content(plain) != content(lateral)


@pytest.mark.parametrize("model", [Modal(None, 2), Modal(None, 3), FiniteElement(3)])
def test_the_loss_of_a_damped_rod_is_booked_at_its_ends_where_it_has_two_coordinates(model):
    booked = run(scene(model, 2000.0)).energy.booked
    assert booked["ends"][-1] == 0.0
    assert booked["damping"][-1] > 0.0
