"""The paper's scene over mass ratios: closed forms, the count of contacts, and contacts that barely happen."""

from __future__ import annotations

import math

import numpy as np
import pytest

from impactlab.exact.solve import solve
from impactlab.metrics.grazing import near_grazing
from impactlab.scene.facts import RoundTrip
from tests.reference.exact_scenes import CLAMPED, FREE, name_of, struck
from tests.reference.st_venant_mp import events

NAMED = [1e-2, 0.03, 0.1, 0.25, 0.5, 0.58, 0.75, 1.0, 1.02, 1.5, 3.0, 30.0, 300.0, 1e3]
DRAWN = [float(a) for a in 10.0 ** np.random.default_rng(1999).uniform(-1.6, 2.5, 10)]


def round_trips(alpha):
    """Long enough for all contacts: the mass turns within about half a period of sqrt(k/M)."""
    return 4.0 if alpha > 0.3 else 2.5 + 2.2 / math.sqrt(alpha)


def compare(alpha, far, duration):
    expected = events(alpha, duration, 1 if far is CLAMPED else -1)
    history = solve(*struck(alpha, 2.0 * duration, far))
    assert [event.kind for event in history.events] == [kind for _, kind, _ in expected]
    for event, (instant, _, velocity) in zip(history.events, expected, strict=True):
        assert event.time / 2.0 == pytest.approx(instant, abs=1e-10)
        assert float(history.evaluate(event.time, "velocity:hammer")) == pytest.approx(velocity, abs=1e-10)
    assert history.energy.largest_gain < 1e-12
    assert history.energy.largest_loss < 1e-12


@pytest.mark.parametrize("far", [CLAMPED, FREE], ids=["clamped", "free"])
@pytest.mark.parametrize("alpha", [*NAMED, *DRAWN])
def test_mass_ratios(alpha, far):
    compare(alpha, far, round_trips(alpha) if far is CLAMPED else 3.0)


@pytest.mark.slow
def test_heavy_mass():
    compare(1e-3, CLAMPED, 52.0)


def test_heavy_mass_on_a_free_rod():
    compare(1e-3, FREE, 3.0)


@pytest.mark.parametrize(("alpha", "count"), [(1.0106, 4), (1.0108, 2), (0.578591, 2), (0.578594, 4)])
def test_both_sides_of_the_edges(alpha, count):
    # PHYSICS: a second contact exists only for 0.578592 < alpha < 1.01070
    assert len(solve(*struck(alpha, 6.0)).events) == count


@pytest.mark.parametrize(
    ("alpha", "opening", "velocity", "closing", "second", "last"),
    [
        (0.25, 2.94979522, -0.816911552, 3.00107143, 3.32863219, -0.959266009),
        (1.0, 1.53383382080915, -0.687618939800652, 2.12462323494217, 2.16284275559957, -0.698875581996163),
    ],
)
def test_rows_with_two_contacts(alpha, opening, velocity, closing, second, last):
    history = solve(*struck(alpha, 8.0))
    times = [event.time / 2.0 for event in history.events]
    tolerance = 1e-8 if alpha == 0.25 else 2e-14  # digits the table gives
    assert times == pytest.approx([0.0, opening, closing, second], abs=tolerance)
    assert float(history.evaluate(2.0 * opening, "velocity:hammer")) == pytest.approx(velocity, abs=tolerance)
    assert float(history.evaluate(8.0, "velocity:hammer")) == pytest.approx(last, abs=tolerance)


@pytest.mark.parametrize(
    ("alpha", "opening", "velocity"),
    [(0.5, 2.35428362183386, -0.925246996732303), (1.5, 1.34163118, -0.717669334), (3.0, 1.16687323, -0.734847565)],
)
def test_rows_with_one_contact(alpha, opening, velocity):
    history = solve(*struck(alpha, 8.0))
    assert len(history.events) == 2
    assert history.events[1].time / 2.0 == pytest.approx(opening, abs=1e-8)
    assert float(history.evaluate(8.0, "velocity:hammer")) == pytest.approx(velocity, abs=1e-9)


def test_just_after_the_second_closing():
    history = solve(*struck(1.0, 6.0))
    force = float(history.evaluate(history.events[2].time, "force:hammer|rod.left"))
    assert force == pytest.approx(-0.191271752341 + 0.49634718746, abs=1e-11)


@pytest.mark.parametrize("alpha", [0.6, 1.0, 1.5, 3.0, 40.0, 1e3])
def test_first_opening_and_peak_in_closed_form(alpha):
    history = solve(*struck(alpha, 6.0))
    reach = 1.0 + math.exp(-2.0 * alpha) / 2.0
    assert history.events[1].time / 2.0 == pytest.approx(1.0 + reach / (2.0 * alpha), abs=1e-13)
    velocity = float(history.evaluate(history.events[1].time, "velocity:hammer"))
    assert velocity == pytest.approx(-2.0 * math.exp(-reach), abs=1e-12)
    assert history.contacts[0].peak_force == pytest.approx(2.0 + math.exp(-2.0 * alpha), abs=1e-13)


@pytest.mark.parametrize("alpha", [1e-3, 0.1, 1.0, 7.0, 100.0])
def test_free_rod_closed_forms(alpha):
    history = solve(*struck(alpha, 6.0, FREE))
    assert [event.time for event in history.events] == pytest.approx([0.0, 2.0], abs=1e-14)
    last = float(history.evaluate(6.0, "velocity:hammer"))
    assert last == pytest.approx(math.exp(-2.0 * alpha), abs=1e-13)
    rod_speed = float(history.evaluate(6.0, "momentum:rod")) / 1.0
    restitution = (1.0 - math.exp(-2.0 * alpha)) / alpha - math.exp(-2.0 * alpha)
    assert rod_speed - last == pytest.approx(restitution, abs=1e-12)


def test_the_face_and_the_middle_in_the_first_round_trip():
    # s = exp(-lam t/T) at the face; a place x sees it x/c later
    history = solve(*struck(1.0, 6.0))
    t = np.linspace(0.0, 1.9, 200)
    assert history.evaluate(t, f"force:{name_of(history)}") == pytest.approx(np.exp(-t), abs=1e-14)
    assert history.evaluate(t[t < 1.4], "stress:rod@0.5") == pytest.approx(
        np.where(t[t < 1.4] < 0.5, 0.0, np.exp(-(t[t < 1.4] - 0.5))), abs=1e-14
    )


@pytest.mark.parametrize("alpha", [0.98, 0.99, 1.0, 1.0106, 1.0108, 1.02, 1.03])
def test_fires_near_the_edge(alpha):
    history = solve(*struck(alpha, 6.0))
    assert [warned.code for warned in history.warnings] == ["near_grazing"]
    assert name_of(history) in history.warnings[0].text


@pytest.mark.parametrize("alpha", [0.7, 0.97, 1.04, 1.5])
def test_is_silent_away_from_it(alpha):
    assert solve(*struck(alpha, 6.0)).warnings == []


def test_contacts_of_less_than_three_steps_are_left_to_chance():
    history = solve(*struck(1.0, 6.0))
    assert near_grazing(history, name_of(history), RoundTrip(2.0, "rod"), dt=0.02) is not None
    assert near_grazing(history, name_of(history), RoundTrip(2.0, "rod"), dt=0.03) is None
