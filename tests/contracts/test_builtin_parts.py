"""Every part that impactlab registers keeps the contract of its kind; a part without a suite fails here."""

from __future__ import annotations

import pytest

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.penalty import Penalty
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.plugins import INTEGRATORS, LAWS, MODELS, Group, registry
from impactlab.testing.contracts import ContactLawContract, IntegratorContract, RodModelContract
from impactlab.types import Relative


class TestAdditionDeletion(ContactLawContract):
    part = AdditionDeletion()


class TestImpulseMomentum(ContactLawContract):
    part = ImpulseMomentum(0.5)


class TestPenalty(ContactLawContract):
    part = Penalty()


class TestDampedPenalty(ContactLawContract):
    part = Penalty(stiffness=Relative(3.0), damping=Relative(0.5))


class TestWaveIdentification(ContactLawContract):
    part = WaveIdentification()


class TestNewmark(IntegratorContract):
    part = Newmark()


class TestLinearAccelerationNewmark(IntegratorContract):
    part = Newmark(beta=1.0 / 6.0)


class TestCentralDifference(IntegratorContract):
    part = CentralDifference()


class TestExactModal(IntegratorContract):
    part = ExactModal()


class TestContinuous(RodModelContract):
    part = Continuous()


class TestConsistentFiniteElement(RodModelContract):
    part = FiniteElement(50)
    complete = True


class TestLumpedFiniteElement(RodModelContract):
    part = FiniteElement(50, "lumped")
    complete = True


class TestModalOfMesh(RodModelContract):
    part = Modal(60, 20)


class TestCompleteModalOfMesh(RodModelContract):
    part = Modal(40)
    complete = True
    frequency_error = 3e-3  # (k h)^2/24 of the third mode of 40 elements, 2.3e-3


class TestAnalyticModal(RodModelContract):
    part = Modal(None, 20)


SUITES = {LAWS: ContactLawContract, INTEGRATORS: IntegratorContract, MODELS: RodModelContract}


@pytest.mark.parametrize("group", list(SUITES), ids=lambda group: group.name)
def test_every_registered_part_has_a_suite(group: Group) -> None:
    ours = registry().only("impactlab")
    tested = {type(suite.part) for suite in SUITES[group].__subclasses__()}  # type: ignore[attr-defined]
    assert ours.names(group)
    assert {ours.load(group, name) for name in ours.names(group)} - tested == set()
