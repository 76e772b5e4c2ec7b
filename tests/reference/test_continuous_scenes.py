"""The scenes the field meets, on the continuous model, each against an answer found without the solver.

Rows of rods are held against square waves traced in rational arithmetic (`wave_tracer`), masses and springs against
closed forms or matrix exponentials, the rest against d'Alembert's waves. Units: c = 1 where nothing else is said.
"""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction as Q
from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import expm

from impactlab.contact.penalty import Penalty
from impactlab.errors import CaseError
from impactlab.exact.solve import serves, solve
from impactlab.scene import End, Mass, Point, Rod, Segment, Wall
from tests.reference.exact_scenes import CLAMPED, FREE, HARD, point, rod, scene
from tests.reference.wave_tracer import Piece, trace

# ---- rods in a row -------------------------------------------------------------------------------------------------


def in_a_row(rods, gaps, duration, left=Q(0), right=Q(0)):
    """Return the history of rods in a row, and its events and forces as traced.

    rods: lists of (transit, impedance) and a velocity; gaps between neighbours. The ends of the row are dashpots.
    """
    pieces, spaces = [], []
    bodies, contacts = [], []
    for i, (parts, velocity) in enumerate(rods):
        for k, (transit, impedance) in enumerate(parts):
            pieces.append(Piece(transit, impedance, velocity))
            spaces.append(None if k + 1 < len(parts) else gaps[i] if i < len(gaps) else None)
        outer = [left if i == 0 else Q(0), right if i + 1 == len(rods) else Q(0)]
        held = [CLAMPED if d is None else End("dashpot", float(d)) if d else FREE for d in outer]
        # area 1; the speed differs from part to part and drops out of all that is compared
        segments = []
        for k, (transit, impedance) in enumerate(parts):
            c = 1.0 + 0.5 * k
            segments.append(Segment(float(transit) * c, 1.0, float(impedance) * c, float(impedance) / c))
        bodies.append(Rod(f"r{i}", tuple(segments), *held, float(velocity)))
    for i, gap in enumerate(gaps):
        contacts.append((point(bodies[i], "right"), point(bodies[i + 1], "left"), float(gap), HARD))
    history = solve(*scene(bodies, contacts, float(duration)))
    traced = trace(pieces, spaces[:-1], duration, left, right)
    return history, traced, [i for i, gap in enumerate(spaces[:-1]) if gap is not None]


def assert_same(history, traced, joints, duration):
    """Events to 1e-12, forces to 1e-12 of the impedances, in the middle of every stair."""
    events, forces = traced
    for contact, joint in zip(history.scene.contacts, joints, strict=True):
        mine = [(e.kind, e.time) for e in history.events if e.contact == contact.name]
        exact = [(kind, float(t)) for t, j, kind in events if j == joint]
        assert [kind for kind, _ in mine] == [kind for kind, _ in exact], contact.name
        assert [t for _, t in mine] == pytest.approx([t for _, t in exact], abs=1e-12)
        stairs = [*forces[joint], (duration, 0)]
        for (start, force), (stop, _) in pairwise(stairs):
            if stop - start > Q(1, 10**6):
                seen = float(history.evaluate(float((start + stop) / 2), f"force:{contact.name}"))
                assert seen == pytest.approx(float(force), abs=1e-12)


