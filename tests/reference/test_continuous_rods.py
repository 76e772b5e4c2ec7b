"""Other scenes with answers in closed form: two rods, walls, springs, dashpots, end masses, gravity, profiles."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from mpmath import mp, mpf

from impactlab.contact.penalty import Penalty
from impactlab.errors import CaseError, PairingError
from impactlab.exact.march import march, prepared
from impactlab.exact.results.history import ContinuousHistory
from impactlab.exact.setup import build, network
from impactlab.exact.solve import serves, solve
from impactlab.scene import End, Mass, Segment, Table, Wall
from tests.reference.exact_scenes import CLAMPED, FREE, HARD, point, rod, scene, struck


def times(history):
    return [event.time for event in history.events]


def two_rods(l1, l2, z2, duration=10.0, v=1.0):
    a, b = rod("a", l1, 1.0, velocity=v), rod("b", l2, z2)
    return scene([a, b], [(point(a, "right"), point(b, "left"), 0.0, HARD)], duration)


@pytest.mark.parametrize("l2", [1.5, 2.0, 3.7])
def test_equal_impedance_opens_when_the_short_rod_is_spent(l2):
    # force Z v/2 up to 2 L1/c; then the faces rest on each other without force: that is open
    history = solve(*two_rods(1.0, l2, 1.0))
    assert [event.kind for event in history.events] == ["close", "open"]
    assert times(history) == pytest.approx([0.0, 2.0], abs=1e-13)
    assert history.contacts[0].peak_force == pytest.approx(0.5, abs=1e-15)
    assert history.contacts[0].impulse == pytest.approx(1.0, abs=1e-14)
    assert float(history.evaluate(9.0, "momentum:b")) == pytest.approx(1.0, abs=1e-13)
    assert float(history.evaluate(9.0, "momentum:a")) == pytest.approx(0.0, abs=1e-13)


@pytest.mark.parametrize("z2", [2.0, 3.0, 10.0])
def test_short_light_rod_on_a_long_heavy_one(z2):
    # v = Z1 V/(Z1+Z2) at once, force Z2 v; after the reflection from the free end the faces would need to pull
    history = solve(*two_rods(1.0, 50.0, z2, 10.0))
    assert times(history) == pytest.approx([0.0, 2.0], abs=1e-13)
    assert history.contacts[0].peak_force == pytest.approx(z2 / (1.0 + z2), abs=1e-14)
    final = float(history.evaluate(9.0, "momentum:a"))
    assert final == pytest.approx(1.0 - 2.0 * z2 / (1.0 + z2), abs=1e-13)


def test_staircase_of_a_heavy_short_rod_on_a_long_light_one():
    # wave of round trip n: R -> after each reflection the force is multiplied by (Z1-Z2)/(Z1+Z2)
    z1, z2 = 1.0, 0.25
    history = solve(*two_rods(1.0, 50.0, z2, 10.0))
    ratio = (z1 - z2) / (z1 + z2)
    for n in range(5):
        force = float(history.evaluate(2.0 * n + 1.0, "force:a.right|b.left"))
        assert force == pytest.approx(z1 * z2 / (z1 + z2) * ratio**n, abs=1e-14)
    assert [event.kind for event in history.events] == ["close"]


@pytest.mark.parametrize("mirrored", [False, True])
def test_rod_on_a_wall_stays_two_transits_and_leaves_as_it_came(mirrored):
    wall, bar = Wall("wall"), rod(length=1.5, velocity=1.0 if mirrored else -1.0)
    pair = (point(bar, "right"), point(wall)) if mirrored else (point(wall), point(bar, "left"))
    history = solve(*scene([wall, bar], [(*pair, 0.25, HARD)], 6.0))
    assert times(history) == pytest.approx([0.25, 3.25], abs=1e-13)
    assert history.contacts[0].peak_force == pytest.approx(1.0, abs=1e-15)
    away = -1.0 if mirrored else 1.0
    for x in (0.0, 0.4, 1.5):
        assert float(history.evaluate(5.0, f"velocity:rod@{x:.6g}")) == pytest.approx(away, abs=1e-14)
    assert float(history.evaluate(6.0, f"gap:{history.scene.contacts[0].name}")) == pytest.approx(2.75, abs=1e-13)


def test_free_rod_flies_unstrained():
    history = solve(*scene([rod(velocity=0.7)], [], 10.0))
    assert history.events == ()
    assert float(history.evaluate(10.0, "displacement:rod@0.3")) == pytest.approx(7.0, abs=1e-13)
    assert float(history.evaluate(9.0, "stress:rod@0.3")) == 0.0


def test_cosine_profile_is_a_standing_wave():
    bar = rod(displacement=lambda x: 1e-3 * np.cos(np.pi * x))
    history = solve(*scene([bar], [], 400.0))
    t = np.linspace(0.0, 400.0, 1001)
    for x in (0.0, 0.2, 1.0):
        expected = 1e-3 * np.cos(np.pi * x) * np.cos(np.pi * t)
        assert history.evaluate(t, f"displacement:rod@{x:.6g}") == pytest.approx(expected, abs=2e-14)
    assert history.energy.largest_gain < 1e-12


def test_plucked_rod_keeps_its_kink():
    # held at both ends, pulled in the middle: at half a period the triangle is upside down
    bar = rod(left=CLAMPED, right=CLAMPED, displacement=lambda x: 1e-3 * np.minimum(x / 0.3, (1.0 - x) / 0.7))
    history = solve(*scene([bar], [], 20.0))
    x = history.field("rod", 1.0, "displacement").x
    triangle = 1e-3 * np.minimum((1.0 - x) / 0.3, x / 0.7)
    assert history.field("rod", 1.0, "displacement").values == pytest.approx(-triangle, abs=1e-15)
    assert history.field("rod", 20.0, "displacement").values == pytest.approx(triangle[::-1], abs=1e-15)


@pytest.mark.parametrize(("kappa", "peak"), [(1.0, 0.546293), (4.0, 2.0 / math.e), (0.3, None)])
def test_spring_contact_before_the_reflection(kappa, peak):
    # mass 1 on a half-infinite rod with Z = 1: k = kappa; F'' + kappa F' + kappa F = 0, F(0) = 0, F'(0) = kappa
    bar = rod(length=30.0)
    hammer = Mass("hammer", 1.0, 1.0)
    history = solve(*scene([hammer, bar], [(point(hammer), point(bar, "left"), 0.0, Penalty(kappa))], 50.0))
    t = np.linspace(0.0, history.contacts[0].end or 50.0, 300)[:-1]
    root = np.sqrt(complex(kappa * kappa / 4.0 - kappa))
    shape = t if root == 0 else (np.sinh(root * t) / root).real
    expected = kappa * np.exp(-kappa * t / 2.0) * shape
    assert history.evaluate(t, "force:hammer|rod.left") == pytest.approx(expected, abs=2e-13)
    if peak is not None:
        assert history.contacts[0].peak_force == pytest.approx(peak, abs=5e-7)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


@pytest.mark.parametrize("damping", [0.1, 2.0, 50.0])
def test_damped_contact_books_its_loss(damping):
    history = solve(*struck(1.0, 12.0, law=Penalty(20.0, damping)))
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12
    assert np.all(np.diff(history.energy.booked["contact"]) >= -1e-15)
    assert history.energy.booked["contact"][-1] > 1e-3


def test_stiff_contact_comes_near_the_hard_one():
    hard = solve(*struck(1.5, 6.0))
    stiff = solve(*struck(1.5, 6.0, law=Penalty(1e4, 10.0)))
    assert float(stiff.evaluate(6.0, "velocity:hammer")) == pytest.approx(
        float(hard.evaluate(6.0, "velocity:hammer")), abs=2e-3
    )


def test_dashpot_of_the_impedance_absorbs_everything():
    history = solve(*struck(1.0, 20.0, End("dashpot", 1.0)))
    t = np.linspace(0.0, 20.0, 100)
    assert history.evaluate(t, "velocity:hammer") == pytest.approx(np.exp(-t), abs=1e-13)
    assert [event.kind for event in history.events] == ["close"]
    book = history.energy
    assert book.booked["ends"][-1] == pytest.approx(0.5, abs=1e-13)
    assert max(book.largest_gain, book.largest_loss) < 1e-12


def test_spring_end_reflects_with_its_relaxation_time():
    # a step wave 1/2 + 1/2 on a spring end: Z u' + k u = 2 Z r gives v = 2 r exp(-k t/Z)
    k = 3.0
    bar = rod(right=End("spring", k), velocity=1.0)
    history = solve(*scene([bar], [], 8.0))
    t = np.linspace(0.0, 0.99, 40)
    assert history.evaluate(t, "velocity:rod@1") == pytest.approx(np.exp(-k * t), abs=1e-13)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


def unbroken(lam, trips):
    """Velocity of a mass on a clamped rod at whole round trips, polynomials times exp(-lam y), in T, 80 digits."""
    with mp.workdps(40 + trips):
        lam = mpf(lam)
        q, vm, out = [mpf(0)], mpf(1), []
        for _ in range(trips):
            v = [vm] + [-2 * lam * a / (k + 1) for k, a in enumerate(q)]
            p = [a + (q[k] if k < len(q) else 0) for k, a in enumerate(v)]
            # the emitted wave comes back one round trip later, at the same y, unchanged at a clamped end
            vm = sum(v) * mp.e ** (-lam)
            out.append(float(vm))
            q = p
        return out


@pytest.mark.parametrize("lam", [2.0, 20.0])
def test_end_mass_for_200_round_trips(lam):
    # the rod is at rest, its end mass starts: a striker glued to the rod. v at the start of the rod is that of the mass
    mass = 2.0 / lam
    hammer = End("mass", mass)
    clamped = rod(left=hammer, right=CLAMPED)
    bar = scene([clamped], [], 401.0)
    layout, log = build.build(*bar)
    log.nodes["v"][layout.nodes["rod"][0]] = 1.0
    log.state["fastest"] = 1.0
    log = prepared(log)
    while status := march(log):
        log = network.grown(log, status)
    history = ContinuousHistory(bar, layout, log, 401.0)
    t = 2.0 * np.arange(1, 201)
    assert history.evaluate(t, "velocity:rod@0") == pytest.approx(unbroken(lam, 200), abs=1e-9)


def test_mass_and_rod_fall_together_until_the_wave_from_the_dashpot_arrives():
    bar = rod(left=FREE, right=End("dashpot", 1.0))
    hammer = Mass("hammer", 1.0)
    history = solve(*scene([hammer, bar], [(point(hammer), point(bar, "left"), 0.0, HARD)], 60.0, gravity=0.1))
    # no force before; then the wave brings the faces together with a gap that starts as -(t - 1)^2
    assert times(history) == pytest.approx([1.0], abs=1e-12)
    # all falls at the speed at which the dashpot carries the weight of both
    assert float(history.evaluate(60.0, "velocity:hammer")) == pytest.approx(0.2, abs=1e-9)
    assert float(history.evaluate(60.0, "force:hammer|rod.left")) == pytest.approx(0.1, abs=1e-9)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-11


def test_hanging_rod_swings_about_its_static_shape():
    # clamped at the left, gravity along the rod: u = g (L x - x^2/2)/c^2 at rest; from rest it reaches twice that
    history = solve(*scene([rod(left=CLAMPED)], [], 8.0, gravity=0.1))
    field = history.field("rod", 2.0, "displacement")
    assert field.values == pytest.approx(2.0 * 0.1 * (field.x - field.x**2 / 2.0), abs=1e-14)
    assert history.field("rod", 4.0, "displacement").values == pytest.approx(np.zeros(401), abs=1e-14)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


def test_two_segments_pass_and_reflect_at_their_boundary():
    bar = replace(rod(), segments=(Segment(1.0, 1.0, 1.0, 1.0), Segment(1.0, 1.0, 9.0, 1.0)))  # Z 1 then 3, c 1 then 3
    wall = Wall("wall")
    moving = replace(bar, velocity=-1.0)
    history = solve(*scene([wall, moving], [(point(wall), point(bar, "left"), 0.0, HARD)], 1.2))
    # stress 1 arrives at the boundary at t = 1 and is passed with 2 Z2/(Z1+Z2) = 3/2
    assert float(history.evaluate(1.05, "stress:rod@0.999")) == pytest.approx(1.5, abs=1e-13)
    assert float(history.evaluate(1.05, "stress:rod@1.001")) == pytest.approx(1.5, abs=1e-13)


def test_refusals_name_path_and_remedy():
    a, b, wall = Mass("a", 1.0), Mass("b", 1.0), Wall("wall")
    bar = rod(left=End("mass", 1.0))
    for bodies, pair, gap, law, error, path, word in (
        ([a, b], (point(a), point(b)), 0.0, HARD, CaseError, "bodies", "no rod"),
        ([a, wall, rod()], (point(a), point(wall)), 0.0, HARD, CaseError, "contacts.0", "both faces have mass"),
        ([a, bar], (point(a), point(bar, "left")), 0.0, HARD, CaseError, "contacts.0", "both faces have mass"),
        (
            [wall, rod()],
            (point(wall), point(wall)),
            0.0,
            Penalty(1.0),
            CaseError,
            "contacts.0",
            "neither side can move",
        ),
        ([a, rod()], (point(a), point(rod(), "left")), -0.1, HARD, CaseError, "contacts.0.gap", "in a hard contact: 0"),
        ([a, rod()], (point(a), point(rod(), "left")), 0.0, Penalty(math.nan), PairingError, "contacts.0.law", "hard"),
    ):
        wrong = scene(bodies, [(*pair, gap, law)], 1.0)
        with pytest.raises(error, match=word) as caught:
            solve(*wrong)
        assert caught.value.path == path
        assert caught.value.remedy
        assert word in (serves(*wrong) or "")
    assert serves(*struck(1.0, 1.0)) is None


def test_a_profile_that_jumps_or_tears_is_refused():
    with pytest.raises(CaseError, match="jumps"):
        solve(*scene([rod(displacement=lambda x: np.where(x < 0.4, 0.0, 1.0))], [], 1.0))
    with pytest.raises(CaseError, match="clamped left"):
        solve(*scene([rod(left=CLAMPED, displacement=np.cos)], [], 1.0))


def test_a_run_that_ends_in_contact_has_an_open_span():
    history = solve(*struck(1.0, 1.5))
    (span,) = history.contacts
    assert span.end is None
    assert span.impulse == pytest.approx(1.0 - math.exp(-1.5), abs=1e-14)


def test_a_narrow_bump_of_a_table_is_not_missed():
    # 1e-4 of the rod, between the places that a search for kinks would look at
    bump = Table((0.0, 0.4001, 0.40015, 0.4002, 1.0), (0.0, 0.0, 1e-4, 0.0, 0.0))
    history = solve(*scene([rod(displacement=bump)], [], 2.0))
    # half of it runs to each end, where a free end doubles it
    assert history.evaluate([0.40015, 0.59985], "displacement:rod@0")[0] == pytest.approx(1e-4, abs=1e-15)
    assert history.evaluate([0.59985], "displacement:rod@1")[0] == pytest.approx(1e-4, abs=1e-15)
    assert float(history.energy.total[0]) == pytest.approx(0.5 * 2 * 2.0**2 * 5e-5, rel=1e-9)
