"""Struck faces that carry a spring, a dashpot or a mass: force, impulse and energy against equations of their own."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from impactlab.contact.penalty import Penalty
from impactlab.errors import CaseError, PairingError
from impactlab.exact.solve import solve
from impactlab.scene import End, Mass, Rod, Segment, Wall
from tests.reference.exact_scenes import CLAMPED, FREE, HARD, name_of, point, rod, scene

SOFT = Penalty(6.0, 0.4)
BARE = [FREE, End("dashpot", 1.0), End("dashpot", 100.0), End("spring", 0.1), End("spring", 3.0), End("spring", 1e4)]
FACES = [*BARE, End("mass", 0.5)]


def written(value):
    """A face or a law in the name of a test."""
    return f"{value.kind}{value.value:g}" if isinstance(value, End) else None


def on_face(end, law, striker, mirrored):
    """A mass of 1 kg or a free rod of impedance 2 at speed 1 strikes the face of a rod; c = Z = L = 1."""
    speed = -1.0 if mirrored else 1.0
    hits = Mass("striker", 1.0, speed) if striker == "mass" else rod("striker", 0.8, 2.0, velocity=speed)
    bar = rod(left=CLAMPED, right=end) if mirrored else rod(left=end, right=CLAMPED)
    if mirrored:
        pair = (point(bar, "right"), point(hits, "left" if striker == "rod" else ""))
        return scene([bar, hits], [(*pair, 0.0, law)], 30.0)
    pair = (point(hits, "right" if striker == "rod" else ""), point(bar, "left"))
    return scene([hits, bar], [(*pair, 0.0, law)], 30.0)


STRUCK = [
    (end, striker, law)
    for end in FACES
    for striker in ("mass", "rod")
    for law in (HARD, SOFT)
    if not (end.kind == "mass" and striker == "mass" and law.hard)  # two rigid masses: refused, see below
]


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize(("end", "striker", "law"), STRUCK)
def test_impulse_is_the_momentum_the_striker_loses(end, striker, law, mirrored):
    history = solve(*on_face(end, law, striker, mirrored))
    before, after = history.evaluate(np.array([0.0, 30.0]), "momentum:striker")
    assert sum(span.impulse for span in history.contacts) == pytest.approx(abs(after - before), abs=1e-12)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12
    assert all(span.peak_force > 0.0 for span in history.contacts)


def test_a_hard_contact_of_two_masses_is_refused():
    with pytest.raises((CaseError, PairingError)) as refused:
        solve(*on_face(End("mass", 0.5), HARD, "mass", False))
    assert refused.value.remedy


def loads(end):
    """Spring and dashpot of a face."""
    return (end.value if end.kind == "spring" else 0.0), (end.value if end.kind == "dashpot" else 0.0)


def hard_force(t, mass, drag, spring, speed):
    """Force of a mass that moves with a face: mass v' = -drag v - spring u."""
    a = np.array([[0.0, 1.0], [-spring / mass, -drag / mass]])
    states = [expm(a * time) @ [0.0, speed] for time in t]
    return np.array([spring * u + drag * v for u, v in states])


def soft_force(t, drag, spring, law):
    """Force of a mass of 1 kg at speed 1 on a spring and dashpot on a face; unknowns: both places and its speed."""
    face = np.array([law.stiffness, -law.stiffness - spring, law.damping]) / (drag + law.damping)
    push = law.stiffness * np.array([1.0, -1.0, 0.0]) + law.damping * (np.array([0.0, 0.0, 1.0]) - face)
    a = np.array([[0.0, 0.0, 1.0], face, -push])
    return np.array([push @ (expm(a * time) @ [0.0, 0.0, 1.0]) for time in t])


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("law", [HARD, SOFT], ids=["hard", "penalty"])
@pytest.mark.parametrize("end", BARE, ids=written)
def test_force_of_a_mass_before_the_reflection(end, law, mirrored):
    history = solve(*on_face(end, law, "mass", mirrored))
    t = np.linspace(0.0, min(2.0, history.contacts[0].end), 80, endpoint=False)
    spring, dashpot = loads(end)
    drag = 1.0 + dashpot
    expected = hard_force(t, 1.0, drag, spring, 1.0) if law.hard else soft_force(t, drag, spring, law)
    force = history.evaluate(t, f"force:{name_of(history)}")
    assert force == pytest.approx(expected, abs=1e-12 * np.max(expected))


