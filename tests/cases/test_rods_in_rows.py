"""Rods that meet rods, and rods of several parts: stairs of force, in closed form or traced in fractions."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction

import numpy as np
import pytest

from tests.cases.support import case_of, exact, times
from tests.reference.wave_tracer import Piece, trace


def test_two_rods() -> None:
    """Equal impedance: the shorter striker gives its whole momentum in 2 L1/c and stays at rest."""
    history = exact("two_rods")
    speed = (2.1e11 / 7900.0) ** 0.5
    [contact] = history.contacts
    assert contact.end == pytest.approx(0.4 / speed, rel=1e-12)
    assert contact.impulse == pytest.approx(0.474, rel=1e-12)
    assert contact.peak_force == pytest.approx(0.5 * 7900.0 * speed * 3.0e-4, rel=1e-12)
    assert float(history.evaluate(history.duration, "momentum:striker")) == pytest.approx(0.0, abs=1e-12)
    assert float(history.evaluate(history.duration, "momentum:target")) == pytest.approx(0.474, rel=1e-12)


def test_hopkinson_chain() -> None:
    """A pulse of Z1 V/2 for 2 L0/c; 4/3 of it passes into twice the section, 1/3 comes back."""
    history = exact("hopkinson_chain")
    speed = (2.0e11 / 7800.0) ** 0.5
    pulse = 0.5 * 10.0 * 7800.0 * speed * 2.0e-4
    assert times(history, "striker.right|incident.left")[:2] == pytest.approx([1e-4, 1e-4 + 0.4 / speed], rel=1e-12)
    assert history.contacts[0].peak_force == pytest.approx(pulse, rel=1e-12)
    late = 1e-4 + 1.0 / speed + np.array([0.01, 0.39]) / speed
    assert history.evaluate(late, "force:incident.right|transmission.left") == pytest.approx(4 / 3 * pulse, rel=1e-12)
    assert history.evaluate(late + 0.5 / speed, "stress:incident@0.5") == pytest.approx(pulse / 3 / 2e-4, rel=1e-12)


def test_two_material_rod() -> None:
    """The force decays from Z1 v0 and falls by 2 (Z1-Z2)/(Z1+Z2) Z1 v0 as the wave from the boundary returns."""
    history = exact("two_material_rod")
    c1 = (2.0e11 / 7800.0) ** 0.5
    z1, z2 = 2.0e-4 * (2.0e11 * 7800.0) ** 0.5, 2.0e-4 * (7.0e10 * 2700.0) ** 0.5
    back = 0.6 / c1
    force = history.evaluate([0.0, 0.5 * back, back * (1 - 1e-9), back * (1 + 1e-9)], "force:hammer|rod.left") / z1
    assert force[0] == pytest.approx(1.0, rel=1e-12)
    assert force[1] == pytest.approx(math.exp(-z1 / 0.8 * 0.5 * back), rel=1e-12)
    assert force[2] == pytest.approx(math.exp(-z1 / 0.8 * back), rel=1e-8)
    # what comes back is more tension than there is force: the contact opens
    assert force[2] < 2.0 * (z1 - z2) / (z1 + z2)
    assert force[3] == 0.0
    assert times(history, "hammer|rod.left")[1] == pytest.approx(back, rel=1e-12)


def test_stepped_rod() -> None:
    """The stairs, traced as square waves: the wall is where the rod's mirror image would stand."""
    history = exact("stepped_rod")
    halves = [Piece(Fraction(1), Fraction(z), Fraction(1)) for z in (4, 2, 1)]
    image = [Piece(Fraction(1), Fraction(z), Fraction(-1)) for z in (1, 2, 4)]
    events, forces = trace([*halves, *image], [None, None, Fraction(0), None, None], Fraction(18))
    speed = (2.0e11 / 7800.0) ** 0.5
    unit, first = 0.2 / speed, 2.0 * 7800.0 * speed * 1e-4
    assert times(history, "rod.right|wall") == pytest.approx([float(t) * unit for t, _, _ in events], abs=1e-12 * unit)
    for start, force in forces[2]:
        seen = float(history.evaluate((float(start) + 1.0) * unit, "force:rod.right|wall"))
        assert seen == pytest.approx(float(force) * first, abs=1e-12 * first)
    assert forces[2][3][1] == Fraction(317, 243)


