"""Flexible links that bend further than shapes of a linear curvature hold say so."""

import numpy as np
import pytest

import impactlab as il
from tests.solving import in_steps, run_case


def turned(torque, thickness=0.002, duration=0.3, **joint):
    """Return the run of an arm of aluminium, 1 m long with 0.5 kg at its end, turned by a torque at its hinge."""
    arm = il.Beam(length=1.0, section={"width": 0.02, "height": thickness}, material={"young": 7e10, "density": 2700})
    stop = {"kind": "hertz", "stiffness": 1e6}
    return run_case(
        bodies={"arm": arm, "side": il.Wall(), "above": il.Wall()},
        mechanisms={"robot": il.Mechanism([il.Joint("arm", torque=torque, end_mass=0.5, **joint)])},
        contacts=[
            il.Contact("arm.right", "side", stop, along="x", gap=10.0),
            il.Contact("arm.right", "above", stop, along="y", gap=10.0),
        ],
        solve=in_steps(duration, "midpoint", {"kind": "modal", "elements": 40, "modes": 6}, dt="20 us"),
    )


@pytest.mark.parametrize("torque", [0.05, 0.5])
def test_the_ends_of_a_bent_link_are_nearer_by_its_shortening(torque):
    """The frame of a hinged link is the line between its ends: their distance is L - s."""
    history = turned(torque)
    x, y, s = (
        history.recorded[name].values
        for name in ("position:arm.right along x", "position:arm.right along y", "shortening:arm")
    )
    assert np.hypot(x, y) == pytest.approx(1.0 - s, rel=1e-12)


def test_a_link_that_bends_a_little_is_not_warned_of():
    """A torque of 0.05 N m bends a strip of EI = 0.93 N m2 to slopes of some hundredths."""
    history = turned(0.05)
    assert 1e-6 < history.recorded["shortening:arm"].values.max() < 1e-3
    assert "large_bending" not in [each.code for each in history.warnings]


def test_a_link_that_bends_far_is_warned_of():
    """At 2 N m slopes are of the order of 2/0.93: no linear curvature holds there."""
    history = turned(2.0)
    said = [each.text for each in history.warnings if each.code == "large_bending"]
    share = history.recorded["shortening:arm"].values.max()
    assert len(said) == 1
    assert said[0].startswith(
        f"arm: it bends so far that the distance between its ends falls by {share:.2g} of its length"
    )


def test_a_run_that_fails_by_its_bending_has_that_reason():
    """It advised a smaller step, which does not help."""
    with pytest.raises(il.StepError, match="energy") as failed:
        turned(10.0, duration=0.6)
    assert failed.value.remedy.startswith("arm: it bends so far")
    assert "smaller step" not in failed.value.remedy
