"""A simulation with other settings: the same scene is kept, with all that was found of it; records are checked once."""

from __future__ import annotations

import pytest

from impactlab.contact.penalty import Penalty
from impactlab.errors import CaseError
from impactlab.integrators.newmark import Newmark
from impactlab.models.finite_element import FiniteElement
from impactlab.scene.method import StepRule
from impactlab.simulate.plan import prepare
from impactlab.testing.scenes import mass_on_rod


def test_a_scene_in_which_nothing_changes_is_kept() -> None:
    asked = mass_on_rod(FiniteElement(5), Penalty(), Newmark())
    scene = asked.scene
    assert asked.but(model=FiniteElement(7), step=StepRule(dt=1e-7), records=scene.records).scene is scene
    other = asked.but(records=scene.records + 1)
    assert other.scene is not scene
    assert other.scene.records == scene.records + 1
    assert other.method == asked.method


@pytest.mark.parametrize("step", [StepRule(dt=1e-8), StepRule(courant=1e-3), StepRule(points_per_period=2000.0)])
def test_records_beyond_the_memory_are_refused_by_every_rule_of_the_step(
    step: StepRule, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = mass_on_rod(FiniteElement(5), Penalty(), Newmark(), step, records=20_000)
    prepare(*asked)
    monkeypatch.setenv("IMPACTLAB_MEMORY", "1e6")
    with pytest.raises(CaseError, match="records of") as refused:
        prepare(*asked)
    assert refused.value.path == "solve.records"
