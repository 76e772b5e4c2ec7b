"""Rods that meet walls, and rods that nothing holds: plain waves, so closed forms by hand."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import lambertw

from impactlab.scene import Rod
from tests.cases.support import case_of, exact, times
from tests.reference.wave_tracer import Piece, trace


def test_free_rod() -> None:
    """PHYSICS 1: a free rod opens exactly at T for every alpha; vm = e^(-2 alpha), here alpha = 1."""
    history = exact("free_rod")
    scene = case_of("free_rod").scene()
    assert [event.kind for event in history.events] == ["close", "open"]
    assert history.events[1].time == pytest.approx(scene.round_trip, rel=1e-12)
    hammer = float(history.evaluate(history.duration, "velocity:hammer"))
    assert hammer == pytest.approx(2.718281828459045**-2, rel=1e-12)


def test_rod_on_wall() -> None:
    """The bar leaves after 2 L/c with the speed it came with; the force is Z v0 throughout."""
    history = exact("rod_on_wall")
    scene = case_of("rod_on_wall").scene()
    [contact] = history.contacts
    assert contact.end is not None
    assert contact.end - contact.start == pytest.approx(scene.round_trip, rel=1e-12)
    [rod] = [body for body in scene.bodies.values() if isinstance(body, Rod)]
    assert contact.impulse == pytest.approx(2.0 * rod.mass * abs(rod.velocity), rel=1e-12)
    assert contact.peak_force == pytest.approx(rod.segments[0].impedance * abs(rod.velocity), rel=1e-12)


def test_bouncing_bar() -> None:
    """Doyen, Ern and Piperno's bar: contacts at 1 + 8k/3 s for 2/3 s, 300 + 300 t' and 500 - 300 t' N in turn."""
    history = exact("bouncing_bar")
    starts = 1.0 + 8.0 / 3.0 * np.arange(3)
    assert times(history, "wall|bar.left") == pytest.approx(np.sort([*starts, *(starts + 2.0 / 3.0)]), abs=1e-12)
    assert [span.impulse for span in history.contacts] == pytest.approx([800.0 / 3.0] * 3, rel=1e-12)
    late = np.array([0.1, 0.5])
    for k, start in enumerate(starts):
        force = 500.0 - 300.0 * late if k % 2 else 300.0 + 300.0 * late
        assert history.evaluate(start + late, "force:wall|bar.left") == pytest.approx(force, rel=1e-12)


def test_rod_between_walls() -> None:
    """Contacts of T, flights of 300 us, right and left in turn."""
    history = exact("rod_between_walls")
    trip = 1.0 / (2.0e11 / 7800.0) ** 0.5
    starts = 2.0e-4 + (3.0e-4 + trip) * np.arange(len(history.contacts))
    assert [span.start for span in history.contacts] == pytest.approx(starts, rel=1e-12)
    assert [span.contact for span in history.contacts[:3]] == ["rod.right|right", "left|rod.left", "rod.right|right"]
    assert history.contacts[1].end == pytest.approx(starts[1] + trip, rel=1e-12)


def test_periodic_bar() -> None:
    """Contacts from 1 + 3k to 2 + 3k with force 1/2; the end moves to and fro with 1/2."""
    history = exact("periodic_bar")
    assert times(history, "obstacle|bar.left") == pytest.approx([1, 2, 4, 5, 7, 8, 10, 11], abs=1e-12)
    assert [span.impulse for span in history.contacts] == pytest.approx([0.5] * 4, rel=1e-12)
    assert history.evaluate([0.0, 0.5, 1.5, 2.5, 3.0], "displacement:bar@0") == pytest.approx(
        [0.5, 0.25, 0.0, 0.25, 0.5], abs=1e-14
    )
    assert history.energy.total[0] == pytest.approx(0.125, rel=1e-12)


