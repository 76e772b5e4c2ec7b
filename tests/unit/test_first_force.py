"""The first force of a dashpot on an explicit mesh: that of the waves, whatever the time of the touch within a step."""

from __future__ import annotations

import math

import numpy as np
import pytest

import impactlab as il
from impactlab.history.base import AbstractHistory
from tests.solving import in_steps, mesh, run_case

YOUNG, DENSITY, AREA = 210e9, 7800.0, 1e-3
IMPEDANCE = AREA * math.sqrt(YOUNG * DENSITY)  # N s/m
SPEED, STIFFNESS, ELEMENTS = 1.0, 1e5, 100  # m/s; N/m, of a spring that gives nothing within the run; of a rod of 1 m
TRANSIT = math.sqrt(DENSITY / YOUNG)  # s


def of_two_rods(dashpot: float, courant: float, gap: float) -> AbstractHistory:
    """Return the run of a rod that strikes an equal one through a dashpot [N s/m]."""
    material = {"young": YOUNG, "density": DENSITY}
    return run_case(
        bodies={
            "striker": il.Rod(length=1.0, area=AREA, material=material, velocity=SPEED),
            "rod": il.Rod(length=1.0, area=AREA, material=material),
        },
        contacts=[
            il.Contact(
                "striker.right",
                "rod.left",
                {"kind": "penalty", "stiffness": STIFFNESS, "damping": dashpot},
                gap=gap,
                name="pair",
            )
        ],
        solve=in_steps(TRANSIT, "central_difference", mesh(ELEMENTS, "lumped"), courant=courant),
    )


def of_waves(dashpot: float) -> float:
    """Return the force of the waves until the first echo [N]: c v/(1 + c/Z), where the two rods have half of Z."""
    return dashpot * SPEED / (1.0 + 2.0 * dashpot / IMPEDANCE)


@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.48, 0.52, 0.9])
@pytest.mark.parametrize("ratio", [0.5, 2.0, 50.0])
def test_the_force_at_courant_1_is_that_of_the_waves_from_the_touch_on(ratio: float, share: float) -> None:
    step, dashpot = TRANSIT / ELEMENTS, ratio * IMPEDANCE
    run = of_two_rods(dashpot, 1.0, (3.0 + share) * step * SPEED)
    force = run.recorded["force:pair"].values / of_waves(dashpot)
    # The touch falls into the step after record 3, and the force of a step is recorded at its end. Forces of the first
    # steps stand for parts of them, and none for more; of a stiff dashpot also those in which it would part the faces.
    assert force.max() < 1.0 + 0.01
    assert np.all(force[:4] == 0.0)
    np.testing.assert_allclose(force[20:-1], 1.0, atol=0.01)
    assert run.energy.largest_gain < 1e-12


@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.48, 0.52, 0.9])
def test_a_stiff_dashpot_parts_no_faces(share: float) -> None:
    # A node thrown back by its dashpot opened the contact in every other step: the force was 0, then twice too large.
    dashpot = 50.0 * IMPEDANCE
    run = of_two_rods(dashpot, 0.95, (3.0 + share) * TRANSIT / ELEMENTS * 0.95 * SPEED)
    force = run.recorded["force:pair"].values[10:-1] / of_waves(dashpot)
    assert np.abs(force - 1.0).mean() < 0.02
    assert [event.kind for event in run.events] == ["close"]
    assert run.energy.largest_gain < 1e-12


@pytest.mark.parametrize(("courant", "excess"), [(0.1, 400), (0.2, 150), (0.4, 25), (0.5, None), (1.0, None)])
def test_a_hard_contact_in_short_steps_is_warned_of_with_its_size(courant: float, excess: int | None) -> None:
    """Two end nodes of rho A h/2 that take a common speed in a step of C h/c: Z v/(4 C), where waves give Z v/2."""
    material = {"young": YOUNG, "density": DENSITY}
    run = il.run(
        il.Case(
            bodies={
                "striker": il.Rod(length=1.0, area=AREA, material=material, velocity=SPEED),
                "rod": il.Rod(length=1.0, area=AREA, material=material),
            },
            contacts=[il.Contact("striker.right", "rod.left", {"kind": "addition_deletion"})],
            solve={
                "duration": TRANSIT,
                "model": {"kind": "finite_element", "elements": ELEMENTS, "mass": "lumped"},
                "integrator": {"kind": "central_difference"},
                "step": {"courant": courant},
            },
        )
    )
    texts = [each.text for each in run.warnings if each.code == "first_force"]
    if excess is None:
        assert texts == []
        return
    (text,) = texts
    assert f"too large by up to {excess} %" in text
    assert run.contacts[0].peak_force == pytest.approx((1.0 + 0.01 * excess) * 0.5 * IMPEDANCE * SPEED, rel=1e-9)


