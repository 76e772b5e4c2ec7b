"""Runs with a tolerance beside independent programs: none is beyond its tolerance in silence."""

from __future__ import annotations

import pytest

from studies.audit import families, measure, scenes, summary


@pytest.mark.slow
@pytest.mark.parametrize("family", list(families.FAMILIES))
def test_no_run_is_beyond_its_tolerance_in_silence(family: str) -> None:
    rows = [measure.measured(families.draw(family, 22, number)) for number in range(12)]
    known = [row for row in rows if str(row["known"]) == "1"]
    assert len(known) >= 6
    assert not [row["number"] for row in known if summary.is_beyond(row) and not summary.is_warned(row)]


# A force that rises at the end of the run, one that a jump on its way lets be read at its steepest, long contacts.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("family", "number"),
    [("power_law", 98), ("damped", 107), ("rigid", 38), ("dashpot", 44), ("dashpot", 53)],
)
def test_no_peak_read_where_the_force_is_steep_is_beyond_its_tolerance(family: str, number: int) -> None:
    row = measure.measured(families.draw(family, 20261122, number))
    assert str(row["known"]) == "1"
    assert not summary.is_beyond(row)


@pytest.mark.slow
def test_no_dashpot_that_touches_inside_a_step_is_beyond_its_tolerance() -> None:
    rows = [measure.measured(drawn) for drawn in list(scenes.scan())[::10]]
    assert not [row["number"] for row in rows if summary.is_beyond(row)]
