"""Weights, pile drivers, dashpots, springs and masses at ends: smooth echoes."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pytest
from scipy.linalg import expm

from tests.cases.support import case_of, exact, times
from tests.reference.delay_equations import Past, State, solve_by_steps


def test_ram_cushion_pile() -> None:
    """Ram, cushion and cap on a face that answers with Z, until the wave from the toe returns: exp(A t)."""
    history = exact("ram_cushion_pile")
    z, k, d = 0.088 * (3.125e10 * 2500.0) ** 0.5, 8.0e8, 2.0e5
    a = np.zeros((4, 4))
    a[0, 2] = a[1, 3] = 1.0
    a[2], a[3] = np.array([-k, k, -d, d]) / 3000.0, np.array([k, -k, d, -d - z]) / 400.0
    for t in (5e-4, 2e-3, 6e-3):
        u1, u2, v1, v2 = expm(a * t) @ [0.0, 0.0, 4.0, 0.0]
        cushion = max(0.0, k * (u1 - u2) + d * (v1 - v2))
        assert history.evaluate([t], "velocity:ram")[0] == pytest.approx(v1, abs=1e-11)
        assert history.evaluate([t], "force:ram|cap")[0] == pytest.approx(cushion, rel=1e-9)
        assert history.evaluate([t], "force:pile@0")[0] == pytest.approx(z * v2, rel=1e-9)


def test_dead_weight_preload() -> None:
    """At rest until the hammer has fallen; then M g + Z v of the weight."""
    history = exact("dead_weight_preload")
    arrival = (-1.0 + 6.0**0.5) / 10.0
    assert times(history, "hammer|weight")[0] == pytest.approx(arrival, rel=1e-12)
    t = np.linspace(0.0, arrival - 1e-9, 9)
    assert history.evaluate(t, "force:weight|rod.left") == pytest.approx(20.0, rel=1e-10)
    assert history.evaluate(t, "force:rod@2") == pytest.approx(40.0, rel=1e-10)
    assert history.evaluate(t, "position:weight") == pytest.approx(0.0, abs=1e-12)
    t = arrival + np.linspace(0.002, 0.04, 5)
    v = history.evaluate(t, "velocity:weight")
    assert np.all(v > 0.0)
    assert history.evaluate(t, "force:weight|rod.left") == pytest.approx(20.0 + 20.0 * v, rel=1e-10)


def test_viscous_end() -> None:
    """0.6 of each wave returns: leaves at 1 + (1.2 + e^-2)/2.4 T with -1.2 exp(-(1.2 + e^-2)/1.2) v0."""
    history = exact("viscous_end")
    period = 2 * 0.3 / (2.1e11 / 7900.0) ** 0.5
    last = (1.2 + math.exp(-2.0)) / 2.4
    assert times(history, "hammer|rod.left")[1] / period == pytest.approx(1.0 + last, rel=1e-12)
    gone = float(history.evaluate((1.01 + last) * period, "velocity:hammer"))
    assert gone == pytest.approx(-1.2 * math.exp(-2.0 * last), rel=1e-12)


def test_ram_cushion_pile_after_the_reflection_at_the_toe() -> None:
    """The same with what the toe returns, (Z - D)/(Z + D) of the velocity sent: units 1 ms, 4 m/s, 1 kg."""
    history = exact("ram_cushion_pile")
    z, k, d = (0.088 * (3.125e10 * 2500.0) ** 0.5 * 1e-3, 8.0e8 * 1e-6, 2.0e5 * 1e-3)
    trip = 24.0 / (3.125e10 / 2500.0) ** 0.5 * 1e3
    back = (z - 388.9) / (z + 388.9)

    def arriving(t: float, past: Past) -> float:
        if t < trip:
            return 0.0
        here = arriving(t - trip, past)
        return back * ((past(t - trip)[3] - here) if past.mode(t - trip) else here)

    def cushion(y: State) -> float:
        return float(k * (y[0] - y[1]) + d * (y[2] - y[3]))

    def rate(t: float, y: State, mode: int, past: Past) -> list[float]:
        push = max(0.0, cushion(y))
        pile = z * (y[3] - 2.0 * arriving(t, past)) if mode else 0.0
        return [y[2], y[3], -push / 3000.0, (push - pile) / 400.0]

    def falls(t: float, y: State, mode: int, past: Past) -> float:
        if t < 1e-6:
            return 1.0
        return float(y[3] - 2.0 * arriving(t, past)) if mode else cushion(y)

    past, events = solve_by_steps(rate, [0.0, 0.0, 1.0, 0.0], 1, falls, [trip], 2.0 * trip, most=2)
    assert times(history, "cap|pile.left")[1] == pytest.approx(events[0] * 1e-3, rel=1e-9)
    assert times(history, "ram|cap")[1] == pytest.approx(events[1] * 1e-3, rel=1e-9)
    assert float(history.evaluate(history.duration, "velocity:ram")) == pytest.approx(
        4.0 * past(events[1])[2], rel=1e-9
    )
    t = np.linspace(0.0, events[0], 4001)
    forces = [cushion(past(s)) for s in t]
    # between instants 2 us apart a smooth force rises no further than this
    assert history.contacts[0].peak_force == pytest.approx(4.0e3 * max(forces), rel=1e-6)


FAR_ENDS: Mapping[str, tuple[float, float]] = {  # mass over T Z, spring over Z/T
    "": (1.0, 0.0),
    "/light": (0.25, 0.0),
    "/spring": (0.0, 2.0),
    "/stiff_spring": (0.0, 20.0),
}


@pytest.mark.parametrize("label", FAR_ENDS)
def test_far_end(label: str) -> None:
    """A delay differential equation in units T, v0, Z: hammer, its place, the face's, and what the far end does."""
    mass, spring = FAR_ENDS[label]
    lam, half = 2.0, 0.5

    def arriving(t: float, past: Past) -> float:
        t -= half
        if t < 0.0:
            return 0.0
        far, wave = past(t)[3], sent(t - half, past)
        return float(far if mass else 2.0 * wave - spring * far) - wave

    def sent(t: float, past: Past) -> float:
        if t < 0.0:
            return 0.0
        wave = arriving(t, past)
        return float(past(t)[0]) - wave if past.mode(t) else wave

    def rate(t: float, y: State, mode: int, past: Past) -> list[float]:
        wave, there = arriving(t, past), sent(t - half, past)
        force = y[0] - 2.0 * wave if mode else 0.0
        far = 2.0 * (2.0 * there - y[3]) / (2.0 * mass) if mass else 2.0 * there - spring * y[3]
        return [-lam * force, y[0], y[0] if mode else 2.0 * wave, far]

    def falls(t: float, y: State, mode: int, past: Past) -> float:
        # A gap that just opened is below the tolerance.
        return float(y[0] - 2.0 * arriving(t, past)) if mode else float(y[2] - y[1]) + 1e-12

    past, events = solve_by_steps(rate, [1.0, 0.0, 0.0, 0.0], 1, falls, [half, 2 * half], 3.0)
    history, trip = exact(f"far_end{label}"), case_of("far_end").scene().round_trip
    assert times(history, "hammer|rod.left")[1:] == pytest.approx([t * trip for t in events], rel=1e-9)
    for t in np.linspace(0.05, 2.95, 7):
        assert float(history.evaluate(t * trip, "velocity:hammer")) == pytest.approx(past(t)[0], abs=1e-8)


