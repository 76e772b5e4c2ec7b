"""Models of plugins: a continuous one runs as it is, another theory of waves has no reference of ours."""

from __future__ import annotations

import dataclasses

import pytest

from impactlab import PairingError
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.penalty import Penalty
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.continuous import Continuous
from impactlab.models.continuous.delay_line import DelayLine
from impactlab.models.finite_element import FiniteElement
from impactlab.refine.references.outlook import of, of_plain_run
from impactlab.refine.references.reference import find
from impactlab.refine.references.reference_record import physics_key
from impactlab.report.summary import summarise
from impactlab.scene import Segment
from impactlab.scene.method import Simulation, StepRule, is_exact
from impactlab.simulate.driver import run
from impactlab.simulate.stepping.results.history import RecordedHistory
from impactlab.testing.scenes import mass_on_rod
from impactlab.types import option

HARD = AdditionDeletion()


class FluidLine(DelayLine):
    """The delays of a plugin."""


@dataclasses.dataclass(frozen=True)
class Fluid(AbstractRodModel):
    """A column of fluid: waves in delays, its impedance a share of the rod's."""

    citations = ("StVenant1883",)

    stiffness: float = option(description="share of the rod's modulus and density, each")

    @property
    def has_mesh(self):
        return False

    def element_length(self, body):
        return body.length

    def build(self, rod, gravity, faces=()):
        share = self.stiffness
        pieces = tuple(
            dataclasses.replace(each, young=share * each.young, density=share * each.density) for each in rod.segments
        )
        return FluidLine(dataclasses.replace(rod, segments=pieces), gravity)


@dataclasses.dataclass(frozen=True)
class Lateral(FiniteElement):
    """Bars that stand for a rod with lateral inertia."""

    theory = "love"


def scene(model, law=HARD) -> Simulation:
    return mass_on_rod(model, law, Newmark(), StepRule(dt=1e-6), duration=1e-4)


def test_a_continuous_model_of_a_plugin_was_never_built_and_another_ran_in_its_place():
    history = run(*scene(Fluid(0.5), law=Penalty(1e7)))
    assert isinstance(history, RecordedHistory)
    assert isinstance(history.assembly.layout.built["rod"].model, FluidLine)
    assert not history.integrator_used
    hard = scene(Fluid(0.5))
    assert not is_exact(*hard)  # St Venant's solver does not stand in for it
    with pytest.raises(PairingError, match="gives impulses"):
        run(*hard)


def test_the_waves_of_a_continuous_model_of_a_plugin_are_its_own():
    struck, plain = scene(Fluid(0.25), law=Penalty(1e8)), scene(Continuous(), law=Penalty(1e8))
    thinner = dataclasses.replace(plain.scene.bodies["rod"], segments=(Segment(0.3, 9e-4, 2.1e11 / 4, 7900.0 / 4),))
    own = run(*struck.but(step=StepRule(dt=2e-7))).contacts[0]
    ours = run(*plain.but(bodies={**plain.scene.bodies, "rod": thinner}))
    # The same rod, once in delays by steps and once from event to event; a rod of the full impedance is hit harder.
    assert own.peak_force == pytest.approx(ours.contacts[0].peak_force, rel=1e-3)
    assert own.peak_force < 0.8 * run(*plain).contacts[0].peak_force


def test_a_rod_of_another_theory_is_measured_against_st_venant():
    plain, lateral = scene(FiniteElement(20)), scene(Lateral(20))
    assert find(*plain).name == "st_venant"
    assert find(*lateral) is None
    assert physics_key(*plain) != physics_key(*lateral)


@dataclasses.dataclass(frozen=True)
class Branded(Continuous):
    """The continuous rod under a name of its own."""

    steps = False


@dataclasses.dataclass(frozen=True)
class Softer(Continuous):
    """Continuous rods whose bodies it builds itself."""

    def build(self, rod, gravity, faces=()):
        pieces = tuple(dataclasses.replace(each, young=0.25 * each.young) for each in rod.segments)
        return FluidLine(dataclasses.replace(rod, segments=pieces), gravity)


@dataclasses.dataclass(frozen=True)
class Love(Continuous):
    theory = "love"


def test_a_subclass_of_continuous_that_changes_nothing_is_solved_and_measured_as_it_is():
    struck = scene(Branded())
    history = run(*struck)
    assert history.dt is None
    reference, told = of_plain_run(*struck, history)
    assert told.status == "exact"
    found = summarise("branded", history, reference, told)
    assert found["errors"]["mass_displacement"] == pytest.approx(0.0, abs=1e-12)
    assert found["method"]["models"]["rod"]["kind"] == "branded"


def test_a_subclass_of_continuous_that_builds_its_own_bodies_is_not_replaced_by_the_exact_solver():
    """St Venant's solver ran in its place, with an error of zero against itself."""
    struck = scene(Softer(), law=Penalty(1e8)).but(step=StepRule(dt=2e-7))
    assert not is_exact(*struck)
    history = run(*struck)
    assert isinstance(history.assembly.layout.built["rod"].model, FluidLine)
    assert history.contacts[0].peak_force < 0.9 * run(*scene(Continuous(), law=Penalty(1e8))).contacts[0].peak_force
    with pytest.raises(PairingError, match="gives impulses"):
        run(*scene(Softer()))


def test_a_subclass_of_continuous_with_another_theory_has_no_errors_and_the_reason():
    """The summary said that no reference converges."""
    assert not is_exact(*scene(Love()))
    struck = scene(Love(), law=Penalty(1e8)).but(step=StepRule(dt=2e-7))
    history = run(*struck)
    for reference, told in (of_plain_run(*struck, history), (find(*struck), of(None, struck.method))):
        assert reference is None
        assert told.text == "not measured: a model has the theory of waves 'love', and no reference is of it"
