"""The peak of an exact force is found also where it is a kink between the samples."""

from __future__ import annotations

import numpy as np
import pytest

import impactlab as il
from impactlab.history.base import AbstractHistory
from impactlab.metrics.peaks import find_peak, peak_force

ROUND_TRIP = 2.0 / 5188.7  # s, of a rod of 1 m


def pushed_against_a_wall(shift: float, width: float = 0.05) -> AbstractHistory:
    """Return the exact run of a rod that a triangle of force pushes onto a stiff spring, its kink at a shifted time."""
    top, end = (0.2 + shift) * ROUND_TRIP, (0.2 + width + shift) * ROUND_TRIP
    load = {"t": [0.0, top, end], "f": [0.0, 1e4, 0.0]}
    return il.run(
        il.Case(
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
    )


@pytest.mark.parametrize("shift", [0.0, 0.001, 0.0021, 0.0033])
def test_a_kink_between_two_samples_is_the_peak(shift: float) -> None:
    # The exact solver knows the peak of each period of contact. Samples miss it by up to 9e-5 of the force here.
    run = pushed_against_a_wall(shift)
    [contact] = run.scene.contacts
    [span] = run.spans(contact.name)
    assert find_peak(run, contact, np.zeros((0, 2)), hard=False).force == pytest.approx(span.peak_force, rel=1e-12)
    assert peak_force(run, run, run.scene) == 0.0


def test_a_kink_is_sought_on_the_side_that_is_not_left_out() -> None:
    run = pushed_against_a_wall(0.0021)
    [contact] = run.scene.contacts
    kink = find_peak(run, contact, np.zeros((0, 2)), hard=False).time
    for left_out in ((kink - 1e-5, kink + 1e-6), (kink - 1e-6, kink + 1e-5)):
        found = find_peak(run, contact, np.array([left_out]), hard=False)
        assert found.time <= left_out[0] or found.time >= left_out[1]
        edges = run.evaluate(np.array(left_out), f"force:{contact.name}")
        assert found.force == pytest.approx(edges.max(), rel=1e-12)  # the force falls on both sides of its peak
