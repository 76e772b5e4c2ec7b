"""The peak of an exact force is found also where it is a kink between the samples."""

from __future__ import annotations

import numpy as np
import pytest

import impactlab as il
from impactlab.history.base import AbstractHistory
from impactlab.metrics.peaks import find_peak, outside, peak_force
from tests.solving import run_case
from tests.support import CASES

ROUND_TRIP = 2.0 / 5188.7  # s, of a rod of 1 m


def pushed_against_a_wall(shift: float) -> AbstractHistory:
    """Return the exact run of a rod that a triangle of force pushes onto a stiff spring, its kink at a shifted time."""
    top, end = (0.2 + shift) * ROUND_TRIP, (0.25 + shift) * ROUND_TRIP
    load = {"t": [0.0, top, end], "f": [0.0, 1e4, 0.0]}
    return run_case(
        bodies={
            "rod": il.Rod(
                length=1.0,
                diameter="20 mm",
                material={"young": 210e9, "density": 7800.0},
                ends={"left": {"force": load}},
            ),
            "wall": il.Wall(),
        },
        contacts=[il.Contact("rod.right", "wall", {"kind": "penalty", "stiffness": 2e9})],
        solve={"duration": 1.9 * ROUND_TRIP, "model": {"kind": "continuous"}},
    )


def test_times_outside_intervals_are_those_that_each_of_them_leaves() -> None:
    """Also of intervals that overlap, that lie in each other, and that begin or end at a time."""
    draw = np.random.default_rng(5)
    for count in (0, 1, 2, 7):
        intervals = np.sort(draw.integers(0, 40, (count, 2)), axis=1).astype(float)
        t = draw.permutation(np.arange(-2.0, 42.0, 0.5))
        left = [at for at in t if all(at <= start or at >= end for start, end in intervals)]
        assert outside(t, intervals).tolist() == left


@pytest.mark.parametrize("shift", [0.0, 0.001, 0.0021, 0.0033])
def test_a_kink_between_two_samples_is_the_peak(shift: float) -> None:
    # The exact solver knows the peak of each period of contact. Samples miss it by up to 9e-5 of the force here.
    run = pushed_against_a_wall(shift)
    [contact] = run.scene.contacts
    [span] = run.spans(contact.name)
    assert find_peak(run, contact, np.zeros((0, 2)), hard=False).force == pytest.approx(span.peak_force, rel=1e-12)
    assert peak_force(run, run, run.scene) == 0.0


@pytest.mark.parametrize("stiffness", [1.0, 1.5, 2.0, 2.5])
def test_a_peak_just_behind_a_front_is_found(stiffness: float) -> None:
    # A striker of unit length, impedance and speed on a long bar: the front comes back from its free end at t = 2, and
    # the force rises on until exp(-b)/b of that time after it, to exp(-exp(-b))/2 with b = 4 k (docs/hopkinson.md).
    rod = {"area": 1.0, "material": {"young": 1.0, "density": 1.0}}
    case = il.Case(
        bodies={
            "striker": il.Rod(length=1.0, velocity=1.0, **rod),
            "bar": il.Rod(length=1.0, ends={"right": "infinite"}, **rod),
        },
        contacts=[il.Contact("striker.right", "bar.left", {"kind": "penalty", "stiffness": stiffness})],
        solve={"duration": 2.5, "model": {"kind": "continuous"}},
    )
    [span] = il.run(case).spans("striker.right|bar.left")
    assert span.peak_force == pytest.approx(0.5 * np.exp(-np.exp(-4.0 * stiffness)), rel=1e-13)
    held = {"kind": "elastic_plastic", "stiffness": stiffness, "yield_force": 10.0}  # a link, which never yields
    [link] = il.run(case.with_("contacts.0.law", held)).links
    assert link.largest == pytest.approx(span.peak_force, rel=1e-13)


def test_a_kink_is_sought_on_the_side_that_is_not_left_out() -> None:
    run = pushed_against_a_wall(0.0021)
    [contact] = run.scene.contacts
    kink = find_peak(run, contact, np.zeros((0, 2)), hard=False).time
    for left_out in ((kink - 1e-5, kink + 1e-6), (kink - 1e-6, kink + 1e-5)):
        found = find_peak(run, contact, np.array([left_out]), hard=False)
        assert found.time <= left_out[0] or found.time >= left_out[1]
        edges = run.evaluate(np.array(left_out), f"force:{contact.name}")
        assert found.force == pytest.approx(edges.max(), rel=1e-12)  # the force falls on both sides of its peak


def test_a_peak_is_not_left_out_where_faces_chatter() -> None:
    # Two rods collide: the force is Z1 Z2/(Z1 + Z2) times the speed of approach until the front of the load arrives
    # 230 us after the start. Runs of the consistent mesh chatter at the touch; the neighbourhoods of all their touches
    # once covered the whole contact, and an error of 0.3 of the peak was stated as 0.01.
    load = "10736.2*sin(2*pi*t/4.86809e-4)"
    light, steel = {"young": 110e9, "density": 2700.0}, {"young": 210e9, "density": 7850.0}
    soft = {"young": 70e9, "density": 7850.0}
    segments = [
        {"length": 0.594603, "area": 4.84391e-4, "material": steel},
        {"length": 0.350418, "area": 6.475928e-4, "material": soft},
    ]
    history = run_case(
        bodies={
            "bar": il.Rod(length=0.390676, area=4.8384e-4, material=light),
            "striker": il.Rod(segments=segments, velocity=-0.913, ends={"right": {"force": load}}),
        },
        contacts=[il.Contact("bar.right", "striker.left", {"kind": "addition_deletion"}, gap=1.19377e-4)],
        solve={"duration": 3.761538e-4, "tolerance": 0.01},
    )
    one, other = (area * np.sqrt(m["young"] * m["density"]) for area, m in ((4.8384e-4, light), (4.84391e-4, steel)))
    exact = one * other / (one + other) * 0.913
    [contact] = history.scene.contacts
    touch, trip = 1.19377e-4 / 0.913, history.scene.round_trip
    outside = np.array([[0.0, touch + 0.05 * trip], [2.3e-4, history.duration]])
    peak = find_peak(history, contact, outside, hard=True).force
    assert history.choice is not None
    assert history.choice.met
    assert abs(peak / exact - 1.0) <= history.choice.expected_error


@pytest.mark.parametrize("records", [300, 20_000])
def test_the_peak_of_a_link_is_that_of_its_force(records: int) -> None:
    """Links have no periods of contact, whose largest forces are those of all steps."""
    case = il.load_case(CASES / "smith_pile.yaml").with_("solve.records", records)
    coarse, fine = (il.run(case.with_("solve.step", {"courant": courant})) for courant in (0.5, 0.25))
    assert 0.0 < peak_force(coarse, fine, fine.scene) < 0.1
