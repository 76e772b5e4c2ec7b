"""The first step of an end dashpot that is stiffer than the impedance of its rod, under central differences."""

from __future__ import annotations

import numpy as np
import pytest

import impactlab as il
from tests.solving import in_steps, mesh, run_case

AREA, YOUNG, DENSITY, LENGTH = 2.4e-4, 70e9, 4430.0, 0.31
IMPEDANCE = AREA * np.sqrt(YOUNG * DENSITY)
TRANSIT = LENGTH / np.sqrt(YOUNG / DENSITY)
MATERIAL = {"young": YOUNG, "density": DENSITY}


def run(ratio: float, courant: float, velocities: tuple[float, float], gap: float) -> il.History:
    """Return the run of two rods, the left one with a dashpot of so many impedances at its right end."""
    ends = {"right": {"dashpot": ratio * IMPEDANCE}}
    return run_case(
        bodies={
            "left": il.Rod(length=LENGTH, area=AREA, material=MATERIAL, velocity=velocities[0], ends=ends),
            "right": il.Rod(length=LENGTH, area=AREA, material=MATERIAL, velocity=velocities[1]),
        },
        contacts=[il.Contact("left.right", "right.left", {"kind": "addition_deletion"}, gap=gap)],
        solve=in_steps(0.9 * TRANSIT, "central_difference", mesh(40, "lumped"), courant=courant),
    )


@pytest.mark.parametrize("ratio", [2.0, 4.0, 30.0])
def test_the_end_moves_by_the_front_alone(ratio: float) -> None:
    # Behind the front the force -Z (v0 - v) of the wave holds that of the dashpot, c v: v = v0 Z/(Z + c). The end once
    # set out with v0 (1 - c/Z), in the opposite direction.
    history = run(ratio, 1.0, (-3.0, 0.0), 1e-2)
    t = np.linspace(0.0, 0.9 * TRANSIT, 30)
    moved = history.evaluate(t, f"displacement:left@{LENGTH:.6g}")
    np.testing.assert_allclose(moved, -3.0 * t / (1.0 + ratio), rtol=0.0, atol=1e-9 * 3.0 * TRANSIT)


@pytest.mark.parametrize("ratio", [1.2, 1.6, 4.0, 30.0])
@pytest.mark.parametrize("courant", [0.5, 0.95, 1.0])
def test_faces_that_part_do_not_press_in_the_first_step(ratio: float, courant: float) -> None:
    # The left face leaves the right one at once, with any dashpot; it once pressed with 17.6 kN in the first step.
    history = run(ratio, courant, (-3.045, 0.254), 0.0)
    assert history.impulse_of("left.right|right.left") == 0.0
    assert not history.events