ROWS = {
    "equal rods": ([([(Q(1), Q(1))], Q(1)), ([(Q(1), Q(1))], Q(0))], [Q(1, 3)], Q(0), Q(0)),
    "any lengths and impedances": ([([(Q(7, 5), Q(3))], Q(2)), ([(Q(17, 12), Q(5, 7))], Q(-1))], [Q(2, 9)], Q(0), Q(0)),
    "hopkinson": (
        [([(Q(1, 2), Q(1))], Q(1)), ([(Q(3), Q(1))], Q(0)), ([(Q(5, 2), Q(1))], Q(0))], [Q(1, 10), Q(0)], Q(0), Q(0),
    ),
    "hopkinson with a specimen": (
        [([(Q(1, 2), Q(1))], Q(1)), ([(Q(3), Q(1))], Q(0)), ([(Q(1, 9), Q(1, 5))], Q(0)), ([(Q(5, 2), Q(1))], Q(0))],
        [Q(1, 10), Q(0), Q(0)], Q(0), Q(0),
    ),
    "six bars with gaps": (
        [([(Q(1, k + 2), Q(k + 1, 3))], Q(2) if k == 0 else Q(0)) for k in range(6)],
        [Q(0), Q(1, 7), Q(0), Q(1, 5), Q(1, 11)], Q(0), Q(0),
    ),
    "two materials on a wall": ([([(Q(1), Q(1)), (Q(3, 7), Q(4))], Q(1)), ([(Q(1), Q(1))], Q(0))], [Q(1)], Q(0), None),
    "three steps": (
        [([(Q(1), Q(1)), (Q(1, 3), Q(9, 4)), (Q(1, 2), Q(4))], Q(1)), ([(Q(2), Q(3))], Q(0))], [Q(0)], Q(0), Q(0),
    ),
    "viscous ends": ([([(Q(1), Q(1))], Q(1)), ([(Q(8, 5), Q(2))], Q(-1, 2))], [Q(1, 4)], Q(1, 3), Q(7, 2)),
    "a clamp at the end": ([([(Q(2, 3), Q(1))], Q(1)), ([(Q(1), Q(2)), (Q(1, 2), Q(1))], Q(0))], [Q(1, 4)], Q(0), None),
}  # fmt: skip


@pytest.mark.parametrize("name", ROWS)
def test_rods_in_a_row(name):
    rods, gaps, left, right = ROWS[name]
    duration = Q(12)
    history, traced, joints = in_a_row(rods, gaps, duration, left, right)
    assert traced[0]
    assert_same(history, traced, joints, duration)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


def test_equal_rods_swap_their_velocities():
    history, _, _ = in_a_row([([(Q(1), Q(2))], Q(3)), ([(Q(1), Q(2))], Q(-1))], [Q(0)], Q(6))
    # closed for 2 L/c; afterwards both fly unstrained, each with the velocity of the other
    assert [e.time for e in history.events] == pytest.approx([0.0, 2.0], abs=1e-14)
    for body, velocity in (("r0", -1.0), ("r1", 3.0)):
        for x in (0.1, 0.9):
            assert float(history.evaluate(5.0, f"velocity:{body}@{x}")) == pytest.approx(velocity, abs=1e-14)
            assert float(history.evaluate(5.0, f"stress:{body}@{x}")) == pytest.approx(0.0, abs=1e-14)


def test_hopkinson_bar_transmits_by_its_impedances():
    # striker and incident bar of Z1 = 1, transmission bar of Z2 = 4: a pulse of V Z1/2 that lasts 2 L/c of the striker;
    # 2 Z2/(Z1 + Z2) of it passes, (Z2 - Z1)/(Z1 + Z2) returns
    history, _, _ = in_a_row(
        [([(Q(1, 2), Q(1))], Q(2)), ([(Q(4), Q(1))], Q(0)), ([(Q(4), Q(4))], Q(0))], [Q(0), Q(0)], Q(7)
    )
    assert history.evaluate([2.1, 2.9], "force:r1@2") == pytest.approx([1.0, 1.0], abs=1e-14)
    assert history.evaluate([1.9, 3.1], "force:r1@2") == pytest.approx([0.0, 0.0], abs=1e-14)
    assert history.evaluate([4.1, 4.9], "force:r1.right|r2.left") == pytest.approx([1.6, 1.6], abs=1e-14)
    assert history.evaluate([6.1, 6.9], "force:r1@2") == pytest.approx([0.6, 0.6], abs=1e-14)
    assert history.evaluate([5.1, 5.9], "force:r2@1") == pytest.approx([1.6, 1.6], abs=1e-14)


def test_irrational_travel_times():
    # lengths sqrt 2, pi, e: the traced row has the same times as fractions good to 1e-15
    lengths = [math.sqrt(2.0), math.pi, math.e]
    rods = [([(Q(x), Q(k + 1))], Q(1) if k == 0 else Q(0)) for k, x in enumerate(lengths)]
    history, traced, joints = in_a_row(rods, [Q(0), Q(1, 8)], Q(25))
    assert_same(history, traced, joints, Q(25))
    momentum = sum(history.evaluate([0.0, 7.0, 25.0], f"momentum:r{k}") for k in range(3))
    assert momentum == pytest.approx(math.sqrt(2.0), abs=1e-12)


