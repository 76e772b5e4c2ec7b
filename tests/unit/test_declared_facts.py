"""Facts that a part declares about itself: the contract suites find those that do not hold."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from impactlab.contact.base import AbstractContactLaw
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.newmark import Newmark
from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.testing.contracts import ContactLawContract, IntegratorContract, RodModelContract
from impactlab.testing.contracts.common import PIECE
from impactlab.types import Level, Port, Reply, Start

VELOCITIES = "test_its_velocities_belong_to_the_declared_point_of_the_step"
BEADS = "test_it_kicks_then_drifts_if_declared"


def suite(contract: type[Any], part: object) -> Any:
    """Return the contract suite of a part."""
    return type("Suite", (contract,), {"part": part})()


@pytest.mark.parametrize(
    ("kind", "fact", "value", "property_", "text"),
    [
        (CentralDifference, "velocity_point", 1.0, VELOCITIES, "the velocity after a step is that at 0.5 of it"),
        (Newmark, "velocity_point", 0.5, VELOCITIES, "the velocity after a step is that at 1 of it"),
        (Newmark, "kicks_then_drifts", True, BEADS, r"is not v \+= dt F/m, then u \+= dt v"),
        (Newmark, "load_point", 0.0, "test_its_order_is_the_declared_one", "measured order 1"),
    ],
)
def test_a_scheme_with_a_false_fact_passed_its_check(monkeypatch, kind, fact, value, property_, text):
    monkeypatch.setattr(kind, fact, value)
    with pytest.raises(AssertionError, match=text):
        getattr(suite(IntegratorContract, kind()), property_)()


def test_a_scheme_of_first_order_with_a_false_load_point_passed_its_check(monkeypatch):
    """Its runs lost 0.4 % of their energy without a reason."""
    monkeypatch.setattr(CentralDifference, "order", 1)
    monkeypatch.setattr(CentralDifference, "load_point", 0.5)
    with pytest.raises(AssertionError, match=r"with load_point = 0\.5, and nothing with 0"):
        suite(IntegratorContract, CentralDifference()).test_a_force_adds_no_more_than_its_work()


@dataclasses.dataclass(frozen=True)
class Creeping(AbstractContactLaw):
    """A spring and a dashpot in series, whose force depends on the time in contact."""

    needs = frozenset({Level.POSITION})
    smooth = True

    def begin(self, left: Any, right: Any, dt: float) -> Start:
        return Start(memory=(0.0,))

    def spring(self, left: Any, right: Any, dt: float) -> tuple[float, float]:
        return 1e8, 0.0

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        reply.trial = 1e8 * (-port.gap - port.memory[0]) / (1.0 + 0.5e4 * port.dt)
        reply.memory[0] = port.memory[0] + 1e-4 * reply.trial * port.dt


@pytest.mark.parametrize(
    ("property_", "text"),
    [
        ("test_a_smooth_force_is_that_of_an_instant_if_declared", "smooth: the change of its force"),
        ("test_its_spring_is_its_reply", "less that of its `spring`, 1e.08 N/m and 0 N s/m, is"),
    ],
)
def test_a_law_with_memory_that_declared_a_smooth_force_or_a_spring_passed_its_check(property_, text):
    """Adaptive and exact runs would be those of another law."""
    with pytest.raises(AssertionError, match=text):
        getattr(suite(ContactLawContract, Creeping()), property_)()


class Careless(AbstractRodModel):
    """A rod that does not turn where it should, and that depends on its partner."""

    serves_rotation = True
    reads_partners = False

    def element_length(self, body: Any) -> float:
        return float(body.length / 20)

    def build(self, rod: Any, gravity: float, faces: Any = ()) -> Any:
        finer = any(face.partner_mass > 2.0 * PIECE.mass for face in faces)
        return FiniteElement(30 if finer else 20).build(dataclasses.replace(rod, rotation=None), gravity)


@pytest.mark.parametrize(
    ("property_", "text"),
    [
        ("test_a_rod_that_turns_is_softened_if_declared", "serves_rotation: the error of the first squared"),
        ("test_it_is_the_same_for_any_partner_if_declared", "reads_partners is False, but .* its mass differs"),
    ],
)
def test_a_model_with_a_false_fact_passed_its_check(property_, text):
    with pytest.raises(AssertionError, match=text):
        getattr(suite(RodModelContract, Careless()), property_)()
