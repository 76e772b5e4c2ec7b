"""Runs that differ in their step alone: bodies, laws and checks of one set-up serve both, to the last bit."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from impactlab.contact.modal_messengers import ModalMessengers
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz, HuntCrossley
from impactlab.errors import CaseError
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.models.continuous import Continuous
from impactlab.models.modal import Modal
from impactlab.scene import Beam, Contact, End, Mass, Point, Rayleigh, Rod, Segment, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import driver, stepped_run
from impactlab.simulate.stepping.setup import restepped, retimed
from impactlab.testing.scenes import simulation
from tests.reference.beam_scenes import ball_on, square_bar

DT = 2e-6  # s
SEGMENT = square_bar(0.3)


def struck(law, stop=None, integrator=None):
    """Return a ball on the middle of a cantilever; with ``stop``, a wall behind its end."""
    beam = Beam("beam", (SEGMENT,), End("clamped"), End("free"))
    bodies = {"ball": Mass("ball", 0.05, 1.0), "beam": beam}
    contacts = [Contact(Point("ball", 0.0, "ball"), Point("beam", 0.15, "beam.at"), 0.0)]
    if stop is not None:
        bodies["wall"] = Wall("wall")
        contacts.append(Contact(Point("beam", 0.3, "beam.right"), Point("wall", 0.0, "wall"), stop))
    scene = simulation("beam", bodies, tuple(contacts), 1e-3, None, StepRule(dt=DT), law=law)
    return scene.but(models={"beam": Modal(modes=12)}, integrator=integrator or ExactModal())


def with_step(asked, dt, records=None):
    scene = asked.scene if records is None else dataclasses.replace(asked.scene, records=records)
    return Simulation(scene, dataclasses.replace(asked.method, step=StepRule(dt=dt)))


def arrays_of(asked):
    prepared = stepped_run.ready(*asked)
    return prepared.plan, prepared.kept()


@pytest.mark.parametrize("stop", [None, 1e-4])
@pytest.mark.parametrize("law", [Hertz(1e9), Penalty(stiffness=1e6)])
@pytest.mark.parametrize("dt", [0.381 * DT, 2.3 * DT])
def test_a_run_like_another_has_the_bits_of_its_own_set_up(law, stop, dt):
    known, sought = struck(law, stop), with_step(struck(law, stop), dt, 5000)
    driver.run(*known, with_warnings=False)
    sought = Simulation(dataclasses.replace(known.scene, records=5000), with_step(known, dt).method)
    assert retimed.serves(*arrays_of(known), *sought)
    check_bits(known, sought)


def check_bits(known, sought):
    """Check that a run like a known one has the bits of the run with a set-up of its own."""
    like = driver.run(*sought, with_warnings=False, like=known)
    alone = driver.run(*sought, with_warnings=False)
    assert like.method == alone.method
    assert like.warnings == alone.warnings
    t = np.linspace(0.0, like.duration, 997)
    assert like.channels() == alone.channels()
    for name in alone.channels():
        assert np.array_equal(like.evaluate(t, name), alone.evaluate(t, name)), name
    assert [event[:3] for event in like.events] == [event[:3] for event in alone.events]
    assert like.energy.largest_gain == alone.energy.largest_gain
    assert like.dt == alone.dt != known.method.step.dt


def test_parts_that_depend_on_the_step_are_set_up_again():
    """Another scheme, law, model or load has constants that no other step length rewrites."""
    known = struck(Hertz(1e9))
    driver.run(*known, with_warnings=False)
    made = arrays_of(known)
    finer = with_step(known, 0.4 * DT)
    assert retimed.serves(*made, *finer)
    for other in (
        finer.but(models={"beam": Modal(modes=13)}),
        finer.but(integrator=Newmark()),
        finer.but(law=Hertz(2e9)),
        finer.but(duration=2e-3),
        finer.but(step=StepRule(points_per_period=20.0)),
    ):
        assert not retimed.serves(*made, *other)
        assert driver.run(*other, with_warnings=False, like=known).method == other.method
    for other in (struck(Hertz(1e9), integrator=Newmark()), struck(ModalMessengers())):
        made = arrays_of(other)
        assert not retimed.serves(*made, *with_step(other, 0.4 * DT))


def two_rods():
    """Return two rods of different transits between a ball and a wall, under laws that a step does not change."""
    steel = Segment(length=0.3, area=1e-4, young=2.1e11, density=7850.0)
    left = Rod("left", (steel,), End("mass", 0.02), End("free"), velocity=1.0)
    right = Rod("right", (dataclasses.replace(steel, length=0.2),), End("free"), End("spring", 1e7))
    bodies = {"left": left, "right": right}
    contact = Contact(Point("left", 0.3, "left.right"), Point("right", 0.0, "right.left"), 0.0)
    law = HuntCrossley(1e9, restitution=0.7)
    scene = simulation("rods", bodies, (contact,), 4e-4, None, StepRule(dt=DT), law=law)
    return scene.but(models={"left": Continuous(), "right": Continuous()}, integrator=None)


def rod_on_beam():
    """Return a rod as a delay line on the modes of a beam, with a stop behind its end."""
    steel = Segment(length=0.1, area=1e-4, young=2.1e11, density=7850.0)
    rod = Rod("rod", (steel,), End("free"), End("free"), velocity=1.0)
    beam = Beam("beam", (SEGMENT,), End("clamped"), End("free"))
    contacts = (
        Contact(Point("rod", 0.1, "rod.right"), Point("beam", 0.15, "beam.at"), 0.0),
        Contact(Point("beam", 0.3, "beam.right"), Point("wall", 0.0, "wall"), 1e-5),
    )
    bodies = {"rod": rod, "beam": beam, "wall": Wall("wall")}
    scene = simulation("rod", bodies, contacts, 1e-3, None, StepRule(dt=DT), law=Hertz(1e9))
    return scene.but(models={"rod": Continuous(), "beam": Modal(modes=12)}, integrator=ExactModal())


def damped_beam():
    """Return a ball on a damped beam, whose modes Newmark's method steps."""
    beam = Beam("beam", (SEGMENT,), End("pinned"), End("pinned"), damping=Rayleigh(mass=100.0, stiffness=1e-7))
    scene = ball_on(beam, 0.15, Hertz(1e9), 1e-3, mass=0.05, dt=DT)
    return scene.but(models={"beam": Modal(modes=12)}, integrator=Newmark())


@pytest.mark.parametrize("make", [two_rods, rod_on_beam, damped_beam])
@pytest.mark.parametrize("dt", [0.381 * DT, 2.3 * DT])
def test_delay_lines_and_damped_modes_share_bodies_and_checks(make, dt):
    known = make()
    driver.run(*known, with_warnings=False, like=known)
    sought = Simulation(dataclasses.replace(known.scene, records=5000), with_step(known, dt).method)
    plan, arrays = arrays_of(known)
    assert retimed.is_alike(plan, arrays, *sought)
    assert not retimed.serves(plan, arrays, *sought)
    other = restepped.restepped(plan, *sought)
    assert other is not None
    assert all(other.built[name] is body for name, body in plan.built.items())
    check_bits(known, sought)


def test_a_step_that_is_too_long_has_the_error_of_its_own_set_up():
    known = two_rods()
    driver.run(*known, with_warnings=False, like=known)
    sought = with_step(known, 1.01 * 0.2 / (2.1e11 / 7850.0) ** 0.5)
    with pytest.raises(CaseError) as like:
        driver.run(*sought, with_warnings=False, like=known)
    with pytest.raises(CaseError) as alone:
        driver.run(*sought, with_warnings=False)
    assert str(like.value) == str(alone.value)
