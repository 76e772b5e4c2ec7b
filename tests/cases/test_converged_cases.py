"""The cases without an exact answer, each by a second route that shares nothing with the converged reference."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import impactlab as il
from impactlab import api
from impactlab.refine.references import reference_record
from impactlab.scene.method import Simulation
from tests.support import CASES


@cache
def judged(name: str) -> tuple[Simulation, reference_record.Reference]:
    asked = il.load_case(CASES / f"{name}.yaml").simulation()
    found = api.reference_of(*asked)
    assert found is not None
    assert found.name == "converged"
    assert found.uncertainty < 1e-6
    return asked, found


def test_the_damped_rod_is_the_sum_of_its_modes() -> None:
    """Opening where the mass would have to be pulled: u'' = 0 of the modes of bar and mass as one body."""
    (scene, _), found = judged("damped_rod")
    bar, m, b = scene.bodies["bar"], scene.bodies["hammer"].mass, 22400.0 / 5.6e9
    alpha, speed = bar.mass / m, bar.segments[0].wave_speed
    count = 4000
    z = np.array(
        [brentq(lambda x: x * math.sin(x) - alpha * math.cos(x), n * math.pi + 1e-12, (n + 0.5) * math.pi)
         for n in range(count)]
    )  # fmt: skip
    w, tip = z * speed / bar.length, np.sin(z)
    share = m * tip**2 / (bar.mass * (0.5 - np.sin(2.0 * z) / (4.0 * z)) + m * tip**2)
    decay = 0.5 * b * w**2
    root = np.sqrt((w**2 - decay**2).astype(complex))
    exponents = np.array([-decay + 1j * root, -decay - 1j * root])
    weights = share * np.array([1.0, -1.0])[:, None] / (2j * root)

    def derivative(order: int, t: float) -> float:
        return float(np.sum(weights * exponents**order * np.exp(exponents * t)).real)

    opening = brentq(lambda t: derivative(2, t), 1.2 * scene.round_trip, 1.6 * scene.round_trip)
    assert opening == pytest.approx(0.672425e-3, rel=2e-6)
    assert derivative(1, opening) == pytest.approx(-0.677569, abs=2e-6)
    history = found.history
    event = [event for event in history.events if event.kind == "open"][-1]
    assert event.time == pytest.approx(opening, rel=1e-5)
    impulse = sum(span.impulse for span in history.contacts)
    assert impulse == pytest.approx(m * (1.0 - derivative(1, opening)), rel=2e-6)
    t = np.linspace(0.05, 0.95, 30) * opening
    wanted = [derivative(0, time) for time in t]
    assert history.evaluate(t, "position:hammer") == pytest.approx(wanted, rel=2e-6, abs=1e-10)


def test_the_stepped_bar_is_a_lattice_of_waves() -> None:
    """Both pieces last one transit: p and q hop from node to node, scatter at the step, and the ball rides on one end.

    The force is taken at the middle of a step of 1/N transit, solved by Newton: an error of order N^-2.
    """
    (scene, method), found = judged("ball_on_stepped_rod")
    first, second = scene.bodies["bar"].segments
    transit = first.length / first.wave_speed
    assert second.length / second.wave_speed == pytest.approx(transit, rel=1e-14)
    z1, z2 = first.impedance, second.impedance
    mass, stiffness = scene.bodies["ball"].mass, method.laws[scene.contacts[0].name].stiffness

    def lattice(n: int) -> tuple[float, float, float]:
        steps = round(scene.duration / transit * n)
        dt = transit / n
        right1, left1, right2, left2 = (np.zeros(steps) for _ in range(4))  # velocities sent into the pieces
        v, gap, force, impulse, opened = 2.0, 0.0, 0.0, 0.0, math.nan
        for k in range(steps):
            back = k - n
            at_face, at_step = (left1[back], right1[back]) if back >= 0 else (0.0, 0.0)
            from_right, at_end = (left2[back], right2[back]) if back >= 0 else (0.0, 0.0)

            def excess(f: float, free: float = gap + 0.5 * dt * (2.0 * at_face - v)) -> tuple[float, float]:
                middle = free + 0.5 * dt * (f / z1 + 0.5 * f * dt / mass)
                slope = 0.5 * dt * (1.0 / z1 + 0.5 * dt / mass)
                depth = max(0.0, -middle)
                return f - stiffness * depth**1.5, 1.0 + 1.5 * stiffness * depth**0.5 * slope

            for _ in range(30):
                value, slope = excess(force)
                force -= value / slope
                if abs(value) < 1e-9:
                    break
            force = max(0.0, force)
            face = force / z1 + 2.0 * at_face
            gap += dt * (face - v + 0.5 * force * dt / mass)
            v -= force * dt / mass
            impulse += force * dt
            if gap > 0.0 and math.isnan(opened):
                opened = (k + 1) * dt - gap / (face - v)
            right1[k] = face - at_face
            step = (2.0 * z1 * at_step + 2.0 * z2 * from_right) / (z1 + z2)
            left1[k], right2[k] = step - at_step, step - from_right
            left2[k] = at_end  # a free end sends back what arrives
        return v, impulse, opened

    coarse, fine = lattice(400), lattice(800)
    velocity, impulse, opened = ((4.0 * b - a) / 3.0 for a, b in zip(coarse, fine, strict=True))
    assert velocity == pytest.approx(-1.582741, abs=2e-6)
    assert impulse == pytest.approx(0.1185887, rel=1e-6)
    assert opened == pytest.approx(61.9333e-6, rel=5e-6)
    span = found.history.contacts[0]
    assert span.impulse == pytest.approx(impulse, rel=1e-6)
    assert span.end == pytest.approx(opened, rel=1e-5)
    assert span.peak_force == pytest.approx(3530.41, rel=1e-4)
    assert found.history.energy.largest_gain < 1e-9


def test_the_lossy_ball_meets_a_dashpot() -> None:
    """The wave does not come back in time, so the bar is a dashpot: one ordinary differential equation."""
    (scene, method), found = judged("hunt_crossley_ball")
    law, mass = method.laws[scene.contacts[0].name], scene.bodies["ball"].mass
    impedance = scene.bodies["bar"].segments[0].impedance
    damping = 1.5 * (1.0 - law.restitution) / 2.0  # over the approach speed of 2 m/s

    def force(depth: float, v: float) -> float:
        spring = law.stiffness * max(depth, 0.0) ** 1.5
        return max(0.0, spring * (1.0 + damping * v) / (1.0 + spring * damping / impedance))

    def rates(_t: float, state: np.ndarray) -> list[float]:
        depth, v, _ = state
        f = force(depth, v)
        rate = v - f / impedance
        return [rate, -f / mass, f * rate - law.stiffness * max(depth, 0.0) ** 1.5 * rate]

    def opens(_t: float, state: np.ndarray) -> float:
        return float(state[0])

    opens.terminal, opens.direction = True, -1  # type: ignore[attr-defined] # attributes that scipy reads
    solved = solve_ivp(rates, (0.0, 2e-4), [0.0, 2.0, 0.0], "DOP853", rtol=1e-12, atol=1e-16, events=opens)
    opening, v, lost = float(solved.t[-1]), float(solved.y[1, -1]), float(solved.y[2, -1])
    assert opening < scene.round_trip
    assert opening == pytest.approx(90.7124e-6, rel=1e-6)
    assert v == pytest.approx(-0.625864, abs=1e-6)
    span = found.history.contacts[0]
    assert span.end == pytest.approx(opening, rel=1e-5)
    assert span.impulse == pytest.approx(mass * (2.0 - v), rel=1e-6)
    assert span.peak_force == pytest.approx(3652.80, rel=1e-5)
    assert found.history.energy.booked["contact"][-1] == pytest.approx(lost, rel=1e-6)
    assert lost == pytest.approx(16.6341e-3, rel=1e-5)