@pytest.mark.parametrize(("label", "q"), [("", 4.0), ("/soft", 1.0), ("/stiff", 40.0)])
def test_rod_on_spring_wall(label: str, q: float) -> None:
    """u' + q u = 2 r, r = 1/2 and then what came back: e^(-q y) (2 - e^(-q) + 2 q y) - 1 in the second interval."""
    history = exact(f"rod_on_spring_wall{label}")
    trip, full, name = 2.0e-4, 8000.0, "rod.right|wall"
    t = np.array([0.1, 0.5, 0.99])
    assert history.evaluate(t * trip, f"force:{name}") == pytest.approx(full * (1.0 - np.exp(-q * t)), rel=1e-11)

    def second(y: float) -> float:
        return full * (math.exp(-q * y) * (2.0 - math.exp(-q) + 2.0 * q * y) - 1.0)

    for y in (0.01, 0.03):
        assert float(history.evaluate((1.0 + y) * trip, f"force:{name}")) == pytest.approx(second(y), rel=1e-10)
    # largest where e^(-q) = 2 q y
    assert history.contacts[0].peak_force == pytest.approx(second(math.exp(-q) / (2.0 * q)), rel=1e-10)
    if q > 2.0:
        # e^z = a + 2 z with z = q y: z = -a/2 - W(-e^(-a/2)/2) on the lower branch
        a = 2.0 - math.exp(-q)
        y = (-a / 2.0 - lambertw(-math.exp(-a / 2.0) / 2.0, -1).real) / q
        assert times(history, name) == pytest.approx([0.0, (1.0 + y) * trip], rel=1e-11)


def test_rod_on_spring_wall_soft_in_its_third_interval() -> None:
    """Two echoes: u' + u = 2 r with r = 1/2, -1/2 + e^-y, then that echo's echo; units T, v0 (q = 1)."""
    u1 = 1.0 - math.exp(-1.0)
    u2 = math.exp(-1.0) * (u1 + 2.0) - (1.0 - math.exp(-1.0))  # at 2 T
    # On the second interval the face sends u' - r, r = e^-y - 1/2; that is what comes back on the third.
    # u = e^-y (u1 + 1 + 2 y) - 1, u' = e^-y (1 - u1 - 2 y), so r3 = e^-z (-u1 - 2 z) + 1/2 and
    # u' + u = 2 r3: u = 1 + e^-z (u2 - 1 - 2 u1 z - 2 z^2).

    def third(z: float) -> float:
        return 1.0 + math.exp(-z) * (u2 - 1.0 - 2.0 * u1 * z - 2.0 * z * z)

    z = brentq(third, 1e-3, 1.0, xtol=1e-15)
    history = exact("rod_on_spring_wall/soft")
    assert times(history, "rod.right|wall")[1] == pytest.approx((2.0 + z) * 2.0e-4, rel=1e-11)


def test_sub_step_double_touch() -> None:
    """The ripple as steps of velocity, traced in fractions; the wall is where the rod's mirror image would stand.

    Unit of length 0.25 mm, so of time 50 ns; 2000 of them in the rod, three of them the ripple's.
    """
    history = exact("sub_step_double_touch")
    # from the far end to the face: length, c times the strain over v0
    waves = [(1997, Fraction(0)), (1, Fraction(2)), (1, Fraction(-2)), (1, Fraction(0))]
    image = [Piece(Fraction(n), Fraction(1), Fraction(1), wave) for n, wave in waves]
    pieces = [Piece(Fraction(n), Fraction(1), Fraction(-1), wave) for n, wave in reversed(waves)]
    events, forces = trace([*image, *pieces], [None, None, None, Fraction(0), None, None, None], Fraction(4100))
    assert len(events) == 6
    expected = [float(time) * 5.0e-8 for time, _, _ in events]
    assert times(history, "wall|rod.left") == pytest.approx(expected, abs=1e-15)
    assert expected[1:3] == pytest.approx([5.0e-8, 3.5e-7 / 3.0])
    for start, force in forces[3]:
        seen = float(history.evaluate((float(start) + 0.1) * 5.0e-8, "force:wall|rod.left"))
        assert seen == pytest.approx(8000.0 * float(force), abs=1e-6)
    assert sum(span.impulse for span in history.contacts) == pytest.approx(1.6, rel=1e-12)
