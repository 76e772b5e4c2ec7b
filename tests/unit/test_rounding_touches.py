"""Touches by rounding in a row are read as one, and leave what a run finds as it is."""

from __future__ import annotations

import numpy as np
import pytest

import impactlab as il
from impactlab.numerics.records import dtype_of
from impactlab.simulate.stepping.arrays import EventRecord
from impactlab.simulate.stepping.event_times import CLOSE, IMPULSE, OPEN
from impactlab.simulate.stepping.results import rounding_touches

SHARE = 1e-11  # of the largest force and impulse: a touch below it is rounding


def events_of(*rows: tuple[float, int, int, float, float]) -> np.ndarray:
    """Return events from times, contacts, kinds, impulses and peaks of the period that ends."""
    found = np.zeros(len(rows), dtype_of(EventRecord))
    for place, (time, contact, kind, impulse, peak) in enumerate(rows):
        found[place] = time, contact, kind, 0.0, impulse, peak
    return found


def touch(start: float, end: float, contact: int, impulse: float, peak: float) -> list[tuple]:
    return [(start, contact, CLOSE, 0.0, 0.0), (end, contact, OPEN, impulse, peak)]


def test_touches_by_rounding_in_a_row_become_one() -> None:
    small = [event for k in range(1, 5) for event in touch(0.1 * k, 0.1 * k + 0.05, 0, 1e-13, 1e-12 * k)]
    rows = events_of(*touch(0.0, 0.05, 0, 1.0, 2.0), *small, *touch(0.6, 0.7, 0, 1.0, 2.0))
    found = rounding_touches.joined(rows, np.array([0]), SHARE, ())
    assert found["time"].tolist() == pytest.approx([0.0, 0.05, 0.1, 0.45, 0.6, 0.7])
    assert found["span_impulse"].tolist() == pytest.approx([0.0, 1.0, 0.0, 4e-13, 0.0, 1.0])
    assert found["span_peak"][3] == 4e-12


@pytest.mark.parametrize(
    ("second", "groups", "left_alone"),
    [
        (touch(0.3, 0.4, 0, 2e-11, 0.0), [0], ()),  # above the floor
        (touch(0.3, 0.6, 0, 1e-13, 0.0), [0], ()),  # no opening to the large one: both are one period
        (touch(0.3, 0.4, 1, 1e-13, 0.0), [0, 0], ()),  # of another contact
        ([(0.25, 0, IMPULSE, 0.0, 0.0), *touch(0.3, 0.4, 0, 1e-13, 0.0)], [0], ()),
        (touch(0.3, 0.4, 0, 1e-13, 0.0), [0], (0,)),
    ],
)
def test_others_stay(second: list[tuple], groups: list[int], left_alone: tuple[int, ...]) -> None:
    rows = events_of(*touch(0.1, 0.2, 0, 1e-13, 0.0), *second, *touch(0.6, 0.7, 0, 1.0, 2.0))
    found = rounding_touches.joined(rows, np.array(groups), SHARE, left_alone)
    np.testing.assert_array_equal(found, rows)


def test_the_largest_impulse_counts_among_bodies_that_interact() -> None:
    """Bodies of two groups know nothing of each other: small touches of one are not the rounding of the other."""
    small = [*touch(0.1, 0.2, 1, 1e-13, 1e-13), *touch(0.3, 0.4, 1, 1e-13, 1e-13)]
    rows = events_of(*touch(0.0, 0.05, 0, 1.0, 2.0), *small)
    assert len(rounding_touches.joined(rows, np.array([0, 0]), SHARE, ())) == 4
    assert len(rounding_touches.joined(rows, np.array([0, 1]), SHARE, ())) == 6


def test_a_chain_of_rods_that_rest_on_each_other_has_the_same_events(monkeypatch: pytest.MonkeyPatch) -> None:
    rod = {"length": 0.1, "diameter": "10 mm", "material": "steel"}
    case = il.Case(
        bodies={"striker": il.Rod(velocity=1.0, **rod), "rod": il.Rod(repeat=25, **rod)},
        contacts=[il.Chain(["striker", "rod"], {"kind": "addition_deletion"})],
        solve={
            "duration": "0.9 ms",
            "model": {"kind": "finite_element", "elements": 20, "mass": "lumped"},
            "integrator": {"kind": "central_difference"},
            "step": {"courant": 1.0},
        },
    )
    monkeypatch.setattr(rounding_touches, "MIN_EVENTS", 2)
    history = il.run(case)
    raw = sum(len(each) for each in history._raw)
    assert raw > 4 * len(rounding_touches.events_of(history.assembly, history._raw, history.duration, ()))
    monkeypatch.setattr(rounding_touches, "MIN_EVENTS", 10**9)
    alone = il.run(case)
    assert history.events == alone.events
    assert len(history.contacts) == len(alone.contacts) > 20
    for one, other in zip(history.contacts, alone.contacts, strict=True):
        assert one == other._replace(impulse=pytest.approx(other.impulse, rel=1e-12))
