"""Every part that impactlab registers keeps the contract of its kind, with each of its ``examples``.

Nothing is listed here: what stands in an entry-point group is tested. FACTS holds what a suite should know beyond
that, one line each.
"""

from __future__ import annotations

from typing import Any

import pytest

from impactlab.plugins import GROUPS, METRICS, Group, registry
from impactlab.testing.contracts import SUITES, suite_of

OURS = registry().only("impactlab")
FACTS: dict[str, dict[str, Any]] = {  # by test class: the name of the part, then the number of its example
    "TestFiniteElement": {"complete": True},
    "TestFiniteElement1": {"complete": True},
    "TestFiniteElement2": {"complete": True, "frequency_error": 2e-2},  # h/L: the end element gave its mass away
    "TestFiniteElement3": {"complete": True},
    "TestFiniteElement4": {"complete": True},
    "TestModal3": {"frequency_error": 2e-2},
    "TestModal2": {"complete": True},
}


def camel(name: str) -> str:
    return "".join(word.capitalize() for word in name.split("_"))


def suites(group: Group) -> dict[str, type[Any]]:
    """Return a test class for each part of a group and each of its examples."""
    made = {}
    for name in OURS.names(group):
        kind: Any = OURS.load(group, name)
        if group is METRICS:  # functions, without options
            title = f"TestMetric{camel(name)}"
            made[title] = type(title, (suite_of(group, kind),), {"part": staticmethod(kind)})
            continue
        for number, options in enumerate(kind.examples):
            title = f"Test{camel(name)}{number or ''}"
            made[title] = type(title, (suite_of(group, kind),), {"part": kind(**options), **FACTS.get(title, {})})
    return made


for _group in SUITES:
    globals().update(suites(_group))


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.name)
def test_every_registered_part_has_a_suite(group: Group) -> None:
    names = OURS.names(group)
    assert group in SUITES or not names, f"write a suite for {group.name} in impactlab.testing.contracts"
    tested = {
        value.part if group is METRICS else type(value.part)
        for value in globals().values()
        if isinstance(value, type)
        and group in SUITES
        and any(issubclass(value, suite_of(group, OURS.load(group, name))) for name in names)
    }
    assert {OURS.load(group, name) for name in names} == tested


def test_every_part_gives_options_to_test_it_with() -> None:
    for group in SUITES.keys() - {METRICS}:
        for name in OURS.names(group):
            assert OURS.load(group, name).examples, name


def test_facts_are_about_parts_that_are_registered() -> None:
    assert set(FACTS) <= set(globals())