@pytest.mark.parametrize(("label", "k"), [("", 3.276e10), ("/tip", 1.036e10)])
def test_rounded_ends(label: str, k: float) -> None:
    """d' = 2 r - 2 l - (1/Z1 + 1/Z2) F with the echoes of F; units L1/c = 40 us, V, Z1 V."""
    unit, speed, z1, y2 = 4.0e-5, 2.0, 12000.0, 0.5
    hertz = k * (speed * unit) ** 1.5 / (z1 * speed)

    def force(d: float) -> float:
        return hertz * max(0.0, d) ** 1.5

    def waves(t: float, past: Past) -> float:
        striker = sum(force(past(t - 2.0 * n)[0]) for n in range(1, int(t / 2.0) + 1))
        target = sum(force(past(t - 5.0 * n)[0]) for n in range(1, int(t / 5.0) + 1))
        return 1.0 - 2.0 * striker - 2.0 * y2 * target

    def rate(t: float, y: State, mode: int, past: Past) -> list[float]:
        return [waves(t, past) - (1.0 + y2) * force(y[0]), force(y[0])]

    def falls(t: float, y: State, mode: int, past: Past) -> float:
        return float(y[0]) if mode and t > 1e-3 else 1.0

    past, events = solve_by_steps(rate, [0.0, 0.0], 1, falls, [2.0, 5.0], 7.5)
    [span] = exact(f"rounded_ends{label}").contacts
    # The reference is a converged one, told to 1e-6.
    assert span.end == pytest.approx(events[0] * unit, rel=1e-5)
    assert span.impulse == pytest.approx(float(past(7.5)[1]) * z1 * speed * unit, rel=1e-6)
    peak = max(force(past(t)[0]) for t in np.linspace(0.0, 5.0, 5001)) * z1 * speed
    assert span.peak_force == pytest.approx(peak, rel=2e-6)
    printed = {"": (15366.97, 169.5161, 1.441076), "/tip": (12231.46, 229.9371, 1.551394)}[label]
    assert printed == pytest.approx((peak, events[0] * 40.0, float(past(7.5)[1]) * z1 * speed * unit), rel=1e-6)


@pytest.mark.parametrize("label", ["", "/free", "/end_mass"])
def test_step_loaded_rod(label: str) -> None:
    """The end moves with F/Z and with what returns: twice the wave sent a trip before, times the far end's answer."""
    history = exact(f"step_loaded_rod{label}")
    z, trip = 36657.74133794934, case_of("step_loaded_rod").scene().round_trip
    speed = 1.0e4 / z

    def echo(s: float) -> float:
        """Return the displacement of the face by one echo, over F T/Z, s after it arrived."""
        if label == "":
            return -2.0 * s
        return 2.0 * s if label == "/free" else 2.0 * s - 2.0 * (1.0 - math.exp(-2.0 * s))

    for t in (0.3, 0.9, 1.4, 1.9):
        expected = speed * trip * (t + (echo(t - 1.0) if t > 1.0 else 0.0))
        assert float(history.evaluate(t * trip, "displacement:rod@0")) == pytest.approx(expected, rel=1e-11)
    if label:
        momentum = history.evaluate([0.7 * trip, 2.9 * trip], "momentum:rod")
        assert momentum == pytest.approx([0.7e4 * trip, 2.9e4 * trip], rel=1e-12)
    else:
        assert float(history.evaluate(trip, "displacement:rod@0")) == pytest.approx(31.74603e-6, rel=1e-6)
        felt = history.evaluate(np.array([0.4, 0.6, 1.4, 1.6, 2.4, 2.6]) * trip, "force:rod@0.3")
        assert felt == pytest.approx(1.0e4 * np.array([0, 2, 2, 0, 0, 2]), abs=1e-7)
    book = history.energy
    assert max(book.largest_gain, book.largest_loss) < 1e-12
