"""The beam cases by a second route: closed modes and a static rest, stepped by scipy (`beam_modes`).

The answers that the cases print come from meshes and from eigenvectors of meshes. Here a dozen modes move; what the
modes beyond would add to their static answer goes as (w/w_n)^2 of what the blow excites. Tolerances are those of the
digits printed, or where many contacts pass errors on, of twice the change seen when four modes more move.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import impactlab as il
from tests.cases import beam_modes
from tests.cases.beam_modes import Impact, impact, modes, struck
from tests.cases.known_numbers import when_largest
from tests.cases.support import case_of, exact

E, RHO, SIDE, SPEED = 2.157463e11, 7960.0, 0.01, 0.01  # of Timoshenko's spheres and beams


def sphere(length: float, radius: float, moving: int, duration: float) -> Impact:
    beam = struck(modes("pinned", RHO * SIDE**2 * length, E * SIDE**4 / 12.0, length, [length / 2.0], 200))
    stiffness = 4.0 / 3.0 * E / (2.0 * (1.0 - 0.3**2)) * radius**0.5
    mass = 4.0 / 3.0 * np.pi * radius**3 * RHO
    return impact(beam, moving, (stiffness, 1.5), duration, (mass, SPEED))


def agree(label: str, found: Impact, times: float, impulses: float, peaks: float) -> None:
    """Check starts and ends to ``times`` [s], impulses and peaks in shares, of all contacts."""
    spans = exact(label).contacts
    assert len(spans) == len(found.spans)
    for span, (start, end, impulse, peak) in zip(spans, found.spans, strict=True):
        assert span.start == pytest.approx(start, abs=times)
        if span.end is not None:
            assert span.end == pytest.approx(end, abs=times)
        assert span.impulse == pytest.approx(impulse, rel=impulses)
        assert span.peak_force == pytest.approx(peak, rel=peaks)


@pytest.mark.slow
def test_the_sphere_leaves_once() -> None:
    """The numbers of Timoshenko's first example, each to 1e-4; two routes agree to 1e-6."""
    found = sphere(0.1535, 0.01, 6, 2.0e-4)
    ((_, end, impulse, peak),) = found.spans
    assert peak == pytest.approx(4.9771, rel=1e-4)
    assert end == pytest.approx(156.40e-6, rel=1e-4)
    assert found.velocity == pytest.approx(-0.302324 * SPEED, rel=1e-4)
    assert found.peaks[0] == pytest.approx(72.6e-6, abs=0.05e-6)  # as printed: three digits
    history = exact("sphere_on_beam")
    agree("sphere_on_beam", found, 1e-6 * end, 1e-6, 2e-6)
    assert impulse == pytest.approx(history.contacts[0].impulse, rel=1e-6)
    # A force that is flat at its top: its time is known to the root of what its height is.
    seen = when_largest(history, "force:sphere|beam.at(0.07675)")
    assert seen == pytest.approx(found.peaks[0], abs=0.03e-6)


def test_twenty_modes_keep_the_numbers_of_the_sphere() -> None:
    """The case as written, each number to 1e-4, in one contact."""
    history = il.run(case_of("sphere_on_beam"))
    (span,) = history.contacts
    assert span.peak_force == pytest.approx(4.9771, rel=1e-4)
    assert span.end == pytest.approx(156.40e-6, rel=1e-4)
    assert history.evaluate([2.0e-4], "velocity:sphere")[0] == pytest.approx(-0.302324 * SPEED, rel=1e-4)


@pytest.mark.slow
def test_the_larger_sphere_strikes_three_times() -> None:
    found = sphere(0.307, 0.02, 8, 6.0e-3)
    agree("sphere_on_long_beam", found, 5e-9, 1e-5, 3e-5)
    assert found.velocity == pytest.approx(-0.97126 * SPEED, rel=1e-5)


def cantilever(place: float, law: tuple[float, float], moving: int, duration: float) -> Impact:
    beam = modes("cantilever", 7900.0 * 1e-4 * 0.3, 2.1e11 * 1e-8 / 12.0, 0.3, [place], 200)
    return impact(beam, moving, law, duration, (0.1, 1.0))


@pytest.mark.slow
def test_the_hammer_strikes_the_tip_eight_times() -> None:
    """Eight contacts pass each other's errors on: the last start is known to 12 ns, the impulses to 5e-4."""
    found = cantilever(0.3, (1.0e9, 1.5), 16, 8.0e-3)
    agree("mass_on_cantilever_tip", found, 2.5e-8, 5e-4, 1e-3)
    assert found.velocity == pytest.approx(-0.55498, abs=3e-5)


@pytest.mark.slow
@pytest.mark.parametrize(("label", "law"), [("", (1.0e6, 1.0)), ("/ball", (1.0e9, 1.5))])
def test_the_hammer_strikes_the_middle_twice(label: str, law: tuple[float, float]) -> None:
    found = cantilever(0.15, law, 14, 3.0e-3)
    agree(f"mass_on_cantilever_middle{label}", found, 1e-8, 1e-5, 3e-5)


