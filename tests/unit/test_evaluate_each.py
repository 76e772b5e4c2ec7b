"""Several channels, and fields at several times, have the very values of each alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import impactlab as il
from impactlab.errors import ImpactlabError
from impactlab.numerics.interpolation import interpolated
from impactlab.numerics.slopes import slopes
from tests.support import CASES

RUNS = [  # a mesh, modes with a compliant law, a delay line, exact waves, links that pull, a chain, a mechanism
    ("axial_impact", "penalty"),
    ("rod_on_beam", ""),
    ("rounded_ends", ""),
    ("axial_impact", "continuous"),
    ("smith_pile", ""),
    ("granular/chain_between_rods", "newmark"),
    ("granular/tapered_chain", ""),  # beads, whose forces are smooth between records
    ("two_link_arm", ""),
]


@given(
    times=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12).map(sorted),
    rows=st.integers(1, 3),
    seed=st.integers(0, 99),
    others=st.lists(st.floats(-0.5, 1.5), max_size=8),
)
def test_rows_are_interpolated_as_each_alone(times: list[float], rows: int, seed: int, others: list[float]) -> None:
    at, t = np.array(times), np.array(times + others)
    values = np.random.default_rng(seed).normal(size=(rows, at.size))
    alone = np.array([np.interp(t, at, row) for row in values])
    np.testing.assert_array_equal(interpolated(t, at, values), alone)


def test_slopes_of_rows_are_those_of_each_alone() -> None:
    draw = np.random.default_rng(3)
    middles, means = np.cumsum(draw.uniform(0.1, 1.0, 9)), draw.normal(size=(5, 9))
    np.testing.assert_array_equal(slopes(middles, means), [slopes(middles, row) for row in means])


PIECES = [{"length": 0.1, "area": 1e-4, "material": "steel"}, {"length": 0.2, "area": 2e-4, "material": "brass"}]


@pytest.mark.parametrize("step", [{}, {"step": {"dt": "0.4 us"}}], ids=["exact", "delays"])
@pytest.mark.parametrize("rod", [il.Rod(**PIECES[0]), il.Rod(segments=PIECES)], ids=["uniform", "chain"])
def test_fields_at_many_times_are_those_of_each_time(rod: dict[str, Any], step: dict[str, Any]) -> None:
    contact = il.Contact("hammer", "rod.left", {"kind": "penalty", "stiffness": 1e8})
    solve = {"duration": "0.1 ms", "model": {"kind": "continuous"}, **step}
    history = il.run(
        il.Case(bodies={"hammer": il.Mass(0.2, velocity=1.0), "rod": rod}, contacts=[contact], solve=solve)
    )
    times = np.linspace(0.0, history.duration, 60)
    for quantity in ("displacement", "stress"):
        for x in (None, [0.0, 0.03, 0.1]):
            found, each = (
                history.fields_at("rod", times, quantity, x),
                [history.field("rod", t, quantity, x) for t in times],
            )
            np.testing.assert_array_equal(found.values, [one.values for one in each])
            np.testing.assert_array_equal(found.x, each[0].x)
            assert np.ptp(found.values) > 0.0


@pytest.mark.parametrize(("name", "method"), RUNS)
@pytest.mark.parametrize("records", [None, 100])
def test_channels_are_read_at_once_as_each_alone(name: str, method: str, records: int | None) -> None:
    case = il.load_case(CASES / f"{name}.yaml")
    case = case.method(method) if method else case
    case = case if records is None else case.with_("solve.records", records)
    history = il.run(case)
    channels = history.channels()
    t = np.append(np.linspace(0.0, history.duration, 57), history.jumps(channels[0])[:9])
    alone = np.array([history.evaluate(t, channel) for channel in channels])
    np.testing.assert_array_equal(history.evaluate_each(t, channels), alone)
    assert np.ptp(alone) > 0.0


def test_a_channel_that_is_not_there_is_named() -> None:
    history = il.run(il.load_case(CASES / "axial_impact.yaml"))
    with pytest.raises(ImpactlabError, match="channel 'speed' was not recorded"):
        history.evaluate_each(np.zeros(1), [*history.channels(), "speed"])
