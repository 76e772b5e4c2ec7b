"""Velocity fields of leapfrog lie between those of the half steps on both sides."""

from __future__ import annotations

import numpy as np
import pytest

import impactlab as il
from impactlab.history.base import AbstractHistory
from tests.solving import in_steps, mesh, run_case

STEP = 1e-6
TIMES = (20.2e-6, 20.5e-6, 20.75e-6, 20.95e-6)


def history_of(times: tuple[float, ...], duration: float = 4e-5) -> AbstractHistory:
    steel, ends = {"young": 2.1e11, "density": 7900.0}, {"left": {"force": 1e4}, "right": "free"}
    return run_case(
        bodies={"rod": il.Rod(length=0.3, area=9e-4, material=steel, ends=ends)},
        solve=in_steps(duration, "central_difference", mesh(40, "lumped"), dt=STEP),
        snapshots=[*times],
        probes=[{"body": "rod", "at": 0.09, "quantity": "velocity"}],
    )


def test_velocity_fields_are_those_of_the_channels() -> None:
    # In the second half of a step they were extrapolated, and ahead of the front of the wave of the other sign.
    history = history_of(TIMES)
    channel = history.evaluate(np.array(TIMES), "velocity:rod@0.09")
    for time, wanted in zip(TIMES, channel, strict=True):
        assert np.isclose(history.field("rod", time, "velocity", [0.09]).values[0], wanted, rtol=1e-9, atol=0.0)


def test_displacement_fields_and_their_times_are_as_before() -> None:
    history = history_of(TIMES)
    kept = history.field_times("rod")
    assert kept is not None
    assert np.allclose(kept, TIMES, rtol=0.0, atol=1e-18)
    ends = history_of((20e-6, 21e-6))
    one, other = (ends.field("rod", time, "displacement").values for time in (20e-6, 21e-6))
    found = history.field("rod", TIMES[2], "displacement").values
    assert np.allclose(found, 0.25 * one + 0.75 * other, rtol=1e-9, atol=1e-20)


def test_the_last_instant_of_a_run_has_a_velocity_field() -> None:
    history = history_of((0.0, 4e-5))
    assert np.isfinite(history.field("rod", 4e-5, "velocity").values).all()
    assert history.field("rod", 0.0, "velocity").values[1:].max() < 1e-3 * 1e4 / 36657.741


@pytest.mark.parametrize("steps", [0.5, 1.0, 1.5])
@pytest.mark.parametrize("beads", [1, 10])
def test_gaps_of_a_run_of_one_step_are_those_of_the_motion(steps: float, beads: int) -> None:
    case = il.Case(
        bodies={"striker": il.Mass(1.0, velocity=1.0), "bead": il.Mass(1.0, repeat=beads)},
        contacts=[il.Chain(["striker", "bead"], {"kind": "hertz", "stiffness": 1e8}, gap=1e-3)],
        solve={"duration": steps * 1e-6, "integrator": {"kind": "central_difference"}, "step": {"dt": 1e-6}},
    )
    history = il.run(case)
    times = np.linspace(0.0, history.duration, 4)
    found = history.evaluate(times, f"gap:{history.scene.contacts[0].name}")
    np.testing.assert_allclose(found, 1e-3 - times, rtol=0.0, atol=1e-15)
