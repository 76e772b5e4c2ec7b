"""Rounding of meshes that are displaced as a whole: no run fails by it, and none hides behind it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.errors import StepError
from impactlab.simulate.checks import check_gain, check_momentum
from impactlab.simulate.mesh_rounding import MAX_ROUNDED, rounded
from tests.solving import in_steps, mesh, run_case

FIELDS: dict[str, Any] = {"length": 1.0, "section": {"diameter": 0.02}, "material": "steel"}


def free_beam(duration: float, elements: int, integrator: str = "newmark", **start: Any) -> Any:
    """Return the history of a free beam below a ball that it never meets."""
    return run_case(
        bodies={"beam": il.Beam(**FIELDS, **start), "ball": il.Mass(1.0)},
        contacts=[il.Contact("beam.at(0.5)", "ball", {"kind": "penalty", "stiffness": 1e7}, gap=10.0)],
        solve=in_steps(duration, integrator, mesh(elements), dt=1e-5),
    )


@pytest.mark.parametrize("integrator", ["newmark", "midpoint", "generalised_alpha"])
@pytest.mark.parametrize("shape", ["0.01*x", "0.01*x - 0.003", "0.01 + 0*x"])
def test_a_free_beam_at_rest_that_is_moved_as_a_whole_stays_at_rest(shape: str, integrator: str) -> None:
    history = free_beam(2e-3, 200, integrator, displacement=shape)
    # A strain energy of 800 J would hold the same beam in the shape of its first mode, with this deflection of 10 mm.
    assert np.abs(history.energy.bodies["beam"]).max() < 1e-4
    assert np.abs(history.recorded["momentum:beam"].values).max() < 1e-8  # of 2.47 kg
    assert [each.code for each in history.warnings] == ["no_contact"]


@pytest.mark.parametrize(("duration", "elements"), [(0.1, 200), (0.02, 800)])
def test_a_free_beam_that_flies_keeps_its_momentum(duration: float, elements: int) -> None:
    history = free_beam(duration, elements, velocity=1.0)
    momentum = history.recorded["momentum:beam"].values
    assert momentum[-1] == pytest.approx(momentum[0], rel=1e-5)


def test_momentum_and_energy_beyond_the_rounding_of_a_mesh_still_end_a_run() -> None:
    history = free_beam(1e-3, 200, displacement="0.01*x")
    bound = rounded(history, history.duration)["beam"]

    def failure(text: str, remedy: str) -> StepError:
        return StepError(text, remedy=remedy, time=1e-3, step=100)

    momentum = history.recorded["momentum:beam"].values
    momentum[-1] = 0.9 * bound.momentum
    check_momentum(history, [0.0], {}, 1e-3, failure)
    momentum[-1] = 1.1 * bound.momentum
    with pytest.raises(StepError, match="its momentum changed"):
        check_momentum(history, [0.0], {}, 1e-3, failure)
    energy = history.energy.bodies["beam"]
    energy[-1] = energy[0] + 2.0 * bound.energy  # more than 1.0: the bound grows with the energy of a flight
    for name in ("total", "balance", "largest_gain"):
        vars(history.energy).pop(name, None)
    with pytest.raises(StepError, match="energy grew"):
        check_gain(history, 1e-9, str, failure)


def test_rounding_of_a_mesh_is_a_small_part_of_the_motion() -> None:
    """A beam of 2.47 kg at 1 m/s may lose 1e-5 of its momentum at most, however long it flies."""
    history = free_beam(1e-3, 200, velocity=1.0)
    assert rounded(history, 1e6)["beam"].momentum <= MAX_ROUNDED * 2.48
    assert rounded(history, 1e-3)["beam"].momentum < 1e-9 * 2.48