def test_a_first_force_beyond_that_of_the_waves_is_warned_of_with_its_size() -> None:
    # In short steps the end nodes act with all of their mass: at most (1 + 2 c/Z)/(1 + 2 c/Z C) = 2.5 at C = 0.2.
    run = of_two_rods(2.0 * IMPEDANCE, 0.2, 0.0)
    warned = {each.code: each.text for each in run.warnings}
    force = run.recorded["force:pair"].values.max() / of_waves(2.0 * IMPEDANCE)
    assert 1.2 < force < 5.0 / 1.8
    assert "by up to 178 %" in warned["first_force"]
    assert "first_force" not in {each.code for each in of_two_rods(2.0 * IMPEDANCE, 1.0, 0.0).warnings}


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6])
def test_a_mass_on_a_spring_and_dashpot_converges_at_the_second_order(share: float) -> None:
    mass, stiffness, damping = 1.0, 1e6, 1000.0
    frequency, ratio = math.sqrt(stiffness / mass), 0.5 * damping / math.sqrt(stiffness * mass)
    damped = frequency * math.sqrt(1.0 - ratio**2)

    def error(steps: int) -> float:
        duration, gap = 2e-3, (0.1 + share / steps) * 2e-3 * SPEED
        run = run_case(
            bodies={"ball": il.Mass(mass, velocity=SPEED), "wall": il.Wall()},
            contacts=[
                il.Contact("ball", "wall", {"kind": "penalty", "stiffness": stiffness, "damping": damping}, gap=gap)
            ],
            solve=in_steps(duration, "central_difference", dt=duration / steps),
        )
        t = np.linspace(gap / SPEED, duration, 500)
        closed = t - gap / SPEED
        exact = gap + SPEED / damped * np.exp(-ratio * frequency * closed) * np.sin(damped * closed)
        return float(np.abs(run.evaluate(t, "position:ball") - exact).max() * frequency / SPEED)

    # The error of leapfrog is (w dt)^2/24 of the motion in each radian, of the dashpot some times as much.
    coarse, fine = error(200), error(800)
    assert fine < (frequency * 2e-3 / 800) ** 2
    assert coarse / fine > 4.0 ** (2.0 - 0.3)  # four times the steps; the touch falls at the same place within a step


@pytest.mark.parametrize("gap", [0.0, 1e-5, 1.3e-5, 1.7e-5])
def test_the_peak_of_a_dashpot_under_generalised_alpha_is_its_force_at_the_touch(gap: float) -> None:
    """Two masses meet with v on a dashpot c so strong that c v is their largest force.

    The first force gives up to half a step of impulse more, which made the peak half too large at any step.
    """
    damping, dt, reduced = 1000.0, 2.5e-6, 0.3 * 0.5 / 0.8
    case = il.Case(
        bodies={"a": il.Mass(0.3, velocity=1.0), "b": il.Mass(0.5)},
        contacts=[il.Contact("a", "b", {"kind": "penalty", "stiffness": 1e6, "damping": damping}, gap=gap)],
        solve={"duration": 1e-3, "integrator": {"kind": "generalised_alpha"}, "step": {"dt": dt}},
    )
    history = il.run(case)
    (span,) = history.contacts
    decay = damping * dt / reduced  # of the speed in a step
    assert span.peak_force == pytest.approx(damping, rel=decay)
    assert history.energy.final_error < 4.0 * decay**2  # the loss is of the second order; it was of the first