@pytest.mark.parametrize("one", [FREE, End("spring", 0.7), End("dashpot", 0.3)], ids=written)
@pytest.mark.parametrize("other", [FREE, End("spring", 2.0), End("dashpot", 1.5)], ids=written)
def test_force_of_rod_on_rod_before_the_reflection(one, other):
    # both faces at u: 2 (1 - v) - d1 v - k1 u = F = (3 + d2) v + k2 u
    a, b = rod("a", 1.0, 2.0, right=one, velocity=1.0), rod("b", 1.0, 3.0, left=other)
    history = solve(*scene([a, b], [(point(a, "right"), point(b, "left"), 0.0, HARD)], 6.0))
    (k1, d1), (k2, d2) = loads(one), loads(other)
    t = np.linspace(0.0, 2.0, 60, endpoint=False)
    drag, spring = 5.0 + d1 + d2, k1 + k2
    v = 2.0 / drag * np.exp(-spring * t / drag)
    u = (2.0 - drag * v) / spring if spring > 0.0 else v * t
    force = history.evaluate(t, f"force:{name_of(history)}")
    assert force == pytest.approx((3.0 + d2) * v + k2 * u, abs=1e-13)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("stiffness", [1e8, 1e9])
def test_steel_rod_on_a_stiff_spring_is_struck_once(stiffness, mirrored):
    segment = Segment(4.0, math.pi * 0.01**2, 2.1e11, 7850.0)
    end = End("spring", stiffness)
    bar = Rod("rod", (segment,), FREE if mirrored else end, end if mirrored else FREE)
    hammer = Mass("hammer", 1.0, -1.0 if mirrored else 1.0)
    pair = (point(bar, "right"), point(hammer)) if mirrored else (point(hammer), point(bar, "left"))
    bodies = [bar, hammer] if mirrored else [hammer, bar]
    history = solve(*scene(bodies, [(*pair, 0.0, HARD)], 1.5e-3))
    assert [event.kind for event in history.events] == ["close", "open"]
    t = np.linspace(0.0, history.contacts[0].end, 80, endpoint=False)
    expected = hard_force(t, 1.0, segment.impedance, stiffness, 1.0)
    force = history.evaluate(t, f"force:{name_of(history)}")
    assert force == pytest.approx(expected, abs=1e-12 * np.max(expected))
    before, after = history.evaluate(np.array([0.0, 1.5e-3]), "velocity:hammer")
    assert history.contacts[0].impulse == pytest.approx(abs(after - before), abs=1e-12)
    assert max(history.energy.largest_gain, history.energy.largest_loss) < 1e-12


def test_a_face_named_by_six_digits_is_read_at_the_end_also_behind_a_short_segment():
    # 1.0000004 is named 1: 2e-4 of the last segment away from the face, and on the wall all the same
    segments = (Segment(0.998, 1.0, 1.0, 1.0), Segment(0.0020004, 1.0, 1.0, 1.0))
    bar = Rod("rod", segments, FREE, FREE, velocity=1.0)
    wall = Wall("wall")
    history = solve(*scene([bar, wall], [(point(bar, "right"), point(wall), 1e-4, HARD)], 1.0))
    face = history.evaluate(np.linspace(1e-3, 1.0, 50), "displacement:rod@1")
    assert face == pytest.approx(np.full(50, 1e-4), rel=1e-9)