@pytest.mark.slow
@pytest.mark.parametrize("theory", ["timoshenko", "euler_bernoulli"])
def test_the_short_beam_shears(theory: str) -> None:
    """Shear answers a force at a place at once over a short length: of 60 modes that move the rest is 1e-5."""
    b, h, length = 0.01, 0.02, 0.1
    mass, bending = RHO * b * h * length, E * b * h**3 / 12.0
    shear, rotary = 5.0 / 6.0 * E / 2.6 * b * h, RHO * b * h**3 / 12.0
    if theory == "timoshenko":
        beam = struck(beam_modes.timoshenko_pinned(mass, bending, shear, rotary, length, length / 2.0, 20_000))
    else:
        beam = struck(modes("pinned", mass, bending, length, [length / 2.0], 200))
    ball = 4.0 / 3.0 * np.pi * 0.01**3 * RHO
    stiffness = 4.0 / 3.0 * E / (2.0 * (1.0 - 0.3**2)) * 0.1
    found = impact(beam, 40 if theory == "timoshenko" else 6, (stiffness, 1.5), 2.0e-4, (ball, 0.1), samples=4001)
    label = "sphere_on_short_beam" + ("" if theory == "timoshenko" else "/euler_bernoulli")
    agree(label, found, 1e-9, 1e-5, 2e-5)
    assert exact(label).evaluate([2.0e-4], "velocity:sphere")[0] == pytest.approx(found.velocity, rel=1e-5)


@pytest.mark.slow
def test_the_tube_rattles() -> None:
    beam = modes("pinned_free", 8000.0 * 1.25e-4, 2.0e11 * 4.0e-9, 1.0, [1.0, 1.0], 300)
    walls: dict[str, Sequence[float]] = {"gaps": (5e-4, 5e-4), "upward": (1.0, -1.0)}
    found = impact(beam, 30, (1.0e6, 1.0), 2.0e-2, None, velocity=0.5, **walls)
    agree("tube_between_stops", found, 5e-7, 1e-3, 2e-3)


@pytest.mark.slow
def test_the_beam_falls_on_three_stops() -> None:
    beam = modes("free_free", 8000.0 * 2e-4, 2.0e11 * 0.02 * 0.01**3 / 12.0, 1.0, [0.2, 0.5, 0.8], 200)
    found = impact(
        beam, 24, (2.0e5, 1.0), 2.0e-2, None, (0.0, 1e-4, 3e-4), (1.0, 1.0, 1.0), gravity=-9.81, velocity=-0.5
    )
    agree("beam_on_three_stops", found, 1e-7, 1e-5, 1e-4)  # soft stops let go slowly


@pytest.mark.slow
def test_the_cantilever_falls() -> None:
    beam = modes("cantilever", 8000.0 * 2e-4, 2.0e11 * 0.02 * 0.01**3 / 12.0, 1.0, [1.0], 200)
    found = impact(beam, 16, (1.0e5, 1.0), 0.15, None, (4e-3,), gravity=-9.81, samples=40_001)
    agree("falling_cantilever", found, 1e-6, 1e-4, 1e-3)


@pytest.mark.slow
def test_the_rod_strikes_twice() -> None:
    """The rod is a delay line: its face goes v0 t - (P(t) + 2 P(t - T) + 2 P(t - 2T) + ...)/Z, P the impulse so far."""
    beam = struck(modes("pinned", 8000.0 * 1e-4 * 0.3, 2.0e11 * 1e-8 / 12.0, 0.3, [0.15], 200))
    impedance, trip, stiffness, duration, moving = 4000.0, 4.0e-5, 1.0e10, 1.0e-3, 12
    w2, row = beam.frequencies[:moving] ** 2, beam.rows[0, :moving]
    compliance = float(np.sum((beam.rows[0, moving:] / beam.frequencies[moving:]) ** 2))
    points = 200  # in a round trip, at which the sum P(t - T) + P(t - 2T) + ... and its slope are kept
    width = trip / points
    echoes, slopes = np.zeros(points + 1), np.zeros(points + 1)

    def echo(late: float) -> float:
        """Return that sum at a time since the round trip began: a cubic from point to point."""
        i = min(int(late / width), points - 1)
        s = late / width - i
        level = (1.0 + 2.0 * s) * (1.0 - s) ** 2 * echoes[i] + s * s * (3.0 - 2.0 * s) * echoes[i + 1]
        return float(level + width * s * (1.0 - s) * ((1.0 - s) * slopes[i] - s * slopes[i + 1]))

    def force(t: float, state: np.ndarray, began: float) -> float:
        free = t - (state[-1] + 2.0 * echo(t - began)) / impedance - row @ state[:moving]
        f = 0.0
        for _ in range(30 if free > 0.0 else 0):
            depth = max(free - compliance * f, 0.0)
            miss = f - stiffness * depth**1.5
            f -= miss / (1.0 + 1.5 * stiffness * depth**0.5 * compliance)
            if abs(miss) < 1e-9:
                break
        return f

    def rates(t: float, state: np.ndarray, began: float) -> np.ndarray:
        f = force(t, state, began)
        return np.concatenate((state[moving:-1], row * f - w2 * state[:moving], [f]))

    state, middle = np.zeros(2 * moving + 1), math.nan
    for n in range(round(duration / trip)):
        began = n * trip
        t = np.linspace(began, began + trip, points + 1)
        solved = solve_ivp(rates, t[[0, -1]], state, "DOP853", t, rtol=1e-8, atol=1e-14, args=(began,))
        state = solved.y[:, -1]
        forces = [force(time, each, began) for time, each in zip(t, solved.y.T, strict=True)]
        echoes, slopes = echoes + solved.y[-1], slopes + forces
        middle = state[-1] if n == 4 else middle  # of 200 us, between the contacts
    first, second = exact("rod_on_beam").contacts
    assert first.impulse == pytest.approx(middle, rel=3e-6)
    assert second.impulse == pytest.approx(state[-1] - middle, rel=3e-5)
    rod = float(exact("rod_on_beam").evaluate([duration], "momentum:rod")[0])
    assert rod == pytest.approx(0.08 - state[-1], rel=3e-5)
