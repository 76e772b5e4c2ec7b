"""One step of a power law by itself: it solves its own equation, keeps its energy, never pulls."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from impactlab.contact import power_law
from impactlab.contact.power_law import Flores, Hertz, respond, spring_of
from impactlab.numerics.compiling import plain
from impactlab.simulate.stepping.ports import fill_acting
from impactlab.types import Port, Reply

K = 1e9


def port(
    gap: float,
    free_gap: float,
    dt: float = 1e-5,
    compliance: float = 0.0,
    load_point: float = 0.5,
    rates: tuple[float, float] | None = None,
) -> Port:
    made = Port()
    made.dt, made.gap, made.free_gap = dt, gap, free_gap
    made.gap_rate, made.free_gap_rate = rates or ((free_gap - gap) / dt,) * 2
    made.gap_per_force, made.rate_per_force = compliance, 2.0 * compliance / dt
    plain(fill_acting)(made, load_point)
    return made


def told(made: Port, law: Hertz | Flores, speed: float = 0.0, stored: float = 0.0) -> Reply:
    for slot, value in enumerate(law.begin(None, None, made.dt).parameters):
        made.parameters[slot] = value
    made.memory[0], made.memory[1] = stored, speed
    reply = Reply()
    reply.memory[:] = made.memory[:]
    respond(made, reply)
    return reply


def energy(gap: float, law: Hertz | Flores) -> float:
    return law.stiffness * max(0.0, -gap) ** (law.exponent + 1.0) / (law.exponent + 1.0)


LAWS = [Hertz(K), Hertz(1e5, exponent=1.0), Hertz(1e17, exponent=3.0), Flores(K, restitution=0.2)]


@pytest.mark.parametrize("law", LAWS, ids=["hertz", "linear", "cubic", "flores"])
def test_force_times_path_is_the_energy_stored_and_lost(law: Hertz | Flores) -> None:
    random = np.random.default_rng(1)
    answered = 0
    for _ in range(2000):
        size = 10.0 ** random.uniform(-9.0, -3.0)
        gap, free_gap = size * random.normal(size=2)
        compliance = 10.0 ** random.uniform(-16.0, -2.0)
        stored = energy(gap, law)
        reply = told(port(gap, free_gap, compliance=compliance), law, speed=1.0 if gap < 0.0 else 0.0, stored=stored)
        end = free_gap + compliance * reply.force
        assert reply.force >= 0.0
        assert reply.stored >= 0.0
        assert reply.dissipated >= 0.0
        largest = stored + reply.stored + abs(reply.force * (gap - end)) + reply.dissipated
        # The gap at the end is known to a rounding of the gaps, and its energy to that times the force there.
        slip = 1e-15 * size * (law.exponent + 1.0) * (reply.force + law.stiffness * max(0.0, -end) ** law.exponent)
        balance = reply.force * (gap - end) + stored - reply.stored - reply.dissipated
        assert reply.stored == pytest.approx(energy(end, law), rel=1e-11, abs=10.0 * slip)
        if reply.force > 0.0:
            answered += 1
            assert abs(balance) <= 1e-11 * largest + 10.0 * slip
        else:
            assert balance <= 1e-14 * largest + slip
    assert answered > 1000


def test_without_compliance_the_force_is_that_of_the_motion_given() -> None:
    reply = told(port(-1e-4, -2e-4), Hertz(K))
    assert reply.force == pytest.approx((energy(-2e-4, Hertz(K)) - energy(-1e-4, Hertz(K))) / 1e-4, rel=1e-13)
    still = told(port(-1e-4, -1e-4), Hertz(K))
    assert still.force == pytest.approx(K * 1e-4**1.5, rel=1e-15)


def test_both_ways_to_the_mean_force_meet() -> None:
    # Just inside and outside the series: a jump would show as more than the slope of the force.
    forces = [told(port(-1e-4, -1e-4 * (1.0 + 2.0 * ratio)), Hertz(K)).force for ratio in (0.9989e-3, 1.0021e-3)]
    slope = 0.75 * 2.0 * (1.0021e-3 - 0.9989e-3)
    assert forces[1] / forces[0] - 1.0 == pytest.approx(slope, rel=2e-3)
    exact = (energy(-1.001e-4, Hertz(K)) - energy(-1e-4, Hertz(K))) / 1e-7
    assert told(port(-1e-4, -1.001e-4), Hertz(K)).force == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("rate", [-0.7, 0.0, 0.04])
def test_at_one_instant_it_is_the_law_itself(rate: float) -> None:
    law = Flores(K, restitution=0.2)
    made = port(-1e-4, -1e-4, load_point=0.0, rates=(rate, rate))
    reply = told(made, law, speed=0.5)
    assert reply.force == pytest.approx(K * 1e-4**1.5 * (1.0 - law.hysteresis() / 0.5 * rate), rel=1e-14)
    assert reply.memory[1] == 0.5


@pytest.mark.parametrize("law", LAWS, ids=["hertz", "linear", "cubic", "flores"])
def test_at_the_end_of_the_step_it_is_the_law_of_the_gap_and_rate_there(law: Hertz | Flores) -> None:
    random = np.random.default_rng(2)
    answered = 0
    for _ in range(2000):
        size = 10.0 ** random.uniform(-9.0, -3.0)
        gap, free_gap = size * random.normal(size=2)
        compliance = 10.0 ** random.uniform(-16.0, -2.0)
        rate = size / 1e-5 * random.normal()
        made = port(gap, free_gap, compliance=compliance, load_point=1.0, rates=((free_gap - gap) / 1e-5, rate))
        reply = told(made, law, speed=size / made.dt)
        end, rate = free_gap + compliance * reply.force, made.free_gap_rate + made.rate_per_force * reply.force
        assert reply.force >= 0.0
        if reply.force == 0.0:
            damped = law.hysteresis() if isinstance(law, Flores) else 0.0
            assert free_gap >= 0.0 or 1.0 - damped * rate * made.dt / size <= 0.0
            # A spring that is let go of pushes against the damping: the mean of the powers of that at both ends.
            first, last = (law.stiffness * max(0.0, -at) ** law.exponent for at in (gap, free_gap))
            opening = (free_gap - gap) / 1e-5
            power = (first - max(0.0, first * (1.0 - damped * opening * made.dt / size))) * opening + last * rate
            lost = 0.5 * max(0.0, power) * made.dt if free_gap < 0.0 else 0.0
            assert reply.dissipated == pytest.approx(lost, rel=1e-12)
            continue
        answered += 1
        damped = law.hysteresis() * made.dt / size if isinstance(law, Flores) else 0.0
        expected = law.stiffness * (-end) ** law.exponent * (1.0 - damped * rate)
        # Gap and rate at the end are known to a rounding of what they are differences of.
        slip = 1e-15 * law.exponent * (size + compliance * reply.force)
        rate_slip = 1e-15 * damped * (size / made.dt + made.rate_per_force * reply.force)
        tangent = law.exponent * expected / max(-end, slip)
        error = tangent * slip + law.stiffness * (-end) ** law.exponent * rate_slip
        assert reply.force == pytest.approx(expected, rel=1e-11, abs=10.0 * error)
        stored = energy(end, law)
        assert reply.stored == pytest.approx(stored, rel=1e-11, abs=20.0 * slip * stored / max(-end, slip))
    assert answered > 500


def test_it_never_pulls_and_dissipates_the_energy_of_the_spring() -> None:
    law = Flores(K, restitution=0.2)
    stored = energy(-1e-4, law)
    made = port(-1e-4, -0.5e-4, compliance=1e-9)  # 5 m/s apart, where 1 + a d' is negative
    reply = told(made, law, speed=1.0, stored=stored)
    assert reply.force == 0.0
    assert reply.trial < 0.0
    assert reply.in_contact == 0.0
    assert reply.dissipated == pytest.approx(stored - energy(-0.5e-4, law), rel=1e-13)
    assert reply.memory[1] == 1.0  # they still overlap: it is the same touch
    explicit = port(-1e-4, -0.5e-4, load_point=0.0)
    assert told(explicit, law, speed=1.0).force == 0.0


@pytest.mark.parametrize("load_point", [0.0, 0.5])
def test_the_approach_speed_is_that_of_the_touch(load_point: float) -> None:
    law = Flores(K, restitution=0.5)
    made = port(0.0, -3e-6, load_point=load_point)
    reply = told(made, law)
    assert reply.memory[1] == pytest.approx(0.3, rel=1e-12)
    assert reply.memory[2] == 0.0
    slow = told(port(0.0, -3e-6, load_point=load_point, rates=(0.0, -0.3)), law)
    if load_point > 0.0:
        assert slow.memory[1] == law.slowest_approach
        assert slow.memory[2] == 1.0
    else:
        assert slow.force == 0.0  # not approaching: no touch yet
        assert slow.memory[1] == 0.0
    # Inside the step, the rate where the gap passes through zero.
    if load_point > 0.0:
        falling = port(1e-6, -1e-6, rates=(-0.1, -0.3))
        assert told(falling, law).memory[1] == pytest.approx(0.2, rel=1e-12)


def test_parted_faces_forget_the_approach_speed() -> None:
    law = Flores(K, restitution=0.5)
    assert told(port(-1e-9, 1e-6, compliance=1e-12), law, speed=0.5).memory[1] == 0.0
    assert told(port(1e-6, -1e-6, load_point=0.0), law, speed=0.5).memory[1] == 0.0


def test_a_touch_below_rounding_is_none() -> None:
    reply = told(port(1e-3, -1e-25, compliance=1e-3), Hertz(K))
    assert reply.force == 0.0
    assert reply.in_contact == 0.0


def test_a_wall_of_a_spring_holds_like_a_constraint() -> None:
    # K d^n passes the inertia by many orders: the end gap is nearly zero and the force is that of a constraint.
    reply = told(port(0.0, -1e-3, compliance=1e-6), Hertz(1e30))
    assert reply.force == pytest.approx(1e3, rel=1e-6)
    assert math.isfinite(reply.stored)


def test_a_mean_force_is_continuous_where_the_free_step_leaves_the_gap_as_it_is() -> None:
    """Bodies at rest that overlap at the start: the gap before and after the free step is the same to the bit."""
    law = Hertz(K)
    rest, moved = (told(port(-1e-6, end, compliance=1e-9), law) for end in (-1e-6, -1e-6 * (1.0 + 1e-12)))
    assert rest.force == pytest.approx(moved.force, rel=1e-9)
    assert rest.stored == pytest.approx(moved.stored, rel=1e-9)
    assert rest.dissipated == moved.dissipated == 0.0


def test_newton_ends_where_faces_move_by_roundings_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    counted = []

    def counting(*given: Any) -> tuple[float, float]:
        counted.append(given)
        return plain(spring_of)(*given)

    monkeypatch.setattr(power_law, "spring_of", counting)
    random = np.random.default_rng(0)
    for _ in range(2000):
        overlap, compliance = 10.0 ** random.uniform(-22.0, -5.0), 10.0 ** random.uniform(-12.0, -6.0)
        free_gap = -overlap * (1.0 + random.integers(-2, 3) * 2.2e-16)
        counted.clear()
        told(port(-overlap, free_gap, compliance=compliance), Hertz(5.0 * K))
        assert 0 < len(counted) <= 20
