"""A contact force is read from a stepped run as well as its displacements are: to the second order."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import impactlab as il
from impactlab.contact.penalty import Penalty
from impactlab.contact.power_law import Hertz
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.generalised_alpha import GeneralisedAlpha
from impactlab.integrators.midpoint import Midpoint
from impactlab.numerics.slopes import slopes
from impactlab.scene import Mass, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import run
from impactlab.testing.scenes import in_a_row

STIFFNESS, SPEED = 1e6, 1.0  # N/m, m/s; of a ball of 1 kg on a wall
FREQUENCY = math.sqrt(STIFFNESS)
SCHEMES = (CentralDifference(), Midpoint(), GeneralisedAlpha(rho_inf=0.9))


def ball_on_spring(integrator: AbstractIntegrator, steps: int, duration: float, records: int = 100_000) -> Simulation:
    bodies, step = (Mass("ball", 1.0, SPEED), Wall("wall")), StepRule(dt=duration / steps)
    return in_a_row(bodies, None, Penalty(STIFFNESS), integrator, step, duration=duration, records=records)


@pytest.mark.parametrize("records", [100_000, 100])
@pytest.mark.parametrize("integrator", SCHEMES, ids=lambda each: type(each).__name__)
def test_a_steep_force_is_known_to_the_second_order_at_any_time(integrator: AbstractIntegrator, records: int) -> None:
    duration = 0.25 * math.pi / FREQUENCY  # the force still rises at the end
    t = np.append(np.linspace(0.0, duration, 997), duration)
    kept = min(records, 400)
    force = run(*ball_on_spring(integrator, 400, duration, records)).evaluate(t, "force:ball|wall")
    found = np.abs(force / (SPEED * FREQUENCY) - np.sin(FREQUENCY * t))
    assert found.max() < 2.0 * (FREQUENCY * duration / kept) ** 2  # a stair is half a step off: 250 times as much


def test_a_force_beyond_the_last_middle_of_a_step_turns_or_rests_but_never_pulls() -> None:
    for phase in np.linspace(0.9, 1.1, 41):
        duration = phase * math.pi / FREQUENCY  # from shortly before the opening to shortly after it
        end = float(run(*ball_on_spring(Midpoint(), 90, duration)).evaluate(duration, "force:ball|wall")) / (
            SPEED * FREQUENCY
        )
        assert 0.0 <= end == pytest.approx(max(0.0, math.sin(math.pi * phase)), abs=1e-3)


def test_stairs_and_chatter_keep_their_shape_and_a_ramp_its_slope() -> None:
    middles = np.arange(8.0)
    stairs = np.array([0.0, 0.0, 5.0, 5.0, 5.0, 2.0, 2.0, 2.0])
    np.testing.assert_array_equal(slopes(middles, stairs), np.zeros(8))
    np.testing.assert_array_equal(slopes(middles, middles % 2), np.zeros(8))
    np.testing.assert_allclose(slopes(middles, 3.0 * middles), np.full(8, 3.0))


@pytest.mark.parametrize("last", [7.0, 6.3])
def test_slopes_at_both_ends_are_of_the_second_order(last: float) -> None:
    """Those of a parabola are exact, also in a last cell that is shorter."""
    middles = np.append(np.arange(1.0, 7.0), last)
    for t in (middles, middles - 8.0):  # rising, and falling to the end
        np.testing.assert_allclose(slopes(t, t**2)[[0, -1]], 2.0 * t[[0, -1]], rtol=1e-12)


@pytest.mark.parametrize("records", [100_000, 100])
@pytest.mark.parametrize("duration", [1.0e-4, 1.15e-4])
def test_peaks_at_the_front_of_a_wave_along_beads_do_not_depend_on_the_records(duration: float, records: int) -> None:
    """Forces there rise by 1 % in a step until the run ends: a peak of the last step or mean would be too low."""
    stiffness, mass, speed, count = 5e9, 1e-3, 0.5, 14
    beads = [Mass(f"m{i}", mass, speed if i == 0 else 0.0) for i in range(count)]
    steps, hertz = StepRule(dt=4e-8), Hertz(stiffness)
    history = run(*in_a_row(beads, None, hertz, CentralDifference(), steps, duration=duration, records=records))

    def rates(_: float, state: np.ndarray) -> np.ndarray:
        u, v = state[:count], state[count:]
        force = stiffness * np.maximum(u[:-1] - u[1:], 0.0) ** 1.5
        return np.concatenate((v, np.diff(force, prepend=0.0, append=0.0) / -mass))

    start = np.append(np.zeros(count), [bead.velocity for bead in beads])
    end = solve_ivp(rates, (0.0, duration), start, "DOP853", rtol=1e-12, atol=1e-16).y[:count, -1]
    forces = stiffness * np.maximum(end[:-1] - end[1:], 0.0) ** 1.5
    rising = [place for place, force in enumerate(forces[1:], 1) if 1e-3 * forces.max() < force < forces[place - 1]]
    assert rising
    for place in rising:
        (span,) = history.spans(f"m{place}|m{place + 1}")
        assert span.peak_force == pytest.approx(forces[place], rel=5e-5)


@pytest.mark.parametrize("records", [100_000, 100])
@pytest.mark.parametrize("integrator", SCHEMES, ids=lambda each: type(each).__name__)
def test_the_impulse_up_to_any_time_is_of_second_order_also_at_the_end(
    integrator: AbstractIntegrator, records: int
) -> None:
    """In leapfrog the last force acts from half a step before the end, which was left out: half a step of the force."""
    duration = 0.25 * math.pi / FREQUENCY  # in contact, while the force still rises
    history = run(*ball_on_spring(integrator, 400, duration, records))
    t = np.linspace(0.0, duration, 38)
    exact = SPEED * (1.0 - np.cos(FREQUENCY * t))
    found = [history.impulse_until("ball|wall", float(each)) for each in t]
    bound = 0.5 * (duration / min(400, records) * FREQUENCY) ** 2  # the impulse of the first step or record
    np.testing.assert_allclose(found, exact, rtol=0.0, atol=bound)
    assert found[-1] == pytest.approx(history.impulse_of("ball|wall"), abs=2.0 * bound)


@pytest.mark.parametrize("share", [0.02, 0.3, 0.8, 1.0])  # of the last step that lies within the run
@pytest.mark.parametrize("scheme", ["newmark", "generalised_alpha", "moreau_jean"])
def test_the_force_at_the_end_of_a_run_is_its_peak_where_it_rises(scheme: str, share: float) -> None:
    """The peak followed from the overlap, which is no line between the ends of a step: it was up to 2e-4 off."""
    stiffness, dt = 1e9, 1e-5  # N/m^1.5, s: of a contact of some 40 steps to its turning point
    end = (20.0 + share) * dt
    history = il.run(
        il.Case(
            bodies={"mass": il.Mass(1.0, velocity=1.0), "wall": il.Wall()},
            contacts=[il.Contact("mass", "wall", {"kind": "hertz", "stiffness": stiffness})],
            solve={"duration": end, "integrator": {"kind": scheme}, "step": {"dt": dt}},
        )
    )
    (span,) = history.contacts
    force = history.at_end("force:mass|wall")
    assert force == pytest.approx(span.peak_force, rel=1e-14)
    assert force == history.evaluate_each(np.array([end]), ["force:mass|wall"])[0, 0]
    exact = solve_ivp(
        lambda _, state: (state[1], -stiffness * max(state[0], 0.0) ** 1.5),
        (0.0, end),
        (0.0, 1.0),
        rtol=1e-11,
        atol=1e-15,
    )
    assert force == pytest.approx(stiffness * exact.y[0, -1] ** 1.5, rel=4e-4)  # up to 5.8e-4 by the overlap
