"""End masses far lighter than their rod: right, and as cheap as a free end, over many echoes."""

from __future__ import annotations

import numpy as np
import pytest

from impactlab.contact.penalty import Penalty
from impactlab.exact.solve import solve
from impactlab.scene import End, Mass
from tests.reference.exact_scenes import FREE, HARD, point, rod, scene

TRIPS = 20.0
HAMMER = 0.5


def loaded(mass, law=None, length=1.0, left=FREE):
    """A hammer of half a rod's mass strikes a rod (Z = c = 1) with a mass at its far end."""
    hammer, bar = Mass("hammer", HAMMER, 1.0), rod(length=length, left=left, right=End("mass", value=mass))
    if mass == 0.0:
        bar = rod(length=length, left=left)
    return scene([hammer, bar], [(point(hammer), point(bar, "left"), 0.0, law or HARD)], 2.0 * TRIPS)


@pytest.mark.parametrize("law", [HARD, Penalty(3.0, 0.1)])
@pytest.mark.parametrize("mass", [1e-14, 1e-12, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-3])
def test_a_light_end_mass_does_not_stop_the_run(mass, law):
    history = solve(*loaded(mass, law))
    assert history.duration == 2.0 * TRIPS
    assert history.cost.steps < 1000
    book = history.energy
    assert np.max(np.abs(book.balance)) < 1e-12 * book.scale
    t = np.linspace(0.0, 2.0 * TRIPS, 81)
    momentum = history.evaluate(t, "momentum:hammer") + history.evaluate(t, "momentum:rod")
    assert momentum == pytest.approx(np.full(81, HAMMER), rel=1e-11)


@pytest.mark.parametrize("mass", [1e-14, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6])
def test_a_light_end_mass_lengthens_its_rod(mass):
    # the echo of a wave whose length is far above m/(rho A) is late by 2 m/Z, as from a rod longer by m/(rho A);
    # what is left is of the order of (m/(rho A L))**2 at every echo
    soft = Penalty(3.0, 0.1)
    one, other = solve(*loaded(mass, soft)), solve(*loaded(0.0, soft, 1.0 + mass))
    t = np.arange(0.25, 2.0 * TRIPS, 0.5)  # between the fronts, where layers have decayed
    for channel in ("position:hammer", "velocity:hammer", "displacement:rod@0.25", "velocity:rod@0.375"):
        assert one.evaluate(t, channel) == pytest.approx(other.evaluate(t, channel), rel=1e-9, abs=1e-9), channel
    assert len(one.contacts) == len(other.contacts) > 0
    for here, there in zip(one.contacts, other.contacts, strict=True):
        assert here.impulse == pytest.approx(there.impulse, rel=1e-9)
        assert here.end == pytest.approx(there.end, rel=1e-9)


@pytest.mark.parametrize("mass", [1e-14, 1e-12, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6])
def test_a_hard_contact_opens_within_the_echo_of_a_light_end_mass(mass):
    # the echo that comes back is -1 + 2 (1 - exp(-s/m)); the force v - 2 (echo) rises, falls and ends where it is zero
    history = solve(*loaded(mass))
    speed = np.exp(-2.0 / HAMMER)
    ends = np.log(2.0 / (1.0 - 0.5 * speed))
    more = (speed - 2.0) * ends + 4.0 * (1.0 - np.exp(-ends))
    (span,) = history.contacts
    assert span.end == pytest.approx(2.0 + ends * mass, rel=1e-11)
    assert span.impulse == pytest.approx(HAMMER * (1.0 - speed) + more * mass, rel=1e-11)
    pushed = span.impulse / HAMMER
    t = np.array([10.0, 39.9])
    free = HAMMER * (1.0 - speed) + (1.0 - pushed) * (t - 2.0)
    assert history.evaluate(t, "position:hammer") == pytest.approx(free, rel=1e-9)


@pytest.mark.parametrize("mass", [1e-10, 1e-9, 1e-6, 1e-3])
def test_the_first_echo_of_a_light_end_mass_is_the_closed_form(mass):
    # m v' = 2 Z f - Z v under the wave f = exp(-s/M) of the hammer, with M and m in units of Z s
    history = solve(*loaded(mass))
    since = np.concatenate([mass * np.array([0.2, 1.0, 3.0, 8.0, 20.0, 60.0]), [0.1, 0.5, 0.99]])
    t = 1.0 + since
    since = t - 1.0
    exact = 2.0 / (1.0 - mass / HAMMER) * (np.exp(-since / HAMMER) - np.exp(-since / mass))
    rounded = 1e-14 / mass  # of the layer: times have so many digits
    assert history.evaluate(t, "velocity:rod@1") == pytest.approx(exact, abs=1e-12 + rounded)


def test_light_masses_at_both_ends_conserve_momentum_in_contact():
    end = End("mass", value=1e-9)
    history = solve(*loaded(1e-9, Penalty(3.0, 0.1), left=end))
    bare = solve(*loaded(0.0, Penalty(3.0, 0.1)))
    t = np.arange(0.25, 2.0 * TRIPS, 0.5)
    assert history.evaluate(t, "position:hammer") == pytest.approx(bare.evaluate(t, "position:hammer"), abs=1e-7)
    momentum = history.evaluate(t, "momentum:hammer") + history.evaluate(t, "momentum:rod")
    assert momentum == pytest.approx(np.full(len(t), HAMMER), rel=1e-11)
    assert history.cost.steps < 2000


def bars_with_a_ball_between(mass):
    """A struck bar, a ball at its far end and a second bar behind a gap; without the ball the bars meet directly."""
    hammer, bar, ball, two = Mass("hammer", HAMMER, 1.0), rod(), Mass("ball", mass, 0.0), rod("two", 0.7)
    first = (point(hammer), point(bar, "left"), 0.0, HARD)
    if mass == 0.0:
        return scene([hammer, bar, two], [first, (point(bar, "right"), point(two, "left"), 0.1, HARD)], 20.0)
    near = (point(bar, "right"), point(ball), 0.0, HARD)
    return scene([hammer, bar, ball, two], [first, near, (point(ball), point(two, "left"), 0.1, HARD)], 20.0)


@pytest.mark.parametrize("mass", [1e-9, 1e-8, 1e-7, 1e-6, 1e-5])
def test_a_light_ball_between_two_bars_opens_and_closes_a_few_times_only(mass):
    history, direct = solve(*bars_with_a_ball_between(mass)), solve(*bars_with_a_ball_between(0.0))
    assert len(history.dated) < 30
    book = history.energy
    assert np.max(np.abs(book.balance)) < 1e-12 * book.scale
    t = np.array([3.3, 7.1, 12.7, 20.0])
    for channel in ("position:hammer", "momentum:two", "displacement:two@0.35", "displacement:rod@0.4"):
        assert history.evaluate(t, channel) == pytest.approx(direct.evaluate(t, channel), abs=100.0 * mass), channel