def test_one_striker_on_two_rods_side_by_side():
    # both are struck with the velocity of the face, Z V/(Z + Z1 + Z2): as one rod of Z1 + Z2 would be
    striker, one, two = rod("striker", velocity=1.0), rod("one", 3.0, 0.4), rod("two", 3.0, 1.1)
    contacts = [(point(striker, "right"), point(b, "left"), 0.0, HARD) for b in (one, two)]
    history = solve(*scene([striker, one, two], contacts, 1.9))
    bar = rod("b", 3.0, 1.5)
    together = solve(*scene([striker, bar], [(point(striker, "right"), point(bar, "left"), 0.0, HARD)], 1.9))
    t = np.linspace(0.0, 1.9, 20)
    assert history.evaluate(t, "force:striker.right|one.left") == pytest.approx(0.4 / 2.5, abs=1e-14)
    assert history.evaluate(t, "force:striker.right|two.left") == pytest.approx(1.1 / 2.5, abs=1e-14)
    assert together.evaluate(t, "force:striker.right|b.left") == pytest.approx(1.5 / 2.5, abs=1e-14)


def test_a_mass_and_a_rod_strike_one_bare_face():
    # the mass closes first and leads the face; the rod that comes later is pushed by what the mass then has
    target, other = rod("target", 6.0, 1.0), rod("other", 6.0, 0.5, velocity=0.0)
    ball = Mass("ball", 2.0, 1.0)
    face = point(target, "left")
    contacts = [(point(ball), face, 0.0, HARD), (point(other, "right"), face, 0.0, HARD)]
    history = solve(*scene([ball, other, target], contacts, 5.0))
    # other rests: the face runs away from it, and only the ball's contact closes: m v' = -Z v
    t = np.linspace(0.0, 5.0, 30)
    assert history.evaluate(t, "velocity:ball") == pytest.approx(np.exp(-0.5 * t), abs=1e-13)
    fast = replace(other, velocity=1.5)
    contacts[1] = (point(fast, "right"), face, 0.0, HARD)
    history = solve(*scene([ball, fast, target], contacts, 5.0))
    # both closed: m v' = -Z v + Z2 (V - v)
    rest = 0.5 * 1.5 / 1.5
    expected = rest + (1.0 - rest) * np.exp(-0.75 * t)
    assert history.evaluate(t, "velocity:ball") == pytest.approx(expected, abs=1e-13)
    push = history.evaluate(t, "force:other.right|target.left")
    assert push == pytest.approx(0.5 * (1.5 - expected), abs=1e-13)
    assert history.evaluate(t, "force:ball|target.left") == pytest.approx(expected - push, abs=1e-13)


def test_masses_that_would_strike_each_other_are_refused():
    bar, a, b = rod(), Mass("a", 1.0, 1.0), Mass("b", 1.0, 1.0)
    at_one_face = scene([a, b, bar], [(point(m), point(bar, "left"), 0.0, HARD) for m in (a, b)], 1.0)
    at_each_other = scene([a, b, bar], [(point(a), point(b), 0.0, HARD)], 1.0)
    for wrong in (at_one_face, at_each_other):
        with pytest.raises(CaseError, match="restitution"):
            solve(*wrong)
        assert "restitution" in (serves(*wrong) or "")


# ---- walls ---------------------------------------------------------------------------------------------------------


def bouncing(bounces):
    """The bar of Doyen, Ern and Piperno, 2011: E 900, rho 1, L 10, A 1, from a height of 5 under gravity 10."""
    bar, wall = Rod("bar", (Segment(10.0, 1.0, 900.0, 1.0),), FREE, FREE), Wall("wall")
    return scene([wall, bar], [(point(wall), point(bar, "left"), 5.0, HARD)], 8.0 / 3.0 * bounces, -10.0, 2.0 / 3.0)


