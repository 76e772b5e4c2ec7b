"""Every part that impactlab registers keeps the contract of its kind, with each of its ``examples``, and is measured.

Nothing is listed here: what stands in an entry-point group is tested, by the same check as `impactlab plugins --check`.
"""

from __future__ import annotations

import numpy as np
import pytest

from impactlab.models.base import AbstractRodModel
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.plugins import GROUPS, registry
from impactlab.testing import measures
from impactlab.testing.contracts import SUITES, RodModelContract
from impactlab.testing.measures import MEASURES
from impactlab.testing.verdict import options_to_try, verdict, word

OURS = registry().only("impactlab")
NAMES = [f"{word(group)}:{name}" for group in SUITES for name in OURS.names(group)]
COMPLETE = [FiniteElement(**options) for options in options_to_try(FiniteElement)]


@pytest.mark.parametrize("name", NAMES)
def test_every_part_passes_with_all_its_figures(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measures, "REPEATS", 1)  # of timed runs, whose times are not looked at
    result = verdict(name, registry())
    wrong = {one.text: (one.options, one.reason) for one in result.properties if one.reason}
    assert wrong | {one.name: one.remark for one in result.measured if not one.ok} == {}
    assert result.distribution == "impactlab"
    function = name.startswith(("metric:", "quantity:"))  # whose value is its figure
    assert len(result.properties) >= (4 if function else 8)
    assert function or result.measured
    assert all(one.value is None or np.isfinite(one.value) for one in result.measured)


@pytest.mark.parametrize("model", [*COMPLETE, Modal(60)], ids=str)
def test_nothing_is_left_out_of_a_complete_model(model: AbstractRodModel) -> None:
    suite = type("Suite", (RodModelContract,), {"part": model, "complete": True})()
    suite.test_nothing_is_left_out_of_a_complete_model()


def test_every_kind_of_part_has_a_suite_is_measured_and_gives_options_to_test_it_with() -> None:
    assert {group for group in GROUPS if OURS.names(group)} <= set(SUITES)
    classes = {group for group in SUITES if not group.arguments}
    assert set(MEASURES) == classes
    for group in classes:
        for name in OURS.names(group):
            assert OURS.load(group, name).examples, name
