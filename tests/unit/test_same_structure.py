"""Arrays of a scene that differs in numbers are those of the scene before with its own numbers, and of others new."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz, HuntCrossley
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.newmark import Newmark
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.numerics.addresses import COMPILED
from impactlab.scene import Contact, Mass, Point, Probe, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate.plan import prepare
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.simulate.stepping.setup.same_structure import renumbered
from impactlab.testing.scenes import mass_on_rod

MESHES = (
    (FiniteElement(20, mass="lumped"), CentralDifference()),
    (FiniteElement(8), Newmark()),
    (Modal(modes=6), ExactModal()),
)
pytestmark = pytest.mark.skipif(not COMPILED, reason="only compiled arrays are kept")


def struck(model: Any = MESHES[1][0], scheme: Any = MESHES[1][1], **changes: Any) -> Simulation:
    """Return a mass on a rod, with a wall behind another mass that the rod may reach."""
    asked = mass_on_rod(model, Penalty(stiffness=1e8), scheme, StepRule(dt=1e-7))
    contact = asked.scene.contacts[0]
    (mass,) = (body for body in asked.scene.bodies.values() if isinstance(body, Mass))
    rod = next(iter(asked.scene.elastic.values()))
    stop = Contact(
        Point(rod.name, rod.length, f"{rod.name}.right"), Point("stop", 0.0, "stop"), changes.pop("gap", 1e-6)
    )
    bodies = {**asked.scene.bodies, mass.name: Mass(mass.name, changes.pop("mass", 1.0), changes.pop("velocity", 1.0))}
    bodies |= {"stop": Wall("stop")}
    law = changes.pop("law", Penalty(stiffness=1e8))
    asked = asked.but(bodies=bodies, contacts=(contact, stop), **changes)
    return asked.but(law=law)


def made(sought: Simulation, before: Simulation) -> tuple[Assembly, Assembly | None]:
    """Return the arrays of a scene as a new session makes them, and those made from the arrays of another one."""
    first = prepare(*before)
    plan = prepare(*sought, first.known_bodies)
    assert first.integrator is not None
    assert first.dt is not None
    assert plan.integrator is not None
    assert plan.dt is not None
    known = Assembly(first, first.integrator, first.dt)
    held = [np.asarray(each).tobytes() for each in known.memory]
    found = renumbered(known, plan, plan.integrator, plan.dt)
    assert [np.asarray(each).tobytes() for each in known.memory] == held
    return Assembly(plan, plan.integrator, plan.dt), found


@pytest.mark.parametrize(("model", "scheme"), MESHES)
@pytest.mark.parametrize(
    "change",
    [{"mass": 3.0}, {"velocity": 2.0}, {"gap": 2e-6}, {"law": Penalty(stiffness=2e8)}, {"records": 100}],
    ids=lambda change: next(iter(change)),
)
def test_numbers_of_another_scene_are_written_into_the_arrays_before(model: Any, scheme: Any, change: Any) -> None:
    own, found = made(struck(model, scheme, **change), struck(model, scheme))
    assert found is not None
    for name, one, other in zip(own.memory._fields, own.memory, found.memory, strict=True):
        assert np.asarray(one).tobytes() == np.asarray(other).tobytes(), name
    by_name = ("dt", "steps", "stride", "sample_stride", "can_repeat", "shown")
    assert [getattr(own, name) for name in by_name] == [getattr(found, name) for name in by_name]
    assert found.layout.sources == own.layout.sources


def with_probe(asked: Simulation) -> Simulation:
    return asked.but(probes=(Probe(next(iter(asked.scene.elastic)), 0.0, "displacement"),))


def with_readings(asked: Simulation) -> Simulation:
    return asked.but(contacts=asked.scene.contacts[:1]).but(law=WaveIdentification())


@pytest.mark.parametrize(
    "other",
    [
        struck(FiniteElement(9)),
        struck(law=Hertz(1e9)).but(law=HuntCrossley(1e9)),
        struck(scheme=Midpoint()),
        Simulation(struck().scene, dataclasses.replace(struck(scheme=Midpoint()).method, events="located")),
        with_probe(struck()),
        struck(snapshots=(1e-6,)),
        with_readings(struck(mass=2.0)),
        struck().but(contacts=struck().scene.contacts[:1]),
    ],
    ids=["elements", "law", "scheme", "located", "probe", "snapshots", "readings", "contacts"],
)
def test_another_structure_has_new_arrays(other: Simulation) -> None:
    law = next(iter(other.method.laws.values()))
    _, found = made(other, with_readings(struck()) if isinstance(law, WaveIdentification) else struck())
    assert found is None