def test_bouncing_bar_for_100_bounces():
    # It falls for 1 s, touches for 2/3 s with 300 + 300 t', flies as it fell, vibrating; then 500 - 300 t' undoes the
    # vibration. 4e-12 was seen after 267 s: the rounding of 1800 times of up to 267 s, 100 times over.
    history = solve(*bouncing(100))
    closings = 1.0 + 8.0 / 3.0 * np.arange(100)
    assert [e.time for e in history.events if e.kind == "close"] == pytest.approx(closings, abs=2e-11)
    assert [e.time for e in history.events if e.kind == "open"] == pytest.approx(closings + 2.0 / 3.0, abs=2e-11)
    late = np.linspace(0.005, 0.66, 12)
    for k, closing in enumerate(closings):
        expected = 500.0 - 300.0 * late if k % 2 else 300.0 + 300.0 * late
        assert history.evaluate(closing + late, "force:wall|bar.left") == pytest.approx(expected, rel=1e-11)
    # after every second contact it is as at the start: unstrained, at its height, at rest
    height = history.evaluate(16.0 / 3.0 * np.arange(1, 51), "displacement:bar@0")
    assert height == pytest.approx(0.0, abs=1e-9)
    # balance in J, of 500 J in play
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 500.0 * 1e-11


def test_rod_between_two_walls():
    # flights across the sum of the gaps, contacts of 2 L/c at each wall, without end
    v, length, gaps = 0.8, 1.3, (0.3, 0.5)
    bar, left, right = rod(length=length, velocity=v), Wall("left"), Wall("right")
    contacts = [(point(left), point(bar, "left"), gaps[0], HARD), (point(bar, "right"), point(right), gaps[1], HARD)]
    history = solve(*scene([left, bar, right], contacts, 500.0))
    turn = sum(gaps) / v + 2.0 * length
    closings = gaps[1] / v + turn * np.arange(len(history.contacts))
    assert [span.start for span in history.contacts] == pytest.approx(closings, abs=1e-10)
    ends = [span.end for span in history.contacts if span.end is not None]
    assert ends == pytest.approx(closings[: len(ends)] + 2.0 * length, abs=1e-10)
    for k, span in enumerate(history.contacts):
        assert span.contact == ("bar.right|right" if k % 2 == 0 else "left|bar.left").replace("bar", bar.name)
        assert span.peak_force == pytest.approx(v, abs=1e-12)


def test_rod_tight_between_two_walls_is_plucked():
    # no gaps: the contacts hold it as clamps do as long as both press, which a preload sees to
    strain, rise = 0.01, 0.004
    left, right = Wall("left"), Wall("right")

    def shape(x):
        return strain * (0.5 - x) + rise / math.pi * np.sin(math.pi * x)

    bar = rod(displacement=shape)
    gap = -strain / 2
    contacts = [(point(left), point(bar, "left"), gap, HARD), (point(bar, "right"), point(right), gap, HARD)]
    history = solve(*scene([left, bar, right], contacts, 30.0))
    t = np.linspace(0.0, 30.0, 301)
    expected = strain - rise * np.cos(math.pi * t)
    assert history.evaluate(t, "force:left|rod.left") == pytest.approx(expected, abs=1e-13)
    assert [event.kind for event in history.events] == ["close", "close"]


def test_periodic_bar():
    # u = (1-x)/2: compressed by 1/2, the bar springs back: its end meets the obstacle at t = 1, all of it
    # moving with -1/2; it is stopped with the force 1/2 until t = 2, and leaves as it came: period 3
    bar, wall = rod(right=CLAMPED, displacement=lambda x: 0.5 * (1.0 - x)), Wall("wall")
    history = solve(*scene([wall, bar], [(point(wall), point(bar, "left"), 0.0, HARD)], 300.0))
    starts = 1.0 + 3.0 * np.arange(100)
    assert [span.start for span in history.contacts] == pytest.approx(starts, abs=1e-11)
    assert [span.end for span in history.contacts] == pytest.approx(starts + 1.0, abs=1e-11)
    assert [span.impulse for span in history.contacts] == pytest.approx([0.5] * 100, abs=1e-12)
    t = np.linspace(0.0, 300.0, 2000)
    late = np.abs(np.mod(t + 1.5, 3.0) - 1.5)  # time to the nearest instant at which it is as at the start
    assert history.evaluate(t, "displacement:rod@0") == pytest.approx(np.maximum(0.0, 0.5 * (1.0 - late)), abs=1e-11)
    assert history.energy.total[0] == pytest.approx(0.125, abs=1e-15)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


# ---- masses --------------------------------------------------------------------------------------------------------


