"""Between records several steps apart, beads move along cubics of their velocities, and forces follow by the law."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import impactlab as il
from impactlab.metrics.norms import midpoints
from impactlab.numerics.interpolation import between, cubic, turning_points
from impactlab.refine.errors.raw_records import records_of

STIFFNESS = 7.7e9  # N/m^1.5
POINTS = 4001


def chain(records: int, dt: float = 2e-7, beads: int = 30, gap: float = 0.0, law: str = "hertz", **last: object):
    """Return a run of a bead of 4 g at 1 m/s that strikes equal ones, against a wall with the law ``last``."""
    bodies = {"striker": il.Mass(4e-3, velocity=1.0), "bead": il.Mass(4e-3, repeat=beads)}
    contacts = [il.Chain(["striker", "bead"], {"kind": law, "stiffness": STIFFNESS}, gap=gap)]
    if last:
        bodies["wall"] = il.Wall()
        contacts.append(il.Contact(f"bead_{beads - 1}", "wall", last))
    solve = {"duration": 4e-4, "integrator": {"kind": "central_difference"}, "step": {"dt": dt}, "records": records}
    return il.run(il.Case(bodies=bodies, contacts=contacts, solve=solve))


def error(history, fine, channel: str) -> float:
    """Return the largest difference of a channel, over its largest value."""
    t = midpoints(history.duration, POINTS)
    wanted = fine.evaluate(t, channel)
    return float(np.max(np.abs(history.evaluate(t, channel) - wanted)) / np.max(np.abs(wanted)))


@given(coefficients=st.lists(st.floats(-2.0, 2.0), min_size=4, max_size=4), seed=st.integers(0, 99))
def test_a_cubic_is_read_and_turned_without_error(coefficients: list[float], seed: int) -> None:
    instants = np.cumsum(np.random.default_rng(seed).uniform(0.1, 1.0, 6))
    curve = np.polynomial.Polynomial(coefficients)
    values, rates, t = curve(instants), curve.deriv()(instants), np.linspace(instants[0], instants[-1], 301)
    np.testing.assert_allclose(cubic(between(t, instants), values, rates), curve(t), rtol=0.0, atol=1e-10)
    np.testing.assert_array_equal(cubic(between(instants, instants), values, rates), values)
    extreme = cubic(between(np.append(instants, turning_points(instants, values, rates)), instants), values, rates)
    assert extreme.min() <= curve(t).min() + 1e-10
    assert extreme.max() >= curve(t).max() - 1e-10


def test_the_error_of_a_cubic_is_of_the_fourth_order() -> None:
    """|error| <= D h^4/384 with D the fourth derivative, here that of a sine: 1."""
    for count in (8, 16, 32):
        instants = np.linspace(0.0, 2.0, count + 1)
        t = np.linspace(0.0, 2.0, 2001)
        found = cubic(between(t, instants), np.sin(instants), np.cos(instants))
        bound = (2.0 / count) ** 4 / 384.0
        assert 0.8 * bound < np.max(np.abs(found - np.sin(t))) < bound


@pytest.mark.parametrize(("channel", "factor"), [("position:bead_12", 9.0), ("gap:bead_12|bead_13", 9.0),
                                                 ("force:bead_12|bead_13", 7.0)])  # fmt: skip
def test_twice_the_records_lower_the_error_by_the_fourth_order(channel: str, factor: float) -> None:
    """16 times in the limit; the wave of five beads is still coarse in 100 records, and Hertz's force has an edge."""
    step = 2.5e-8  # s: lines between the steps of the fine run err by much less than cubics between 100 records
    fine = chain(100_000, step)
    coarse, finer = (error(chain(records, step), fine, channel) for records in (100, 200))
    assert finer * factor < coarse < 0.01


def test_beads_are_a_tenth_as_far_off_as_lines_between_records() -> None:
    fine, few = chain(100_000), chain(100)
    t = midpoints(fine.duration, POINTS)
    for bead in ("striker", "bead_3", "bead_20"):
        recorded = few.recorded[f"position:{bead}"]
        exact = fine.evaluate(t, f"position:{bead}")
        lines = np.max(np.abs(np.interp(t, recorded.times, recorded.values) - exact))
        assert np.max(np.abs(few.evaluate(t, f"position:{bead}") - exact)) < 0.1 * lines


