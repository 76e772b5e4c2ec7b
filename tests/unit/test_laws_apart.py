"""Laws that are not evaluated while the faces of their contact stay apart (`zero_apart`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import HuntCrossley
from impactlab.contact.velocity_complementarity import VelocityComplementarity
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.newmark import Newmark
from impactlab.models.finite_element import FiniteElement
from impactlab.scene import Mass, Rod, Wall
from impactlab.scene.method import StepRule
from impactlab.simulate import run
from impactlab.testing.contracts import ContactLawContract
from impactlab.testing.scenes import FREE, STEEL, in_a_row
from impactlab.types import Level, Port, Reply, SideFacts, Start


@dataclass(frozen=True)
class Lingering(AbstractContactLaw):
    """A spring that presses with 1 N in the first step after the faces have parted."""

    needs = frozenset({Level.POSITION})
    zero_apart = True

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        return Start(memory=(0.0,))

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        touches = port.free_gap < 0.0
        reply.force = 1.0 if touches or port.memory[0] > 0.0 else 0.0
        reply.memory[0] = 1.0 if touches else 0.0


def test_a_law_that_acts_in_a_step_apart_may_not_declare_that_it_is_zero() -> None:
    suite = type("Suite", (ContactLawContract,), {"part": Lingering()})()
    with pytest.raises(AssertionError, match="acts on faces that are apart"):
        suite.test_apart_its_reply_is_zero_if_declared()


@pytest.mark.parametrize("integrator", [Newmark(), CentralDifference()], ids=["implicit", "explicit"])
@pytest.mark.parametrize(
    "law", [Penalty(1e8, 20.0), HuntCrossley(1e10, restitution=0.6), VelocityComplementarity(0.5)], ids=str
)
def test_results_are_those_of_laws_evaluated_in_every_step(
    law: AbstractContactLaw, integrator: Newmark | CentralDifference, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bit for bit, in a row whose contacts open and close again."""
    bodies = [Wall("left"), Mass("ball", 0.1, 2.0), Rod("rod", (STEEL,), FREE, FREE), Wall("right")]
    step, model = StepRule(dt=2e-7), FiniteElement(8, mass="lumped")
    scene = in_a_row(bodies, model, law, integrator, step, round_trips=20.0, gaps=1e-5)
    skipping = run(*scene)
    monkeypatch.setattr(type(law), "zero_apart", False)
    every = run(*scene)
    assert len(every.events) > 6
    assert skipping.events == every.events
    times = np.linspace(0.0, every.duration, 500)
    for channel in every.channels():
        assert np.array_equal(skipping.evaluate(times, channel), every.evaluate(times, channel)), channel
    assert np.array_equal(skipping.energy.stored, every.energy.stored)