def test_two_masses_strike_both_ends():
    # by symmetry each strikes half a rod that is clamped: alpha = 1, the paper's scene (its second contact included)
    bar, a, b = rod(length=2.0), Mass("a", 1.0, 1.0), Mass("b", 1.0, -1.0)
    contacts = [(point(a), point(bar, "left"), 0.0, HARD), (point(bar, "right"), point(b), 0.0, HARD)]
    history = solve(*scene([a, bar, b], contacts, 6.0))
    for contact in ("a|rod.left", "rod.right|b"):
        times = [event.time / 2.0 for event in history.events if event.contact == contact]
        # computed with 40 digits in PHYSICS 1
        assert times == pytest.approx([0.0, 1.53383382080915, 2.12462323494217, 2.16284275559957], abs=1e-12)
    leaves = [-0.687618939800652, -0.698875581996163]
    assert history.evaluate([3.6, 5.8], "velocity:a") == pytest.approx(leaves, abs=1e-12)
    assert float(history.evaluate(5.8, "velocity:b")) == pytest.approx(0.698875581996163, abs=1e-12)


def test_a_mass_strikes_a_rod_that_carries_a_mass():
    # what enters is v0 exp(-Z t/M1); at the other end M2 v' = 2 Z r - Z v; true there until 3 L/c
    m1, m2, z = 0.9, 0.4, 1.0
    bar, a, b = rod(z=z), Mass("a", m1, 1.0), Mass("b", m2)
    contacts = [(point(a), point(bar, "left"), 0.0, HARD), (point(bar, "right"), point(b), 0.0, HARD)]
    history = solve(*scene([a, bar, b], contacts, 40.0))
    l1, l2 = z / m1, z / m2
    s = np.linspace(0.0, 0.57, 25)
    v = 2.0 * l2 / (l2 - l1) * (np.exp(-l1 * s) - np.exp(-l2 * s))
    rate = 2.0 * l2 / (l2 - l1) * (l2 * np.exp(-l2 * s) - l1 * np.exp(-l1 * s))
    assert np.all(rate > 0.0)
    assert history.evaluate(1.0 + s, "velocity:b") == pytest.approx(v, abs=1e-13)
    assert history.evaluate(1.0 + s, "force:rod.right|b") == pytest.approx(m2 * rate, abs=1e-12)
    whole = sum(history.evaluate([0.0, 3.3, 40.0], f"momentum:{name}") for name in ("a", "rod", "b"))
    assert whole == pytest.approx(m1, abs=1e-12)


def test_ram_cushion_cap_and_pile():
    # Ram m1, cushion (k, c), cap m2 pressing a pile of impedance Z: linear until the cap is thrown back or the wave
    # returns; the state by the exponential of a matrix
    m1, m2, k, c, z = 2.0, 0.6, 3.0, 0.2, 1.0
    ram, cap, pile = Mass("ram", m1, 1.0), Mass("cap", m2), rod("pile", 5.0, z)
    contacts = [(point(ram), point(cap), 0.0, Penalty(k, c)), (point(cap), point(pile, "left"), 0.0, HARD)]
    history = solve(*scene([ram, cap, pile], contacts, 60.0))
    a = np.zeros((4, 4))
    a[0, 2] = a[1, 3] = 1.0
    a[2] = np.array([-k, k, -c, c]) / m1
    a[3] = np.array([k, -k, c, -c - z]) / m2
    assert min(span.end for span in history.contacts) > 10.0
    t = np.linspace(0.01, 9.99, 30)
    states = np.array([expm(a * time) @ [0.0, 0.0, 1.0, 0.0] for time in t])
    assert history.evaluate(t, "position:ram") == pytest.approx(states[:, 0], abs=1e-12)
    assert history.evaluate(t, "velocity:cap") == pytest.approx(states[:, 3], abs=1e-12)
    cushion = k * (states[:, 0] - states[:, 1]) + c * (states[:, 2] - states[:, 3])
    assert history.evaluate(t, "force:ram|cap") == pytest.approx(cushion, abs=1e-12)
    whole = sum(history.evaluate(np.linspace(0.0, 60.0, 7), f"momentum:{name}") for name in ("ram", "cap", "pile"))
    assert whole == pytest.approx(m1, abs=1e-11)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