@pytest.mark.parametrize("gap", [0.0, 1e-7])
def test_forces_do_not_pull_and_vanish_where_a_contact_is_open(gap: float) -> None:
    few = chain(100, gap=gap)
    apart = 2.0 * float(np.max(np.diff(few.recorded["position:striker"].times)))
    t = np.linspace(0.0, few.duration, POINTS)
    for contact in few.scene.contacts:
        force, spans = few.evaluate(t, f"force:{contact.name}"), few.spans(contact.name)
        assert force.min() >= 0.0
        open_ = np.all([(t < span.start - apart) | (t > span.until(few.duration) + apart) for span in spans], axis=0)
        assert not spans or np.count_nonzero(open_) > 0
        assert np.all(force[open_] == 0.0)
        assert all(force.max() <= 1.001 * max(span.peak_force for span in spans) for _ in spans[:1])


def test_an_impulse_leaves_lines_between_the_records_of_its_bead() -> None:
    """The velocity of the last bead jumps at the wall: no cubic of velocities is its motion there."""
    few = chain(100, beads=3, kind="velocity_complementarity", restitution=1.0)
    assert few.assembly.stride > 1
    assert few.spans("bead_2|wall")
    assert few.recorded["position:bead_2"].smooth is None
    assert few.recorded["force:bead_1|bead_2"].smooth is None
    assert few.recorded["position:bead_1"].smooth is not None
    t = np.linspace(0.0, few.duration, POINTS)
    assert few.evaluate(t, "gap:bead_2|wall").min() >= -1e-12


def test_extremes_of_few_records_are_those_of_all_steps() -> None:
    fine, few = chain(100_000), chain(100)
    for channel in ("gap:bead_12|bead_13", "force:bead_12|bead_13", "position:bead_12"):
        assert few.largest(channel) == pytest.approx(fine.largest(channel), rel=1e-3)


def test_channels_of_beads_are_read_at_once_as_each_alone() -> None:
    few = chain(100, beads=4)
    t = np.linspace(0.0, few.duration, 57)
    alone = np.array([few.evaluate(t, channel) for channel in few.channels()])
    np.testing.assert_array_equal(few.evaluate_each(t, few.channels()), alone)


def test_the_peak_of_a_contact_that_goes_on_is_that_at_the_end_of_the_run() -> None:
    """Lines between records nine steps apart gave 7 % at the front of the wave, where the run ends inside a step."""

    def peaks(dt: float, records: int) -> dict[str, float]:
        solve = {"duration": 4.401e-4, "integrator": {"kind": "central_difference"}, "step": {"dt": dt}}
        case = il.Case(
            bodies={"striker": il.Mass(4.11e-3, velocity=1.0), "bead": il.Mass(4.11e-3, repeat=40)},
            contacts=[il.Chain(["striker", "bead"], {"kind": "hertz", "stiffness": 7.692e9})],
            solve={**solve, "records": records},
        )  # fmt: skip
        return {span.contact: span.peak_force for span in il.run(case).contacts if span.end is None}

    few, fine = peaks(5e-7, 100), peaks(3e-8, 20_000)
    assert set(few) == set(fine)
    large = [name for name in fine if fine[name] > 0.05 * max(fine.values())]
    assert len(large) > 3
    assert [few[name] for name in large] == pytest.approx([fine[name] for name in large], rel=0.013)


def test_error_estimates_read_beads_as_the_channels_do() -> None:
    few = chain(100)
    records = records_of(few)
    assert records is not None
    names = ["position:striker", "position:bead_3", "position:bead_20"]
    t = midpoints(few.duration, 700)
    np.testing.assert_allclose(records.displacements(names, 700), few.evaluate_each(t, names), rtol=1e-12, atol=1e-18)
    assert np.array_equal(chain(100_000).assembly.layout.rates_of([1, 2]), [-1, -1])


@pytest.mark.parametrize("records", [100, 100_000])
def test_the_smallest_gaps_are_those_of_the_channels(records: int) -> None:
    history = chain(records, beads=5, gap=1e-6, kind="penalty", stiffness=1e8)
    smallest = [history.smallest_gap(contact) for contact in history.scene.contacts]
    names = [f"gap:{contact.name}" for contact in history.scene.contacts]
    assert smallest == [history.recorded[name].values.min() for name in names]
    assert min(smallest) < 0.0