def test_opening_joint() -> None:
    """Square waves in the two rods, traced in fractions; units L1/c = 100 us and Z (m/s) = 4000 N."""
    history = exact("opening_joint")
    rods = [
        Piece(Fraction(1), Fraction(1), strain_wave=Fraction(2)),
        Piece(Fraction(5, 2), Fraction(1), Fraction(3), strain_wave=Fraction(2)),
    ]
    events, forces = trace(rods, [Fraction(0)], Fraction(89, 10), None, None)
    expected = [float(t) * 1e-4 for t, _, _ in events]
    assert times(history, "left.right|right.left") == pytest.approx(expected, abs=1e-15)
    assert expected[1:4] == pytest.approx([2.0e-4, 2.75e-4, 7.5e-4])
    for start, force in forces[0]:
        seen = float(history.evaluate((float(start) + 0.1) * 1e-4, "force:left.right|right.left"))
        assert seen == pytest.approx(4000.0 * float(force), abs=1e-7)


@pytest.mark.parametrize(("label", "z1", "z2"), [("", 2, 1), ("/steep", 4, 1), ("/rebound", 1, 2)])
def test_rod_on_rod(label: str, z1: int, z2: int) -> None:
    """F0 r^n on each round trip of the striker; the whole also traced as square waves (units 40 us, Z2 V)."""
    history, name = exact(f"rod_on_rod{label}"), "striker.right|target.left"
    ratio = (z1 - z2) / (z1 + z2)
    area = case_of(f"rod_on_rod{label}").scene().bodies["target"].segments[0].area  # type: ignore[union-attr]
    unit = 8000.0 * 5000.0 * area * 5.0  # Z2 V
    first = unit * z1 / (z1 + z2)
    pieces = [Piece(Fraction(1), Fraction(z1, z2), Fraction(1)), Piece(Fraction(7, 2), Fraction(1))]
    events, forces = trace(pieces, [Fraction(0)], Fraction(9))
    assert times(history, name) == pytest.approx([float(t) * 4.0e-5 for t, _, _ in events], abs=1e-15)
    for start, force in forces[0]:
        assert float(history.evaluate((float(start) + 0.1) * 4.0e-5, f"force:{name}")) == pytest.approx(
            float(force) * unit, abs=1e-9 * unit
        )
    for n in range(4 if z1 > z2 else 1):
        late = float(history.evaluate((2.0 * n + 0.5) * 4.0e-5, f"force:{name}"))
        assert late == pytest.approx(first * ratio**n, rel=1e-12)
    if z1 < z2:
        momentum = float(history.evaluate(history.duration, "momentum:striker"))
        assert momentum == pytest.approx(-0.64 * 5.0 / 3.0, rel=1e-12)


@pytest.mark.parametrize(
    ("label", "gaps", "sections"),
    [("", (0, 0), (2, 2, 2, 2)), ("/gaps", (1, 1), (2, 2, 2, 2)), ("/tapered", (0, 0), (8, 4, 2, 1))],
    ids=["equal", "gaps", "tapered"],
)
def test_chain_of_bars(label: str, gaps: tuple[int, int], sections: tuple[int, ...]) -> None:
    """Each joint hands on 2 Z1/(Z1 + Z2) of the velocity; the whole also traced (units L/c = 50 us, V = 5 m/s)."""
    history = exact(f"chain_of_bars{label}")
    pieces = [Piece(Fraction(1), Fraction(z), Fraction(1 if i == 0 else 0)) for i, z in enumerate(sections)]
    # 0.1 mm are 20 us of V, 2/5 of a unit
    events, forces = trace(pieces, [Fraction(0), *(Fraction(2 * g, 5) for g in gaps)], Fraction(32, 5))
    bars = ("first", "second", "third", "fourth")
    names = [f"{a}.right|{b}.left" for a, b in itertools.pairwise(bars)]
    for joint, name in enumerate(names):
        traced = [float(t) * 5.0e-5 for t, where, _ in events if where == joint]
        begin = joint * (70e-6 if gaps[0] else 50e-6)
        assert traced == pytest.approx([begin, begin + 100e-6], abs=1e-15)
        assert times(history, name) == pytest.approx(traced, abs=1e-15)
        z1, z2 = 4000.0 * sections[joint], 4000.0 * sections[joint + 1]
        passed = 5.0 * math.prod(2 * a / (a + b) for a, b in itertools.pairwise(sections[: joint + 1]))
        force = z1 * z2 / (z1 + z2) * passed
        assert force == pytest.approx(4000.0 * 5.0 * float(max(f for _, f in forces[joint])), rel=1e-12)
        span = next(span for span in history.contacts if span.contact == name)
        assert span.peak_force == pytest.approx(force, rel=1e-12)
        assert span.impulse == pytest.approx(force * 100e-6, rel=1e-12)
    last = float(history.evaluate(history.duration, "momentum:fourth"))
    mass = 8000.0 * 0.25 * 1e-4 * sections[3]
    assert last / mass == pytest.approx(5.0 * (64 / 27 if sections[0] == 8 else 1), rel=1e-12)