def test_two_masses_and_a_spring_that_never_meet_the_rod():
    # a junction without rods: the spring swings, v_a - v_b = cos(w t) until it lets go at w t = pi
    a, b, bar = Mass("a", 1.0, 1.0), Mass("b", 3.0), rod()
    history = solve(*scene([a, b, bar], [(point(a), point(b), 0.0, Penalty(2.0))], 5.0))
    w = math.sqrt(2.0 * (1.0 + 1.0 / 3.0))
    assert [e.time for e in history.events] == pytest.approx([0.0, math.pi / w], abs=1e-13)
    assert history.evaluate([4.0], "velocity:a") == pytest.approx(-0.5, abs=1e-13)
    assert history.evaluate([4.0], "velocity:b") == pytest.approx(0.5, abs=1e-13)
    assert history.contacts[0].peak_force == pytest.approx(2.0 / w, abs=1e-13)


@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_cushion_between_two_rods(damping):
    # both faces answer with Z: F = k d + c d', d' = V - F (1/Z1 + 1/Z2)
    z1, z2, k, v = 2.0, 0.7, 3.0, 1.5
    a, b = rod("a", 9.0, z1, velocity=v), rod("b", 9.0, z2)
    history = solve(*scene([a, b], [(point(a, "right"), point(b, "left"), 0.0, Penalty(k, damping))], 17.0))
    y = 1.0 / z1 + 1.0 / z2
    t = np.linspace(0.0, 16.9, 50)
    first, last = damping * v / (1.0 + damping * y), v / y
    expected = last + (first - last) * np.exp(-k * y * t / (1.0 + damping * y))
    assert history.evaluate(t, "force:a.right|b.left") == pytest.approx(expected, abs=1e-12)


# ---- viscous ends and preloads -------------------------------------------------------------------------------------


@pytest.mark.parametrize("dashpot", [0.0, 0.4, 1.0, 2.5, 1e3])
def test_viscous_end_returns_its_share(dashpot):
    # R = (D - Z)/(D + Z) of the first wave comes back: vm = exp(-l y) (exp(-2 l) - 2 l R y) for y < 2, l = Z/M
    rate = 0.8
    bar, hammer = rod(right=End("dashpot", dashpot) if dashpot else FREE), Mass("hammer", 1.0 / rate, 1.0)
    history = solve(*scene([hammer, bar], [(point(hammer), point(bar, "left"), 0.0, HARD)], 4.0))
    share = (dashpot - 1.0) / (dashpot + 1.0)
    y = np.linspace(0.0, min(history.contacts[0].end or 4.0, 4.0) - 2.0, 20)
    vm = np.exp(-rate * y) * (math.exp(-2.0 * rate) - 2.0 * rate * share * y)
    assert history.evaluate(2.0 + y, "velocity:hammer") == pytest.approx(vm, abs=1e-13)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


def loaded(weight, gravity, length=1.0, z=1.0):
    """A clamped rod under its own weight and that of a mass on its left end: its shape, and the gap the load closes."""

    def shape(x):
        return gravity * (weight * (length - x) / z + 0.5 * (length**2 - x**2))

    return rod("rod", length, z, FREE, CLAMPED, displacement=shape), -float(shape(0.0))


def test_dead_weight_rests_and_rests():
    m, g = 0.7, 0.1
    bar, gap = loaded(m, g)
    weight = Mass("weight", m)
    history = solve(*scene([weight, bar], [(point(weight), point(bar, "left"), gap, HARD)], 100.0, g))
    t = np.linspace(0.0, 100.0, 101)
    assert history.evaluate(t, "force:weight|rod.left") == pytest.approx(m * g, abs=1e-13)
    assert history.evaluate(t, "position:weight") == pytest.approx(0.0, abs=1e-13)
    assert history.evaluate(t, "force:rod@1") == pytest.approx((m + 1.0) * g, abs=1e-13)
    assert [event.kind for event in history.events] == ["close"]


def test_dead_weight_is_struck_through_a_cushion():
    # the blow is added to the rest: hammer and weight on a rod that answers with Z until its end does, by exp(A t)
    m, g, hammer, k = 0.7, 0.02, 0.5, 1.5
    bar, gap = loaded(m, g, length=4.0)
    weight, striker = Mass("weight", m), Mass("hammer", hammer, 1.0)
    contacts = [(point(striker), point(weight), 0.0, Penalty(k)), (point(weight), point(bar, "left"), gap, HARD)]
    history = solve(*scene([striker, weight, bar], contacts, 7.9, g))
    # hammer feels gravity, the weight's is borne by the rod
    a = np.zeros((5, 5))
    a[0, 2] = a[1, 3] = 1.0
    a[2, [0, 1, 4]] = -k / hammer, k / hammer, g
    a[3, [0, 1, 3]] = k / m, -k / m, -1.0 / m
    ends = [span.end for span in history.contacts if span.end is not None]
    t = np.linspace(0.02, min([*ends, 7.9]) - 0.02, 20)
    states = np.array([expm(a * time) @ [0.0, 0.0, 1.0, 0.0, 1.0] for time in t])
    assert history.evaluate(t, "velocity:weight") == pytest.approx(states[:, 3], abs=1e-12)
    expected = m * g + states[:, 3]
    assert history.evaluate(t, "force:weight|rod.left") == pytest.approx(expected, abs=1e-12)


def test_a_bar_stands_on_a_wall_under_gravity():
    # N = rho A g (L - x) towards the wall on the left; gravity to the left
    g, length = 0.2, 1.5
    bar = rod("bar", length, displacement=lambda x: -g * (length * x - 0.5 * x * x))
    wall = Wall("wall")
    history = solve(*scene([wall, bar], [(point(wall), point(bar, "left"), 0.0, HARD)], 50.0, -g))
    t = np.linspace(0.0, 50.0, 51)
    assert history.evaluate(t, "force:wall|bar.left") == pytest.approx(g * length, abs=1e-13)
    assert history.evaluate(t, f"displacement:bar@{length}") == pytest.approx(-0.5 * g * length**2, abs=1e-13)


def test_joint_under_preload_opens_when_the_tension_arrives():
    # Two rods pressed together by P between clamps; a collar on the right one is struck away from the joint. Behind it
    # runs tension Z v0 exp(-2 Z t/M): with Z v0 > P the joint opens as it arrives, after d/c, and the gap grows as
    # (M/Z) v0 (1 - exp(-2 Z s/M)) - 2 P s/Z until other waves come.
    press, m, v0, way = 0.01, 0.4, 0.03, 1.0
    a = rod("a", 3.0, left=CLAMPED, displacement=lambda x: -press * x)
    b = rod("b", 3.0, right=CLAMPED, displacement=lambda x: press * (3.0 - x))
    collar = Mass("collar", m, v0)
    contacts = [
        (point(a, "right"), point(b, "left"), -6.0 * press, HARD),
        (point(collar), Point("b", way, "b.at(1)"), -press * (3.0 - way), HARD),
    ]
    history = solve(*scene([a, b, collar], contacts, 30.0))
    events = [(e.kind, e.time) for e in history.events if e.contact == "a.right|b.left"]
    assert events[0] == ("close", 0.0)
    assert events[1][0] == "open"
    assert events[1][1] == pytest.approx(way, abs=1e-13)
    assert history.evaluate([0.5, 0.99], "force:a.right|b.left") == pytest.approx(press, abs=1e-14)
    # the joint closes again when 2 (Z v - P) has turned the gap back, before the struck rod's other waves come back
    s = np.linspace(0.0, 0.35, 30)
    gap = m * v0 * (1.0 - np.exp(-2.0 * s / m)) - 2.0 * press * s
    assert np.all(gap[1:] > 0.0)
    assert history.evaluate(way + s, "gap:a.right|b.left") == pytest.approx(gap, abs=1e-14)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


def test_joint_that_is_pulled_apart_in_stairs():
    # the right rod starts away with v: the joint's force falls from P to P - Z v/2 > 0, and it opens when the
    # wave that this sent comes back from the near clamp; traced as square waves
    press, v = Q(3, 100), Q(1, 20)
    a = Piece(Q(1, 2), Q(1), strain_wave=press)
    b = Piece(Q(3, 2), Q(1), v, strain_wave=press)
    traced = trace([a, b], [Q(0)], Q(12), None, None)
    first = rod("a", 0.5, left=CLAMPED, displacement=lambda x: -0.03 * x)
    second = rod("b", 1.5, right=CLAMPED, velocity=0.05, displacement=lambda x: 0.03 * (1.5 - x))
    history = solve(*scene([first, second], [(point(first, "right"), point(second, "left"), -0.06, HARD)], 12.0))
    assert len(traced[0]) > 2
    assert_same(history, traced, [0], Q(12))
